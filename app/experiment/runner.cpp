#include "app/experiment/runner.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <mutex>
#include <set>
#include <thread>

#include "slam/io/detections.h"
#include "slam/util/atomic_file.h"
#include "slam/util/error.h"
#include "slam/util/file_lock.h"
#include "slam/util/stopwatch.h"
#include "slam/util/text_lines.h"
#include "slam/util/throw_if.h"

namespace sqslam::app {
namespace fs = std::filesystem;
namespace {

// Replaces the argument `from` by `to`.
std::vector<std::string> Redirected(std::vector<std::string> words, const fs::path& from,
                                    const fs::path& to) {
  std::ranges::replace(words, from.string(), to.string());
  return words;
}

// Replaces the temporary folder of a run in a text by its final one.
std::string Renamed(std::string text, const fs::path& from, const fs::path& to) {
  const std::size_t at = text.find(from.string());
  return at == std::string::npos ? text : text.replace(at, from.string().size(), to.string());
}

}  // namespace

void RenderSequence(const ExperimentPlan& plan, const ExperimentCell& cell, const StopRequest& stop,
                    const LinePrinter& print) {
  const PreparedSequence& sequence = plan.sequences.at(cell.sequence);
  const auto beside = [&](const char* extension) { return fs::path(sequence.path.string() + extension); };
  if (sequence.rendering.empty() || fs::exists(beside(".done"))) {
    return;
  }
  fs::create_directories(sequence.path.parent_path());
  const std::optional<FileLock> lock = FileLock::Wait(beside(".lock"), stop);
  if (!lock || fs::exists(beside(".done"))) {
    return;
  }
  print(fmt::format("rendering {}", sequence.path.filename().string()));
  AtomicPath rendered(sequence.path);
  fs::remove(beside(".log"));
  const ChildResult child =
      RunChild(Redirected(sequence.rendering, sequence.path, rendered.Path()), beside(".log"), stop);
  if (child.exit_code != 0) {
    if (!stop()) {
      throw InputError(child.message);
    }
  } else if (!fs::exists(beside(".done"))) {  // without file locks another program may be faster
    fs::remove_all(sequence.path);            // not marked as done: incomplete
    rendered.Commit();
    WriteFileAtomically(beside(".done"), "");
  }
}

void WriteLimitedBoxes(const ExperimentPlan& plan, const ExperimentCell& cell) {
  const fs::path path = plan.folder.Boxes(NameOfBoxes(cell));
  fs::create_directories(path.parent_path());
  WriteFileAtomically(path, LimitBoxes(BoxesOf(plan.sequences.at(cell.sequence)), cell.max_objects));
}

ChildResult RunCell(const ExperimentPlan& plan, const PlannedCell& planned, const std::string& program,
                    const StopRequest& stop) {
  const auto& [cell, commands, settings, finished] = planned;
  const fs::path run = plan.folder.Run(cell);
  const fs::path log = plan.folder.Log(cell);
  fs::create_directories(run.parent_path());
  const std::optional<FileLock> lock = FileLock::Try(log);
  ThrowIf<InputError>(!lock, "{}: another program is making this run", log.string());
  fs::resize_file(log, 0);
  AtomicPath made(run);
  ChildResult child = RunChild(Redirected(commands.run, run, made.Path()), log, stop);
  if (child.exit_code == 0 && !commands.eval.empty()) {
    child = RunChild(Redirected(commands.eval, run, made.Path()), log, stop);
  }
  // Ctrl-C in the terminal reaches the child too, which may end before `stop` is polled.
  child.stopped = child.stopped || (child.exit_code != 0 && stop());
  child.message = Renamed(child.message, made.Path(), run);
  if (child.exit_code == 0 && !child.stopped) {
    const fs::path stats = made.Path() / "stats.json";  // holds the command line of the run
    WriteFileAtomically(stats, Renamed(ReadFile(stats, "what a run says of itself"), made.Path(), run));
    WriteCellRecord(made.Path(), settings, plan.config.jobs, program);
    fs::remove_all(run);
    made.Commit();
  }
  return child;
}

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

std::string ProgressLine(std::size_t done, std::size_t total, double elapsed, const std::string& name,
                         const std::string& what, double seconds) {
  const double left = static_cast<double>(total - done) * elapsed / static_cast<double>(done);
  return fmt::format("[{}/{}] {}: {} ({:.1f} s); {:.1f} runs/min, {} left", done, total, name, what, seconds,
                     60.0 * static_cast<double>(done) / elapsed, DurationText(left));
}

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
