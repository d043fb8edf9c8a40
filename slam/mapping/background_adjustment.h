#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <future>
#include <optional>
#include <utility>

#include "slam/estimation/bundle_adjustment.h"

namespace sqslam {

// Runs a full bundle adjustment on a copy of the map while mapping continues. One at a time.
class BackgroundAdjustment {
 public:
  static constexpr int kCallsInStep = 5;
  using Solver = std::function<decltype(SolveBundle)>;

  // `in_step`: the solution is returned at call kCallsInStep of TakeFinished(), which waits for it, so that a
  // run can be repeated.
  explicit BackgroundAdjustment(bool in_step, Solver solve = SolveBundle)
      : in_step_(in_step), solve_(std::move(solve)) {}
  ~BackgroundAdjustment() { Stop(); }
  BackgroundAdjustment(const BackgroundAdjustment&) = delete;
  BackgroundAdjustment& operator=(const BackgroundAdjustment&) = delete;

  struct Job {
    std::int64_t submap = 0;
    Sim3d S_map_origin;  // origin of the submap when the problem was extracted
    BundleProblem problem;
  };

  // Cancels a running adjustment first.
  void Start(Job job, const BundleSolverOptions& options);

  // Returns the solution once, when it is finished. Rethrows the solver's exception.
  std::optional<Job> TakeFinished();

  // Waits for the solution and returns it; empty if no adjustment is running. Rethrows the solver's
  // exception.
  std::optional<Job> Wait();

  // Cancels the running adjustment and discards its result or error.
  void Stop();

 private:
  bool in_step_;
  Solver solve_;
  int calls_ = 0;  // of TakeFinished() since the start
  std::atomic<bool> stop_ = false;
  std::future<std::optional<Job>> running_;
};

// Writes a solution into a map that may have grown since, and whose frame was moved by S_now_then meanwhile.
// New keyframes follow their parent, new points the first keyframe that observes them.
void ApplyAdjustment(BundleProblem problem, const Sim3d& S_now_then, Map& map);

}  // namespace sqslam
