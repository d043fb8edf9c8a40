#include "app/experiment/runner.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <mutex>
#include <set>
#include <thread>

#include "app/terminal/terminal.h"
#include "slam/io/detections.h"
#include "slam/util/atomic_file.h"
#include "slam/util/error.h"

namespace sqslam::app {
namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;
namespace {

double SecondsSince(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

std::string Duration(double seconds) {
  const auto whole = static_cast<long>(seconds + 0.5);
  return whole >= 3600 ? fmt::format("{}:{:02}:{:02}", whole / 3600, whole / 60 % 60, whole % 60)
                       : fmt::format("{}:{:02}", whole / 60, whole % 60);
}

// "0.712 mean IoU, 12 of 13 found"
std::string Headline(const CellResult& result) {
  if (!result.has_objects) {
    return fmt::format("{} of {} frames tracked", result.stats.tracked, result.stats.frames);
  }
  int found = 0;
  double sum = 0.0;
  for (const ObjectScore& object : result.objects) {
    found += object.found ? 1 : 0;
    sum += object.iou;
  }
  return fmt::format("{} of {} objects found, their mean IoU {:.3f}", found, result.objects.size(),
                     sum / std::max(1, found));
}

// Makes the unfinished cells of a plan, several at a time.
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
    start_ = Clock::now();
    {
      std::vector<std::jthread> threads;
      for (int i = 0; i < plan_.config.jobs; ++i) {
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
      const PreparedSequence& sequence = plan_.sequences.at(cell.sequence);
      if (stop_()) {
        return;
      }
      Attempt(cell.sequence, [&] { Render(sequence); });
      if (cell.max_objects != kAllObjects && !broken_.contains(cell.sequence) && !stop_()) {
        const std::string limited = NameOfBoxes(cell);
        Attempt(limited, [&] {
          const fs::path path = plan_.folder.Boxes(limited);
          fs::create_directories(path.parent_path());
          WriteFileAtomically(path, LimitBoxes(BoxesOf(sequence), cell.max_objects));
        });
      }
    }
  }

  // Does something once; what it throws is remembered under the name.
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

  // A rendered folder without the mark is one that was left half-way.
  void Render(const PreparedSequence& sequence) {
    const fs::path mark = sequence.path.string() + ".done";
    if (sequence.rendering.empty() || fs::exists(mark)) {
      return;
    }
    fs::remove_all(sequence.path);
    fs::create_directories(sequence.path.parent_path());
    print_(fmt::format("rendering {}", sequence.path.filename().string()));
    const fs::path log = sequence.path.string() + ".log";
    fs::remove(log);
    const ChildResult child = RunChild(sequence.rendering, log, stop_);
    if (child.exit_code == 0) {
      WriteFileAtomically(mark, "");
    } else if (!stop_()) {
      throw InputError(child.message);
    }
  }

  void Work() {
    while (!stop_()) {
      const std::size_t next = next_++;
      if (next >= todo_.size()) {
        return;
      }
      const Clock::time_point start = Clock::now();
      ChildResult child;
      try {
        child = RunCell(todo_[next]);
      } catch (const std::exception& error) {  // a full disk, a folder that cannot be removed
        child = {1, false, error.what()};
      }
      if (!child.stopped) {
        Report(todo_[next], child, SecondsSince(start));
      }
    }
  }

  ChildResult RunCell(std::size_t index) const {
    const auto& [cell, commands, settings, finished] = plan_.cells[index];
    for (const std::string& needed : {cell.sequence, NameOfBoxes(cell)}) {
      if (const auto broken = broken_.find(needed); broken != broken_.end()) {
        return {3, false, broken->second};
      }
    }
    const fs::path run = plan_.folder.Run(cell);
    const fs::path log = plan_.folder.Log(cell);
    fs::remove_all(run);
    fs::create_directories(run.parent_path());
    fs::remove(log);
    ChildResult child = RunChild(commands.run, log, stop_);
    if (child.exit_code == 0 && !commands.eval.empty()) {
      child = RunChild(commands.eval, log, stop_);
    }
    // The terminal gives its Ctrl-C to the child as well, which may have ended before it was asked.
    child.stopped = child.stopped || (child.exit_code != 0 && stop_());
    if (child.exit_code == 0 && !child.stopped) {
      WriteCellRecord(run, settings, plan_.config.jobs, program_);
    }
    return child;
  }

  void Report(std::size_t index, const ChildResult& child, double seconds) {
    const ExperimentCell& cell = plan_.cells[index].cell;
    std::optional<CellResult> result;
    std::string what;
    if (child.exit_code == 0) {
      result = ReadCellResult(plan_.folder.Run(cell), cell, plan_.cells[index].settings);
      what = result ? Headline(*result) : "its files cannot be read back";
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
    const double elapsed = SecondsSince(start_);
    const auto left = static_cast<double>(todo_.size() - done_) * elapsed / static_cast<double>(done_);
    print_(fmt::format("[{}/{}] {}: {} ({:.1f} s); {:.1f} runs/min, {} left", done_, todo_.size(), cell.name,
                       what, seconds, 60.0 * static_cast<double>(done_) / elapsed, Duration(left)));
  }

  const ExperimentPlan& plan_;
  const StopRequest& stop_;
  const LinePrinter& print_;
  std::string program_;
  std::vector<std::size_t> todo_;              // indices of cells
  std::set<std::string> attempted_;            // inputs: names of sequences and of limited boxes
  std::map<std::string, std::string> broken_;  // those that cannot be used, and why
  std::atomic<std::size_t> next_ = 0;          // in todo_
  Clock::time_point start_;

  std::mutex mutex_;  // guards what follows
  std::size_t done_ = 0;
  std::vector<std::optional<CellResult>> results_;
  std::map<std::size_t, CellFailure> failures_;  // by cell
};

}  // namespace

ExperimentPlan PlanExperiment(const ExperimentConfig& config, const ExperimentFolder& folder) {
  ExperimentPlan plan;
  plan.config = config;
  plan.folder = folder;
  for (const ExperimentSequence& sequence : config.sequences) {
    plan.sequences[sequence.name] = Prepare(config, sequence, folder);
  }
  for (const ExperimentCell& cell : ListCells(config)) {
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
