#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace sqslam::app {

// Options of jobs for Slurm: the group `slurm` of an experiment, or the file of `sqslam render --slurm`.
struct SlurmOptions {
  std::string partition;            // empty: the cluster's own choice, so for time and memory
  std::string time;                 // as sbatch takes it
  std::string memory;               // as sbatch takes it
  int cpus = 1;                     // for each task
  std::vector<std::string> sbatch;  // further options, "--account=mapping"
  std::vector<std::string> setup;   // lines of the shell before the program, "module load sqslam"
  std::string program;              // as the shell takes it, "apptainer exec s.sif sqslam"; empty: this one
  int retries = 2;                  // times that a task without a result is made again
  double poll = 5.0;                // seconds from one look at the queue to the next

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

// A job in which the program does one thing for each word.
struct SlurmJobText {
  std::string name;
  std::filesystem::path logs;      // folder; what task K of an array prints goes to K.log, else to NAME.log
  std::vector<std::string> words;  // one task each, named by --task WORD; a single one: no array
  int at_once = 1;
  std::vector<std::string> command;  // arguments of the program, without --task
};

// The script that sbatch takes.
std::string JobScript(const SlurmJobText& job, const SlurmOptions& options);

// A name for the jobs that work for a folder, which no other folder has: sqslam-TITLE-1a2b3c4d.
std::string JobName(const std::string& title, const std::filesystem::path& folder);

// Hands a script to sbatch, after the end of the jobs `after`, however these end. Throws InputError with what
// sbatch says. Returns the number of the job.
std::string SubmitJob(const std::filesystem::path& script, const std::vector<std::string>& after = {});

// Numbers of the user's jobs of this name that wait or run, one for each task. Empty where squeue fails, with
// what it said in `problem`.
std::optional<std::vector<std::string>> QueuedJobs(const std::string& name, std::string& problem);

}  // namespace sqslam::app
