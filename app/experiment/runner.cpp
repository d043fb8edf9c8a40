#include "app/experiment/runner.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <thread>

#include "slam/io/detections.h"
#include "slam/util/atomic_file.h"
#include "slam/util/file_lock.h"
#include "slam/util/text_lines.h"
#include "slam/util/throw_if.h"
#include "slam/util/to_vector.h"

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

// Renders the scene of the cell's sequence unless it is there; waits if another thread or program is
// rendering it. Throws InputError.
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

// Writes the boxes of a cell with limited max_objects. Throws InputError.
void WriteLimitedBoxes(const ExperimentPlan& plan, const ExperimentCell& cell) {
  const PreparedSequence& sequence = plan.sequences.at(cell.sequence);
  const fs::path boxes = sequence.detections.empty() ? sequence.path / "boxes.txt" : sequence.detections;
  ThrowIf<InputError>(!fs::is_regular_file(boxes), "{}: not a file, expected boxes for max_objects",
                      boxes.string());
  const fs::path limited = plan.folder.Boxes(cell);
  fs::create_directories(limited.parent_path());
  WriteFileAtomically(limited, LimitBoxes(boxes, cell.max_objects));
}

// Runs and scores a cell whose inputs are there, and marks it as finished. Throws InputError if the folder
// cannot be written or another program is running the cell.
ChildResult RunCell(const ExperimentPlan& plan, const PlannedCell& planned, const StopRequest& stop) {
  const auto& [cell, commands, settings, finished] = planned;
  const fs::path run = plan.folder.Run(cell);
  const fs::path log = plan.folder.Log(cell);
  fs::create_directories(run.parent_path());
  const std::optional<FileLock> lock = FileLock::Try(log);
  ThrowIf<InputError>(!lock, "{}: another program is making this run; wait for it", log.string());
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
    WriteCellRecord(made.Path(), settings, plan.config.jobs, ProgramFingerprint());
    fs::remove_all(run);
    made.Commit();
  }
  return child;
}

}  // namespace

ChildResult MakeCell(const ExperimentPlan& plan, const PlannedCell& planned, const StopRequest& stop,
                     const LinePrinter& print) {
  try {
    RenderSequence(plan, planned.cell, stop, print);
    if (planned.cell.max_objects != kAllObjects) {
      WriteLimitedBoxes(plan, planned.cell);
    }
    if (stop()) {
      return {130, true, ""};
    }
    ChildResult child = RunCell(plan, planned, stop);
    const bool readable = child.exit_code != 0 || child.stopped ||
                          ReadCellResult(plan.folder.Run(planned.cell), planned.cell, planned.settings);
    return readable ? child : ChildResult{3, false, "its result files cannot be read"};
  } catch (const std::exception& error) {  // a broken scene, a full disk, a folder that cannot be removed
    return {stop() ? 130 : 3, stop(), error.what()};
  }
}

namespace {

// "12 of 13 objects found, their mean IoU 0.712"
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

}  // namespace

CellProgress::CellProgress(const ExperimentPlan& plan, const LinePrinter& print)
    : plan_(plan), print_(print), results_(ToVector(plan.cells, &PlannedCell::finished)) {
  todo_ = Unfinished().size();
}

std::vector<std::size_t> CellProgress::Unfinished() const {
  std::vector<std::size_t> cells;
  for (std::size_t i = 0; i < results_.size(); ++i) {
    if (!results_[i]) {
      cells.push_back(i);
    }
  }
  return cells;
}

bool CellProgress::Collect(std::size_t index) {
  const auto& [cell, commands, settings, finished] = plan_.cells[index];
  auto result = ReadCellResult(plan_.folder.Run(cell), cell, settings);
  if (!result) {
    return false;
  }
  const std::lock_guard lock(mutex_);
  Print(cell, fmt::format("{} ({:.1f} s)", Headline(*result), result->stats.wall_seconds));
  results_[index] = std::move(result);
  return true;
}

void CellProgress::Fail(std::size_t index, const ChildResult& child) {
  const ExperimentCell& cell = plan_.cells[index].cell;
  const std::lock_guard lock(mutex_);
  Print(cell, fmt::format("FAILED: {}", child.message));
  failures_[index] = {cell.name, child.exit_code < 128 ? child.exit_code : 1, child.message};
}

void CellProgress::Print(const ExperimentCell& cell, const std::string& what) {
  ++done_;
  const double elapsed = stopwatch_.Seconds();
  const double left = static_cast<double>(todo_ - done_) * elapsed / static_cast<double>(done_);
  print_(fmt::format("[{}/{}] {}: {}; {:.1f} runs/min, {} left", done_, todo_, cell.name, what,
                     60.0 * static_cast<double>(done_) / elapsed, DurationText(left)));
}

ExperimentOutcome CellProgress::Outcome(bool interrupted) {
  ExperimentOutcome outcome;
  outcome.cells = static_cast<int>(results_.size());
  outcome.reused = outcome.cells - static_cast<int>(todo_);
  outcome.interrupted = interrupted;
  for (auto& result : results_) {
    if (result) {
      outcome.results.push_back(std::move(*result));
    }
  }
  for (auto& [index, failure] : failures_) {
    outcome.failures.push_back(std::move(failure));
  }
  return outcome;
}

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

ExperimentOutcome RunExperiment(const ExperimentPlan& plan, const StopRequest& stop,
                                const LinePrinter& print) {
  std::mutex printing;
  const LinePrinter print_alone = [&](const std::string& line) {
    const std::lock_guard lock(printing);
    print(line);
  };
  CellProgress progress(plan, print_alone);
  const std::vector<std::size_t> todo = progress.Unfinished();
  std::atomic<std::size_t> next = 0;
  const auto work = [&] {
    for (std::size_t i = next++; i < todo.size() && !stop(); i = next++) {
      const ChildResult child = MakeCell(plan, plan.cells[todo[i]], stop, print_alone);
      if (child.exit_code != 0 && !child.stopped) {
        progress.Fail(todo[i], child);
      } else if (!child.stopped) {
        progress.Collect(todo[i]);
      }
    }
  };
  {
    std::vector<std::jthread> threads;
    for (std::size_t i = 0; i < std::min<std::size_t>(plan.config.jobs, todo.size()); ++i) {
      threads.emplace_back(work);
    }
  }
  return progress.Outcome(stop());
}

}  // namespace sqslam::app
