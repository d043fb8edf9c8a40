#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "app/experiment/runner.h"
#include "app/terminal/terminal.h"
#include "slam/util/stopwatch.h"
#include "slam/util/throw_if.h"

namespace sqslam::app {
namespace fs = std::filesystem;
namespace {

fs::path FailureOf(const ExperimentFolder& folder, const std::string& cell) {
  return folder.path / "runs" / (cell + ".failed");
}

// Tracks the cells in an experiment's folder while tasks run them.
class FollowedCells {
 public:
  FollowedCells(const ExperimentPlan& plan, const LinePrinter& print)
      : plan_(plan), print_(print), results_(plan.cells.size()) {
    for (std::size_t i = 0; i < plan.cells.size(); ++i) {
      results_[i] = plan.cells[i].finished;
      todo_ += results_[i] ? 0 : 1;
    }
  }

  // Returns the names of the cells without a result; prints those that finished since the last call.
  std::vector<std::string> Unfinished() {
    std::error_code ignored;
    fs::directory_iterator(plan_.folder.path / "runs", ignored);  // opening it refreshes the cache of NFS
    std::vector<std::string> names;
    for (std::size_t i = 0; i < results_.size(); ++i) {
      const auto& [cell, commands, settings, finished] = plan_.cells[i];
      if (!results_[i] && (results_[i] = ReadCellResult(plan_.folder.Run(cell), cell, settings))) {
        ++done_;
        Say(cell.name, Headline(*results_[i]), results_[i]->stats.wall_seconds);
      }
      if (!results_[i]) {
        names.push_back(cell.name);
      }
    }
    return names;
  }

  ExperimentOutcome Outcome(bool ended, bool interrupted) {
    ExperimentOutcome outcome;
    outcome.cells = static_cast<int>(results_.size());
    outcome.reused = outcome.cells - static_cast<int>(todo_);
    outcome.interrupted = interrupted;
    for (std::size_t i = 0; i < results_.size(); ++i) {
      const std::string& name = plan_.cells[i].cell.name;
      if (results_[i]) {
        outcome.results.push_back(std::move(*results_[i]));
      } else if (ended) {
        const TaskFailure failure = ReadTaskFailure(FailureOf(plan_.folder, name));
        outcome.failures.push_back({name, failure.exit_code, failure.message});
      }
    }
    return outcome;
  }

 private:
  void Say(const std::string& name, const std::string& what, double seconds) {
    print_(ProgressLine(done_, todo_, stopwatch_.Seconds(), name, what, seconds));
  }

  const ExperimentPlan& plan_;
  const LinePrinter& print_;
  std::vector<std::optional<CellResult>> results_;
  std::size_t todo_ = 0;
  std::size_t done_ = 0;
  Stopwatch stopwatch_;
};

}  // namespace

ClusterOutcome RunOnSlurm(const ExperimentPlan& plan, const ArrayCall& call, const StopRequest& stop,
                          const LinePrinter& print) {
  FollowedCells cells(plan, print);
  const ArrayWork work{plan.folder.path.filename().string(),
                       plan.folder.path / "slurm",
                       ArgumentsWithoutTask(),
                       plan.config.jobs,
                       [&] { return cells.Unfinished(); },
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
    spdlog::warn("{}; no run is made again", error.what());
    cells.Unfinished();
  }
  return {cells.Outcome(end == ArrayEnd::kEnded, end == ArrayEnd::kStopped), end};
}

int RunTask(const ExperimentConfig& config, const ExperimentFolder& folder, const std::string& name,
            const StopRequest& stop) {
  const ExperimentPlan plan = PlanExperiment(config, folder, name);
  ThrowIf<UsageError>(plan.cells.empty(), "--task {}: no such run, expected one that --dry-run lists", name);
  const PlannedCell& planned = plan.cells.front();
  if (planned.finished) {
    return 0;
  }
  ChildResult child;
  std::string message;
  const auto work = [&] {
    ThrowIf<InputError>(RequeuedTooOften(config.slurm), "taken off its node too often");
    RenderSequence(plan, planned.cell, stop, [](const std::string&) {});
    if (planned.cell.max_objects != kAllObjects && !stop()) {
      WriteLimitedBoxes(plan, planned.cell);
    }
    child = stop() ? ChildResult{130, true, ""} : RunCell(plan, planned, ProgramFingerprint(), stop);
    message = child.message;
    ThrowIf<InputError>(
        child.exit_code == 0 && !ReadCellResult(folder.Run(planned.cell), planned.cell, planned.settings),
        "its result files cannot be read");
    return child.exit_code < 128 ? child.exit_code : 1;
  };
  const int code = ExitCodeOf(work, [&](const std::string& error) { message = error; });
  if (child.stopped) {
    return 130;
  }
  if (code == 0) {
    fs::remove(FailureOf(folder, name));
    return 0;
  }
  fs::create_directories(folder.path / "runs");
  WriteTaskFailure(FailureOf(folder, name), {code, message});
  PrintNotice(fmt::format("sqslam: {} failed: {}", name, message));
  return code;
}

}  // namespace sqslam::app
