#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "app/cluster/slurm.h"

namespace sqslam::app {

inline constexpr const char* kLastTask = "end";  // the task of the job that comes after an array

// The reason for which a task ended without a result; kept beside where the result would be.
struct TaskFailure {
  int exit_code = 3;
  std::string message;
};
void WriteTaskFailure(const std::filesystem::path& path, const TaskFailure& failure);
// Returns a failure of its own where there is none: the task was killed, or never began.
TaskFailure ReadTaskFailure(const std::filesystem::path& path);

// True where Slurm itself has begun this task anew more often than it may be made again.
bool RequeuedTooOften(const SlurmOptions& options);

// Work for an array of Slurm: a task for each word that has no result yet. What is done is read from its
// folder each time, what is under way from Slurm's queue by the job's name; nothing else is remembered.
struct ArrayWork {
  std::string title;                 // part of the job's name
  std::filesystem::path folder;      // for the script, what tasks print, and counts; made where it is missing
  std::vector<std::string> command;  // arguments of the program, to which --task WORD is added
  int at_once = 1;
  std::function<std::vector<std::string>()> unfinished;                // asked after each look at the queue
  std::function<void(const std::vector<std::string>& words)> prepare;  // before they are handed over
};

enum class ArrayEnd {
  kEnded,      // every task has a result, or was made again as often as it may be
  kSubmitted,  // the rest is Slurm's; a last job does --task end
  kStopped,
};

struct ArrayCall {
  bool submit_only = false;
  bool last_job = false;  // the call is that of the last job: attempts of the tasks are counted on
};

// Hands over what is unfinished, follows it, and hands over again what ended without a result. Taken up again
// it follows what is in the queue. Throws InputError where Slurm does not take the job.
ArrayEnd FollowArray(const ArrayWork& work, const SlurmOptions& options, const ArrayCall& call,
                     const std::function<bool()>& stop, const std::function<void(const std::string&)>& print);

// Returns the arguments that this program was started with, without --task WORD at their end.
std::vector<std::string> ArgumentsWithoutTask();

}  // namespace sqslam::app
