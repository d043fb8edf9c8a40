#include <fmt/format.h>

#include <string>
#include <vector>

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
using DrawsHere = std::function<int(const RenderArguments&)>;
namespace {

// The pieces of one video, in FILE.mp4.pieces.
class VideoPieces {
 public:
  explicit VideoPieces(const RenderArguments& a)
      : output_(fs::absolute(a.output).lexically_normal()), count_(*a.shards) {}

  fs::path Folder() const { return output_.string() + ".pieces"; }
  fs::path Piece(int index) const { return PartName(Folder() / output_.filename(), {index, count_}); }
  fs::path Beside(int index, const char* extension) const { return Piece(index).string() + extension; }
  fs::path Failure(const std::string& name) const { return Beside(ParseShard(name).index, ".failed"); }
  int Count() const { return count_; }
  std::string Name(int index) const { return fmt::format("{}/{}", index, count_); }
  std::string Title() const { return output_.stem().string(); }

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

// Returns all that the content of the pieces depends on.
std::string SettingsOf(const RenderArguments& a) {
  Words words = ArgumentsWithoutTask();
  std::erase_if(words, [](const std::string& word) {
    return word == "--submit-only" || word == "--quiet" || word == "-q";
  });
  const fs::path map = MapFile(a.map);
  const nlohmann::ordered_json settings = {{"arguments", words},
                                           {"map_bytes", fs::file_size(map)},
                                           {"map_time", fs::last_write_time(map).time_since_epoch().count()}};
  return JsonText(settings);
}

// Claims the folder for these settings; pieces of other settings become incomplete.
void ClaimFolder(const VideoPieces& pieces, const std::string& settings) {
  const fs::path file = pieces.Folder() / "settings.json";
  if (fs::exists(file) && ReadFile(file, "settings of pieces") == settings) {
    return;
  }
  if (fs::exists(file)) {
    const std::string name = JobName(pieces.Title(), pieces.Folder());
    std::string problem;
    const auto queued = QueuedJobs(name, problem);
    if (!queued) {
      throw InputError("{}, so pieces of another video may be drawn in {} now", problem,
                       pieces.Folder().string());
    }
    ThrowIf<InputError>(!queued->empty(),
                        "{}: pieces of another video are being drawn there, expected none (scancel -n {})",
                        pieces.Folder().string(), name);
  }
  for (int i = 1; i <= pieces.Count(); ++i) {
    fs::remove(pieces.Beside(i, ".size"));
  }
  WriteFileAtomically(file, settings);
}

int RenderPiece(const VideoPieces& pieces, const RenderArguments& a, const SlurmOptions& options,
                const DrawsHere& render) {
  const Shard shard = ParseShard(a.task);
  ThrowIf<UsageError>(shard.count != pieces.Count(), "--task {}: expected a piece of {}", a.task,
                      pieces.Count());
  if (pieces.IsWhole(shard.index)) {
    return 0;
  }
  fs::create_directories(pieces.Folder());
  std::string message;
  const auto work = [&] {
    const auto lock = FileLock::Try(pieces.Beside(shard.index, ".lock"));
    if (!lock || RequeuedTooOften(options)) {
      throw InputError(lock ? "taken off its node too often" : "another program is drawing this piece");
    }
    AtomicPath draft(pieces.Folder() / std::to_string(shard.index));
    fs::create_directory(draft.Path());
    RenderArguments part = a;
    part.shard = a.task;
    part.output = draft.Path() / fs::path(a.output).filename();
    const int code = render(part);
    if (code == 0) {
      const fs::path drawn = PartName(part.output, shard);
      const auto size = fs::file_size(drawn);
      fs::remove(pieces.Beside(shard.index, ".size"));
      fs::rename(drawn, pieces.Piece(shard.index));
      WriteFileAtomically(pieces.Beside(shard.index, ".size"), std::to_string(size));
    }
    return code;
  };
  const int code = ExitCodeOf(work, [&](const std::string& error) { message = error; });
  if (!message.empty()) {
    WriteTaskFailure(pieces.Failure(a.task), {code, message});
    fmt::print(stderr, "sqslam: piece {}: {}\n", a.task, message);
  }
  return code;
}

int FailureOf(const VideoPieces& pieces, const Words& missing) {
  int code = 0;
  for (const std::string& name : missing) {
    const TaskFailure failure = ReadTaskFailure(pieces.Failure(name));
    fmt::print(stderr, "sqslam: piece {} failed: {}\n", name, failure.message);
    code = code == 0 ? failure.exit_code : code;
  }
  return code;
}

int Join(const VideoPieces& pieces, const RenderArguments& a, const DrawsHere& render) {
  RenderArguments join = a;
  for (int i = 1; i <= pieces.Count(); ++i) {
    join.join.push_back(pieces.Piece(i).string());
  }
  const int code = render(join);
  if (code == 0) {
    fs::remove_all(pieces.Folder());
  }
  return code;
}

}  // namespace

int RenderOnSlurm(const RenderArguments& a, const DrawsHere& render) {
  const VideoPieces pieces(a);
  SlurmOptions options;
  if (!a.slurm.empty()) {
    LoadOptions(a.slurm, options);
  }
  const bool last = a.task == kLastTask;
  if (!a.task.empty() && !last) {
    return RenderPiece(pieces, a, options, render);
  }
  const std::string settings = SettingsOf(a);
  fs::create_directories(pieces.Folder());
  const auto lock = FileLock::Try(pieces.Folder() / "render.lock");
  if (!lock && last) {
    return 0;  // another program follows the tasks and will join the pieces
  }
  ThrowIf<InputError>(!lock, "{}: another program is waiting for its tasks, expected no other",
                      pieces.Folder().string());
  ClaimFolder(pieces, settings);
  const InterruptGuard interrupt;
  Progress progress(a.quiet, "piece");
  const auto unfinished = [&] {
    Words missing = pieces.Missing();
    progress.Update(pieces.Count() - static_cast<int>(missing.size()), pieces.Count());
    return missing;
  };
  const auto print = [&](const std::string& line) {
    if (!a.quiet) {
      PrintLine(line);
    }
  };
  const ArrayWork work{
      pieces.Title(),   pieces.Folder(), ArgumentsWithoutTask(),
      pieces.Count(),   unfinished,      [&](const std::string& name) { return pieces.Failure(name); },
      {pieces.Folder()}};
  const ArrayEnd end = FollowArray(
      work, options, {a.submit_only || last, last}, [&] { return interrupt.Interrupted(); }, print);
  if (end != ArrayEnd::kEnded) {
    return end == ArrayEnd::kStopped ? 130 : 0;
  }
  const Words missing = pieces.Missing();
  return missing.empty() ? Join(pieces, a, render) : FailureOf(pieces, missing);
}

}  // namespace sqslam::app
