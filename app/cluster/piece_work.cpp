#include "app/cluster/piece_work.h"

#include <fmt/format.h>

#include "app/cluster/array_work.h"
#include "app/terminal/terminal.h"
#include "slam/util/atomic_file.h"
#include "slam/util/file_lock.h"
#include "slam/util/json_file.h"
#include "slam/util/options.h"
#include "slam/util/throw_if.h"

namespace sqslam::app {
namespace fs = std::filesystem;
using Words = std::vector<std::string>;
namespace {

// The pieces of one output.
class Pieces {
 public:
  Pieces(const fs::path& output, int count)
      : output_(fs::absolute(output).lexically_normal()), count_(count) {}

  fs::path Folder() const { return output_.string() + ".pieces"; }
  fs::path Settings() const { return Folder() / "settings.json"; }
  fs::path Piece(int index) const { return PartName(Folder() / output_.filename(), {index, count_}); }
  fs::path Beside(int index, const char* extension) const { return Piece(index).string() + extension; }
  fs::path Failure(const std::string& name) const { return Beside(ParseShard(name).index, ".failed"); }
  int Count() const { return count_; }
  std::string Name(int index) const { return fmt::format("{}/{}", index, count_); }

  // Returns true if the piece exists and has the size that it had when it was finished.
  bool IsWhole(int index) const {
    std::error_code missing;
    const auto size = fs::file_size(Piece(index), missing);
    return !missing && fs::exists(Beside(index, ".size")) &&
           ReadFile(Beside(index, ".size"), "a size") == std::to_string(size);
  }

  Words Missing() const {
    Words names;
    for (int i = 1; i <= count_; ++i) {
      if (!IsWhole(i)) {
        names.push_back(Name(i));
      }
    }
    return names;
  }

