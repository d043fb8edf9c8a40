#pragma once

#include <chrono>
#include <map>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

namespace sqslam {

// Durations of named stages ("tracking", "mapping.bundle_adjustment", ...), collected from any thread: a
// megabyte per hour for a stage of every frame.
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
  mutable std::mutex mutex_;
  std::map<std::string, std::vector<double>> stages_;  // milliseconds
};

}  // namespace sqslam
