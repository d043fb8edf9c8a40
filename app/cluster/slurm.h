#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace sqslam::app {

// Options of Slurm jobs: the group `slurm` of an experiment, or the file of --slurm.
struct SlurmOptions {
  std::string partition;            // empty: the cluster's default; likewise for time and memory
  std::string time;                 // as sbatch takes it
  std::string memory;               // as sbatch takes it
  int cpus = 1;                     // for each task
  std::vector<std::string> sbatch;  // further options, "--account=mapping"
  std::vector<std::string> setup;   // shell lines before the program, "module load sqslam"
  std::string program;              // shell command, "apptainer exec s.sif sqslam"; empty: this program
  int retries = 2;                  // times that a task without a result is repeated
  double poll = 5.0;                // seconds between queries of the queue

  void VisitFields(auto&& visit) {
    visit("partition", partition);
    visit("time", time);
    visit("memory", memory);
    visit("cpus", cpus, 1, 10000);
    visit("sbatch", sbatch);
    visit("setup", setup);
    visit("program", program);
    visit("retries", retries, 0, 1000);
    visit("poll", poll, 0.1, 3600.0);
  }
};

// A job that runs the program once per word.
struct SlurmJobText {
  std::string name;
  std::filesystem::path logs;      // folder: K.log for task K of an array, NAME.log for a single job
  std::vector<std::string> words;  // one task each, passed as --task WORD; a single one: no array
  int at_once = 1;
  std::vector<std::string> command;  // arguments of the program, without --task
};

// Returns the script for sbatch.
std::string JobScript(const SlurmJobText& job, const SlurmOptions& options);

// Returns a job name that is unique to the folder: sqslam-TITLE-1a2b3c4d.
std::string JobName(const std::string& title, const std::filesystem::path& folder);

// Submits a script, to start once the jobs `after` have ended, successfully or not. Returns the job id.
// Throws InputError with the message of sbatch.
std::string SubmitJob(const std::filesystem::path& script, const std::vector<std::string>& after = {});

// Returns the ids of the user's pending and running jobs of this name, one per task; empty if squeue fails,
// with its message in `problem`.
std::optional<std::vector<std::string>> QueuedJobs(const std::string& name, std::string& problem);

}  // namespace sqslam::app