 private:
  fs::path output_;
  int count_;
};

// Claims the folder for these settings; pieces of other settings become incomplete.
void ClaimFolder(const Pieces& pieces, const std::string& title, const std::string& settings) {
  const fs::path file = pieces.Settings();
  if (fs::exists(file) && ReadFile(file, "settings of pieces") == settings) {
    return;
  }
  if (fs::exists(file)) {
    const std::string name = JobName(title, pieces.Folder());
    std::string problem;
    const auto queued = QueuedJobs(name, problem);
    if (!queued) {
      throw InputError("{}, so other jobs may be writing to {}", problem, pieces.Folder().string());
    }
    ThrowIf<InputError>(!queued->empty(),
                        "{}: other pieces are being made there, expected none (scancel -n {})",
                        pieces.Folder().string(), name);
  }
  for (int i = 1; i <= pieces.Count(); ++i) {
    fs::remove(pieces.Beside(i, ".size"));
  }
  WriteFileAtomically(file, settings);
}

int MakePiece(const PieceWork& work, const Pieces& pieces, const std::string& task,
              const SlurmOptions& options) {
  const Shard shard = ParseShard(task);
  ThrowIf<UsageError>(shard.count != pieces.Count(), "--task {}: expected I/N with N = {}", task,
                      pieces.Count());
  if (pieces.IsWhole(shard.index)) {
    return 0;
  }
  fs::create_directories(pieces.Folder());
  const auto make = [&]() -> TaskEnd {
    const auto lock = FileLock::Try(pieces.Beside(shard.index, ".lock"));
    ThrowIf<InputError>(!lock, "another program is making this piece; wait for it");
    if (!fs::exists(pieces.Settings())) {  // a task that nobody has submitted
      WriteFileAtomically(pieces.Settings(), work.settings());
    }
    AtomicPath draft(pieces.Folder() / std::to_string(shard.index));
    fs::create_directory(draft.Path());
    const fs::path made = draft.Path() / pieces.Piece(shard.index).filename();
    const int code = work.make(shard, made, options.cpus);
    if (code == 0) {
      const auto size = fs::file_size(made);
      fs::remove(pieces.Beside(shard.index, ".size"));
      fs::rename(made, pieces.Piece(shard.index));
      WriteFileAtomically(pieces.Beside(shard.index, ".size"), std::to_string(size));
    }
    return {code, ""};
  };
  return RunArrayTask(fmt::format("piece {}", task), pieces.Failure(task), options, make);
}

int FailureOf(const Pieces& pieces, const Words& missing) {
  int code = 0;
  for (const std::string& name : missing) {
    const TaskEnd failure = ReadTaskFailure(pieces.Failure(name));
    PrintNotice(fmt::format("sqslam: piece {} failed: {}", name, failure.message));
    code = code == 0 ? failure.exit_code : code;
  }
  return code;
}

int Join(const PieceWork& work, const Pieces& pieces, int cpus) {
  Words files;
  for (int i = 1; i <= pieces.Count(); ++i) {
    files.push_back(pieces.Piece(i).string());
  }
  const int code = work.join(files, cpus);
  if (code == 0) {
    fs::remove_all(pieces.Folder());
  }
  return code;
}

}  // namespace

void ClusterArguments::AddTo(Command& command) {
  command.Group("Cluster");
  command.Option("--on WHERE", where, "Work on this computer, or in pieces on a cluster")
      .OneOf({"here", "slurm"});
  command.Option("--shards N", shards, "With --on slurm: number of pieces, one task each").Range(2, 1000);
  command.Option(
      "--slurm FILE", slurm,
      "YAML file of partition, time, memory, ...: the keys below `slurm` in sqslam experiment --help");
  command.Flag("--submit-only", submit_only,
               "With --on slurm: submit all jobs and exit; a last job joins the pieces");
  command.Option("--task I/N", task, "With --on slurm: make only this piece; for tasks of a cluster");
}

void ClusterArguments::Check() const {
  ThrowIf<UsageError>(!OnSlurm() && (shards || !slurm.empty() || submit_only || !task.empty()),
                      "--shards, --slurm, --submit-only and --task: expected --on slurm");
  ThrowIf<UsageError>(OnSlurm() && !shards, "--on slurm: expected --shards N");
}

int DoOnSlurm(const PieceWork& work, const ClusterArguments& a, bool quiet) {
  const Pieces pieces(work.output, *a.shards);
  SlurmOptions options;
  if (!a.slurm.empty()) {
    LoadOptions(a.slurm, options);
  }
  const bool last = a.task == kLastTask;
  if (!a.task.empty() && !last) {
    return MakePiece(work, pieces, a.task, options);
  }
  const std::string settings = work.settings();
  fs::create_directories(pieces.Folder());
  const auto lock = FileLock::Try(pieces.Folder() / "join.lock");
  if (!lock && last) {
    return 0;  // another program follows the tasks and will join the pieces
  }
  ThrowIf<InputError>(!lock, "{}: another program is waiting for its tasks, expected no other",
                      pieces.Folder().string());
  ClaimFolder(pieces, work.title, settings);
  ArrayEnd end = ArrayEnd::kStopped;
  {
    const InterruptGuard interrupt;
    Progress progress(quiet, "piece");
    const auto unfinished = [&] {
      Words missing = pieces.Missing();
      progress.Update(pieces.Count() - static_cast<int>(missing.size()), pieces.Count());
      return missing;
    };
    const auto print = [&](const std::string& line) {
      if (!quiet) {
        PrintLine(line);
      }
    };
    const ArrayWork tasks{
        work.title,       pieces.Folder(), ArgumentsWithoutTask(),
        pieces.Count(),   unfinished,      [&](const std::string& name) { return pieces.Failure(name); },
        {pieces.Folder()}};
    end = FollowArray(
        tasks, options, {a.submit_only || last, last}, [&] { return interrupt.Interrupted(); }, print);
  }
  if (end != ArrayEnd::kEnded) {
    return end == ArrayEnd::kStopped ? 130 : 0;
  }
  const Words missing = pieces.Missing();
  return missing.empty() ? Join(work, pieces, last ? options.cpus : 0) : FailureOf(pieces, missing);
}

}  // namespace sqslam::app
