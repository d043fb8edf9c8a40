#pragma once

#include <chrono>
#include <map>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

namespace sqslam {

// Durations of named stages ("tracking", "mapping.bundle_adjustment", ...), collected from any thread. For
// very frequent stages, median and p95 come from an even sample of the durations, to bound the memory in long
// runs.
class StageTimes {
 public:
  struct Summary {
    double mean = 0.0;  // all in milliseconds
    double median = 0.0;
    double p95 = 0.0;
    double max = 0.0;
    int count = 0;
  };

  // Measures from construction to destruction: { StageTimes::Scope scope(times, "mapping"); ... }
  class Scope {
   public:
    Scope(StageTimes& times, std::string_view stage) : times_(times), stage_(stage) {}
    ~Scope() { times_.Add(stage_, std::chrono::duration<double, std::milli>(Clock::now() - start_).count()); }
    Scope(const Scope&) = delete;
    Scope& operator=(const Scope&) = delete;

   private:
    using Clock = std::chrono::steady_clock;
    StageTimes& times_;
    std::string_view stage_;
    Clock::time_point start_ = Clock::now();
  };

  void Add(std::string_view stage, double milliseconds);
  std::map<std::string, Summary> Summaries() const;

 private:
  struct Samples {
    double sum = 0.0;
    double max = 0.0;
    int count = 0;
    int every = 1;             // one in this many durations is kept
    std::vector<double> kept;  // in the order of arrival

    void Add(double milliseconds);
    Summary Summarize() const;
  };

  mutable std::mutex mutex_;
  std::map<std::string, Samples> stages_;
};

}  // namespace sqslam
