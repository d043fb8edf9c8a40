#pragma once

#include <atomic>
#include <cstdint>
#include <future>
#include <optional>

#include "slam/estimation/bundle_adjustment.h"

namespace sqslam {

// A full bundle adjustment that runs beside mapping, on a copy. One at a time.
class BackgroundAdjustment {
 public:
  // `in_background`: false solves at once, on the caller's thread, for runs that must be repeatable.
  explicit BackgroundAdjustment(bool in_background) : in_background_(in_background) {}
  ~BackgroundAdjustment() { Stop(); }
  BackgroundAdjustment(const BackgroundAdjustment&) = delete;
  BackgroundAdjustment& operator=(const BackgroundAdjustment&) = delete;

  struct Job {
    std::int64_t submap = 0;
    Sim3d S_map_origin;  // origin of the submap when the problem was extracted
    BundleProblem problem;
  };

  // Stops what is under way.
  void Start(Job job, const BundleSolverOptions& options);

  // The solution, once, when it is there.
  std::optional<Job> TakeFinished();

  // Waits for what is under way, and drops it.
  void Stop();

 private:
  bool in_background_;
  std::atomic<bool> stop_ = false;
  std::future<std::optional<Job>> running_;
};

// Writes a solution into a map that may have grown and moved since: S_now_then is how the map frame was
// moved. What is new follows the keyframe that it hangs on.
void ApplyAdjustment(BundleProblem problem, const Sim3d& S_now_then, Map& map);

}  // namespace sqslam
