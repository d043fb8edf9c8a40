#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "app/command_line/command.h"
#include "slam/util/shard.h"

namespace sqslam::app {

// --on, --shards, ...: options of commands that a cluster can do in pieces.
struct ClusterArguments {
  std::string where = "here";  // or slurm
  std::optional<int> shards;
  std::string slurm;  // file
  bool submit_only = false;
  std::string task;  // I/N, or kLastTask

  void AddTo(Command& command);
  void Check() const;  // throws UsageError on options that contradict each other
  bool OnSlurm() const { return where == "slurm"; }
};

// Work that tasks of a cluster do in pieces: each makes one file, and the files are joined at the end. The
// functions return exit codes and get the number of a task's processors (0: on the user's own computer, all).
struct PieceWork {
  std::string title;                      // part of the job's name
  std::filesystem::path output;           // pieces are called after it, in the folder `output`.pieces
  std::function<std::string()> settings;  // inputs of the pieces; pieces of other settings are made again
  std::function<int(const Shard& shard, const std::filesystem::path& piece, int cpus)> make;
  std::function<int(const std::vector<std::string>& pieces, int cpus)> join;
};

// Has a Slurm cluster make the pieces, and joins them; as a task (--task) makes only its piece. Missing and
// cut pieces are made again. Returns the exit code.
int DoOnSlurm(const PieceWork& work, const ClusterArguments& arguments, bool quiet);

}  // namespace sqslam::app
