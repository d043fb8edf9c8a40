#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "app/experiment/runner.h"
#include "app/terminal/terminal.h"
#include "slam/util/throw_if.h"

namespace sqslam::app {
namespace fs = std::filesystem;
namespace {

fs::path FailureOf(const ExperimentFolder& folder, const std::string& cell) {
  return folder.path / "runs" / (cell + ".failed");
}

}  // namespace

ClusterOutcome RunOnSlurm(const ExperimentPlan& plan, const ArrayCall& call, const StopRequest& stop,
                          const LinePrinter& print) {
  CellProgress progress(plan, print);
  const auto unfinished = [&] {
    std::error_code ignored;
    fs::directory_iterator(plan.folder.path / "runs", ignored);  // opening it refreshes the cache of NFS
    std::vector<std::string> names;
    for (const std::size_t index : progress.Unfinished()) {
      if (!progress.Collect(index)) {
        names.push_back(plan.cells[index].cell.name);
      }
    }
    return names;
  };
  const ArrayWork work{plan.folder.path.filename().string(),
                       plan.folder.path / "slurm",
                       ArgumentsWithoutTask(),
                       plan.config.jobs,
                       unfinished,
                       [&](const std::string& name) { return FailureOf(plan.folder, name); },
                       {plan.folder.path / "runs", plan.folder.path / "sequences"}};
  ArrayEnd end = ArrayEnd::kEnded;
  try {
    end = FollowArray(work, plan.config.slurm, call, stop, print);
  } catch (const InputError& error) {
    if (!call.last_job) {
      throw;
    }
    // Some clusters accept no jobs from their nodes: the tables then hold the results so far.
    spdlog::warn("{}; unfinished runs are not repeated", error.what());
    unfinished();
  }
  std::vector<CellFailure> failures;
  for (const std::size_t index : progress.Unfinished()) {
    const std::string& name = plan.cells[index].cell.name;
    const TaskEnd failure = ReadTaskFailure(FailureOf(plan.folder, name));
    failures.push_back({name, failure.exit_code, failure.message});
  }
  ClusterOutcome made{progress.Outcome(end == ArrayEnd::kStopped), end};
  if (end == ArrayEnd::kEnded) {
    made.outcome.failures = std::move(failures);
  }
  return made;
}

int RunTask(const ExperimentConfig& config, const ExperimentFolder& folder, const std::string& name,
            const StopRequest& stop) {
  const ExperimentPlan plan = PlanExperiment(config, folder, name);
  ThrowIf<UsageError>(plan.cells.empty(), "--task {}: no such run, expected one that --dry-run lists", name);
  const PlannedCell& planned = plan.cells.front();
  if (planned.finished) {
    return 0;
  }
  const fs::path failure = FailureOf(folder, name);
  fs::create_directories(failure.parent_path());
  return RunArrayTask(name, failure, config.slurm, [&]() -> TaskEnd {
    const ChildResult child = MakeCell(plan, planned, stop, [](const std::string&) {});
    if (child.stopped) {
      return {130, ""};
    }
    if (child.exit_code == 0) {
      fs::remove(failure);
    }
    return {child.exit_code < 128 ? child.exit_code : 1, child.message};
  });
}

}  // namespace sqslam::app
