#include "app/experiment/cell_run.h"

#include <fmt/format.h>

#include <algorithm>

#include "slam/io/detections.h"
#include "slam/util/atomic_file.h"
#include "slam/util/file_lock.h"
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

}  // namespace sqslam::app
