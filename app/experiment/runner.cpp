#include "app/experiment/runner.h"

#include <algorithm>
#include <atomic>
#include <mutex>
#include <set>
#include <thread>

#include "app/experiment/cell_run.h"
#include "slam/util/error.h"
#include "slam/util/stopwatch.h"

namespace sqslam::app {
namespace fs = std::filesystem;
namespace {

// Runs the unfinished cells of a plan in several threads.
class Workers {
 public:
  Workers(const ExperimentPlan& plan, const StopRequest& stop, const LinePrinter& print)
      : plan_(plan), stop_(stop), print_(print), program_(ProgramFingerprint()), results_(plan.cells.size()) {
    for (std::size_t i = 0; i < plan.cells.size(); ++i) {
      results_[i] = plan.cells[i].finished;
      if (!results_[i]) {
        todo_.push_back(i);
      }
    }
  }

  ExperimentOutcome Run() {
    ExperimentOutcome outcome;
    outcome.cells = static_cast<int>(plan_.cells.size());
    outcome.reused = outcome.cells - static_cast<int>(todo_.size());
    PrepareInputs();
    stopwatch_ = {};
    {
      std::vector<std::jthread> threads;
      for (std::size_t i = 0; i < std::min<std::size_t>(plan_.config.jobs, todo_.size()); ++i) {
        threads.emplace_back([this] { Work(); });
      }
    }
    for (auto& result : results_) {
      if (result) {
        outcome.results.push_back(std::move(*result));
      }
    }
    for (auto& [index, failure] : failures_) {
      outcome.failures.push_back(std::move(failure));
    }
    outcome.interrupted = stop_();
    return outcome;
  }

 private:
  // Renders scenes and writes limited boxes, once for all cells that need them.
  void PrepareInputs() {
    for (const std::size_t index : todo_) {
      const ExperimentCell& cell = plan_.cells[index].cell;
      if (stop_()) {
        return;
      }
      Attempt(cell.sequence, [&] { RenderSequence(plan_, cell, stop_, print_); });
      if (cell.max_objects != kAllObjects && !broken_.contains(cell.sequence) && !stop_()) {
        Attempt(NameOfBoxes(cell), [&] { WriteLimitedBoxes(plan_, cell); });
      }
    }
  }

  // Runs `action` once per name; an InputError is kept under the name.
  void Attempt(const std::string& name, const std::function<void()>& action) {
    if (!attempted_.insert(name).second) {
      return;
    }
    try {
      action();
    } catch (const InputError& error) {
      broken_[name] = error.what();
    }
  }

  void Work() {
    while (!stop_()) {
      const std::size_t next = next_++;
      if (next >= todo_.size()) {
        return;
      }
      const Stopwatch stopwatch;
      ChildResult child;
      try {
        child = Run(todo_[next]);
      } catch (const std::exception& error) {  // a full disk, a folder that cannot be removed
        child = {3, false, error.what()};
      }
      if (!child.stopped) {
        Report(todo_[next], child, stopwatch.Seconds());
      }
    }
  }

  ChildResult Run(std::size_t index) const {
    const ExperimentCell& cell = plan_.cells[index].cell;
    for (const std::string& needed : {cell.sequence, NameOfBoxes(cell)}) {
      if (const auto broken = broken_.find(needed); broken != broken_.end()) {
        return {3, false, broken->second};
      }
    }
    return RunCell(plan_, plan_.cells[index], program_, stop_);
  }

  void Report(std::size_t index, const ChildResult& child, double seconds) {
    const ExperimentCell& cell = plan_.cells[index].cell;
    std::optional<CellResult> result;
    std::string what;
    if (child.exit_code == 0) {
      result = ReadCellResult(plan_.folder.Run(cell), cell, plan_.cells[index].settings);
      what = result ? Headline(*result) : "its result files cannot be read";
    } else {
      what = "FAILED: " + child.message;
    }
    const std::lock_guard lock(mutex_);
    ++done_;
    if (result) {
      results_[index] = std::move(result);
    } else {
      const int code = child.exit_code > 0 && child.exit_code < 128 ? child.exit_code : 1;
      failures_[index] = {cell.name, code, child.exit_code == 0 ? what : child.message};
    }
    print_(ProgressLine(done_, todo_.size(), stopwatch_.Seconds(), cell.name, what, seconds));
  }

  const ExperimentPlan& plan_;
  const StopRequest& stop_;
  const LinePrinter& print_;
  std::string program_;
  std::vector<std::size_t> todo_;              // indices of cells
  std::set<std::string> attempted_;            // inputs: names of sequences and of limited boxes
  std::map<std::string, std::string> broken_;  // inputs that cannot be used, and why
  std::atomic<std::size_t> next_ = 0;          // in todo_
  Stopwatch stopwatch_;

  std::mutex mutex_;  // guards the members below
  std::size_t done_ = 0;
  std::vector<std::optional<CellResult>> results_;
  std::map<std::size_t, CellFailure> failures_;  // by cell
};

}  // namespace

ExperimentPlan PlanExperiment(const ExperimentConfig& config, const ExperimentFolder& folder,
                              const std::string& only) {
  std::vector<ExperimentCell> cells = ListCells(config);
  std::erase_if(cells, [&](const ExperimentCell& cell) { return !only.empty() && cell.name != only; });
  ExperimentPlan plan;
  plan.config = config;
  plan.folder = folder;
  for (const ExperimentSequence& sequence : config.sequences) {
    if (std::ranges::find(cells, sequence.name, &ExperimentCell::sequence) != cells.end()) {
      plan.sequences[sequence.name] = Prepare(config, sequence, folder);
    }
  }
  for (const ExperimentCell& cell : cells) {
    const PreparedSequence& sequence = plan.sequences.at(cell.sequence);
    const CellCommands commands = CommandsOf(config, sequence, cell, folder);
    const nlohmann::ordered_json settings = SettingsOf(config, sequence, commands, folder);
    plan.cells.push_back({cell, commands, settings, ReadCellResult(folder.Run(cell), cell, settings)});
  }
  return plan;
}

ExperimentOutcome RunExperiment(ExperimentPlan plan, const StopRequest& stop, const LinePrinter& print) {
  return Workers(plan, stop, print).Run();
}

}  // namespace sqslam::app
