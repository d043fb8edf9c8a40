#pragma once

#include <string>

#include "app/cluster/array_work.h"
#include "app/experiment/runner.h"

namespace sqslam::app {

struct ClusterOutcome {
  ExperimentOutcome outcome;
  ArrayEnd end = ArrayEnd::kEnded;
};

// Runs the unfinished cells of a plan on a Slurm cluster, one task each. `print` gets lines as in
// RunExperiment. Throws InputError if Slurm rejects a job.
ClusterOutcome RunOnSlurm(const ExperimentPlan& plan, const ArrayCall& call, const StopRequest& stop,
                          const LinePrinter& print);

// Runs one cell as a task. A failure is recorded next to the place of the result, for RunOnSlurm. Returns the
// exit code. Throws UsageError if there is no cell of this name.
int RunTask(const ExperimentConfig& config, const ExperimentFolder& folder, const std::string& name,
            const StopRequest& stop);

}  // namespace sqslam::app
