#pragma once

#include <functional>
#include <map>
#include <mutex>
#include <string>
#include <vector>

#include "app/cluster/array_work.h"
#include "app/experiment/cells.h"
#include "app/terminal/terminal.h"
#include "slam/util/stopwatch.h"

namespace sqslam::app {

struct CellFailure {
  std::string cell;
  int exit_code = 1;  // of the program; 1 if a signal ended it
  std::string message;
};

struct ExperimentOutcome {
  std::vector<CellResult> results;  // finished cells, in the order of ListCells
  std::vector<CellFailure> failures;
  int cells = 0;   // in all
  int reused = 0;  // finished before
  bool interrupted = false;
};

struct PlannedCell {
  ExperimentCell cell;
  CellCommands commands;
  nlohmann::ordered_json settings;
  std::optional<CellResult> finished;  // by an earlier call
};

struct ExperimentPlan {
  ExperimentConfig config;
  ExperimentFolder folder;
  std::map<std::string, PreparedSequence> sequences;  // by name
  std::vector<PlannedCell> cells;
};

// Plans all cells, or only the cell named `only` if that is not empty.
ExperimentPlan PlanExperiment(const ExperimentConfig& config, const ExperimentFolder& folder,
                              const std::string& only = "");

using StopRequest = std::function<bool()>;
using LinePrinter = std::function<void(const std::string&)>;

// Makes one cell: renders its scene if there is one, runs and scores it, and marks it as finished. Results
// are written under a temporary name and then renamed; locks keep programs that share the folder from doing
// the same work twice. Failures are returned.
ChildResult MakeCell(const ExperimentPlan& plan, const PlannedCell& planned, const StopRequest& stop,
                     const LinePrinter& print);

// The results of a plan's cells so far. Collect() and Fail() may be called from several threads; each prints
// a line for the cell, with the remaining time.
class CellProgress {
 public:
  CellProgress(const ExperimentPlan& plan, const LinePrinter& print);

  std::vector<std::size_t> Unfinished() const;  // cells without a result
  bool Collect(std::size_t index);              // reads the result of a cell; returns false if there is none
  void Fail(std::size_t index, const ChildResult& child);
  ExperimentOutcome Outcome(bool interrupted);  // call last

 private:
  void Print(const ExperimentCell& cell, const std::string& what);

  const ExperimentPlan& plan_;
  const LinePrinter& print_;
  std::size_t todo_ = 0;
  std::size_t done_ = 0;
  Stopwatch stopwatch_;
  std::vector<std::optional<CellResult>> results_;
  std::map<std::size_t, CellFailure> failures_;  // by cell
  std::mutex mutex_;
};

// Runs the unfinished cells, `config.jobs` at a time, each as a process of its own. Failures do not stop
// the others. `stop` ends the experiment early and loses only the running cells.
ExperimentOutcome RunExperiment(const ExperimentPlan& plan, const StopRequest& stop,
                                const LinePrinter& print);

struct ClusterOutcome {
  ExperimentOutcome outcome;
  ArrayEnd end = ArrayEnd::kEnded;
};

// Runs the unfinished cells on a Slurm cluster, one task each. Throws InputError if Slurm rejects a job.
ClusterOutcome RunOnSlurm(const ExperimentPlan& plan, const ArrayCall& call, const StopRequest& stop,
                          const LinePrinter& print);

// Runs one cell as a task. A failure is recorded next to the place of the result, for RunOnSlurm. Returns the
// exit code. Throws UsageError if there is no cell of this name.
int RunTask(const ExperimentConfig& config, const ExperimentFolder& folder, const std::string& name,
            const StopRequest& stop);

}  // namespace sqslam::app
