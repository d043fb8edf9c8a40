#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "app/cluster/array_work.h"
#include "app/experiment/cells.h"
#include "app/terminal/terminal.h"

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

// Runs the unfinished cells, `config.jobs` at a time, each as a process of its own. A failed cell is
// recorded, and the others go on. `stop` ends it early and loses only the running cells. `print` gets a line
// for each cell that ends, from one thread at a time.
ExperimentOutcome RunExperiment(ExperimentPlan plan, const StopRequest& stop, const LinePrinter& print);

struct ClusterOutcome {
  ExperimentOutcome outcome;
  ArrayEnd end = ArrayEnd::kEnded;
};

// Runs the unfinished cells of a plan on a Slurm cluster, one task each. `print` gets lines as in
// RunExperiment. Throws InputError if Slurm rejects a job.
ClusterOutcome RunOnSlurm(const ExperimentPlan& plan, const ArrayCall& call, const StopRequest& stop,
                          const LinePrinter& print);

// Runs one cell as a task. A failure is recorded next to the place of the result, for RunOnSlurm. Returns the
// exit code. Throws UsageError if there is no cell of this name.
int RunTask(const ExperimentConfig& config, const ExperimentFolder& folder, const std::string& name,
            const StopRequest& stop);

// The steps of one cell, shared by local runs and cluster tasks. Results are written under a temporary name
// and then renamed; locks keep programs that share the folder from doing the same work.

// Renders the scene of the cell's sequence unless it is there; waits if another program is rendering it.
// Throws InputError.
void RenderSequence(const ExperimentPlan& plan, const ExperimentCell& cell, const StopRequest& stop,
                    const LinePrinter& print);

// Writes the boxes of a cell with limited max_objects. Throws InputError.
void WriteLimitedBoxes(const ExperimentPlan& plan, const ExperimentCell& cell);

// Runs and scores the cell, and marks it as finished. `program` is ProgramFingerprint(). Throws InputError if
// the folder cannot be written or another program is running the cell.
ChildResult RunCell(const ExperimentPlan& plan, const PlannedCell& planned, const std::string& program,
                    const StopRequest& stop);

// "12 of 13 objects found, their mean IoU 0.712"
std::string Headline(const CellResult& result);

// "[3/8] NAME: WHAT (2.1 s); 9.4 runs/min, 0:32 left", after `elapsed` seconds.
std::string ProgressLine(std::size_t done, std::size_t total, double elapsed, const std::string& name,
                         const std::string& what, double seconds);

}  // namespace sqslam::app
