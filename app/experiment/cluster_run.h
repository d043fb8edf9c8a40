#pragma once

#include <string>

#include "app/cluster/array_work.h"
#include "app/experiment/runner.h"

namespace sqslam::app {

struct ClusterOutcome {
  ExperimentOutcome outcome;
  ArrayEnd end = ArrayEnd::kEnded;
};

// Makes the unfinished cells of a plan on a Slurm cluster, each as a task. Lines for `print` as RunExperiment
// has them. Throws InputError where Slurm does not take the job.
ClusterOutcome RunOnSlurm(const ExperimentPlan& plan, const ArrayCall& call, const StopRequest& stop,
                          const LinePrinter& print);

// Makes one cell, as a task does. A failure is kept beside the place of the result, for RunOnSlurm. Returns
// the exit code. Throws UsageError where there is no cell of this name.
int RunTask(const ExperimentConfig& config, const ExperimentFolder& folder, const std::string& name,
            const StopRequest& stop);

}  // namespace sqslam::app
