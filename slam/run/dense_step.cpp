#include "slam/run/dense_step.h"

#include <spdlog/spdlog.h>

#include "slam/dense/densify.h"
#include "slam/util/error.h"

namespace sqslam {

void MakeDense(const FinishedRun& run, const DenseOptions& options, int live, RunHost& host) {
  const bool stopped = run.interrupted;
  if (stopped && live == 0) {
    return;
  }
  if (run.sequence.empty()) {
    spdlog::warn("no dense cloud: not all of the mapped images exist as files");
    return;
  }
  try {
    const DensifySummary dense = Densify({.result = run.output, .options = options, .estimate = !stopped},
                                         [&](int done, int total, const std::string& state) {
                                           host.ShowProgress(done, total, state);
                                           if (done == total) {
                                             host.EndProgress();
                                           }
                                           return stopped || !host.Stopped();
                                         });
    if (!dense.interrupted) {
      host.Say(dense.Text());
      host.Mesh(run);
    }
  } catch (const NoMapError& error) {
    spdlog::warn(error.what());
  }
}

}  // namespace sqslam
