#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "app/cluster/slurm.h"

namespace sqslam::app {

inline constexpr const char* kLastTask = "end";  // task of the last job, which runs after an array

// How a task ended; a failure is stored next to the place of the result.
struct TaskEnd {
  int exit_code = 3;
  std::string message;  // empty unless it failed
};
// Returns a generic failure if there is no record: the task was killed, or never started.
TaskEnd ReadTaskFailure(const std::filesystem::path& path);

// Does the work of a task and returns its exit code; gives up if Slurm has requeued the task more often than
// `retries`. Prints a failure and records it in the file `failure`.
int RunArrayTask(const std::string& name, const std::filesystem::path& failure, const SlurmOptions& options,
                 const std::function<TaskEnd()>& work);

// Work for a Slurm job array: one task per word without a result. Results are read from the folder each time,
// running tasks from the queue by job name; nothing else is kept but the counts of attempts.
struct ArrayWork {
  std::string title;                 // part of the job's name
  std::filesystem::path folder;      // of scripts, logs and counts; created if missing
  std::vector<std::string> command;  // arguments of the program; --task WORD is appended
  int at_once = 1;
  std::function<std::vector<std::string>()> unfinished;                   // words without a result
  std::function<std::filesystem::path(const std::string& word)> failure;  // file of the task's failure
  std::vector<std::filesystem::path> results;  // folders of the results; drafts are removed before submission
};

enum class ArrayEnd {
  kEnded,      // every task has a result or has used up its retries
  kSubmitted,  // left to Slurm; a last job runs --task end
  kStopped,
};

struct ArrayCall {
  bool submit_only = false;
  bool last_job = false;  // called by the last job: attempts are not reset
};

// Submits the unfinished tasks, after those of an earlier call have left the queue, waits for them, resubmits
// those that ended without a result, and prints each failure. Throws InputError if Slurm rejects a job.
ArrayEnd FollowArray(const ArrayWork& work, const SlurmOptions& options, const ArrayCall& call,
                     const std::function<bool()>& stop, const std::function<void(const std::string&)>& print);

// Returns the arguments of this process without a trailing --task WORD.
std::vector<std::string> ArgumentsWithoutTask();

}  // namespace sqslam::app
