#include <fmt/format.h>

#include <fstream>
#include <optional>
#include <string>

#include "app/commands/commands.h"
#include "app/experiment/runner.h"
#include "app/experiment/tables.h"
#include "app/terminal/terminal.h"
#include "slam/util/atomic_file.h"
#include "slam/util/data_path.h"
#include "slam/util/file_lock.h"
#include "slam/util/throw_if.h"

namespace sqslam::app {
namespace fs = std::filesystem;
namespace {

constexpr const char* kExperimentNotes = R"(
Runs every combination of the sequences, representations, associations, methods, variants and repetitions in
CONFIG.yaml, evaluates each run, and writes four tables with medians and ranges (tables.md; table-1 to table-4 as
.md, .tex and .csv): IoU by object class, IoU by sequence, landmarks by association, time by number of objects.

Run the same command to resume after an interruption: it repeats runs that failed or whose settings or inputs have
changed, and keeps all others. Each run is a separate process that writes to runs/NAME.log.

| sequences:                   # sequences to map
|   - path: data/kitchen       # as for sqslam run; or scene: FILE.yaml
|     name: kitchen            # also: detections, frames (N or A:B), start,
|                              # stride, format, camera, set, and evaluate:
|                              # false if there is no ground truth
| representations: [superquadric, ellipsoid, quadric, cuboid]
| associations: all            # or a list; likewise methods (refined, paper)
| max_objects: [0, 4, 8, all]  # only boxes of the N objects with most boxes
| repetitions: 5
| variants:                    # named sets of options, besides the defaults
|   - {name: no-lines, set: [objects.yaw.line_interval=0]}
| grids:                       # several grids, each with its own axes
|   - {representations: all, methods: all}
|   - {associations: all, sequences: [kitchen]}
| jobs: 1                      # parallel runs; use 1 to measure times
| objects: [kitchen/mug-1]     # objects with their own row in Table I
| # also: output, config (pipeline options), seed, deterministic
| slurm:                       # for --on slurm; all keys are optional
|   partition: batch           # also time and memory, as for sbatch
|   cpus: 2                    # per run
|   sbatch: [--account=maps]   # further options of sbatch
|   setup: [module load x]     # shell commands before the program
|   program: sqslam            # another command, such as a container
|   retries: 2                 # of a run that ends without a result
|   poll: 5                    # seconds between queries of the queue

On a Slurm cluster each run is a task of a job array. The command waits for the tasks and writes the tables.
Ctrl-C leaves the tasks running; run the same command to wait for them again. With --submit-only, a last job
repeats failed runs and writes the tables.

Examples:
  sqslam experiment configs/experiments/desk.yaml
  sqslam experiment paper.yaml -o out/paper --jobs 4
  sqslam experiment paper.yaml --on slurm --jobs 40
  sqslam experiment paper.yaml --dry-run           list the runs and which are finished
)";

struct ExperimentArguments {
  std::string config;
  std::string output;
  std::optional<int> jobs;
  bool dry_run = false;
  bool fresh = false;
  bool quiet = false;
  std::string where = "here";
  bool submit_only = false;
  std::string task;
};

// Creates the folder, or takes one of an earlier experiment. Throws if it holds anything else.
void ClaimFolder(const fs::path& folder) {
  if (!fs::exists(folder / "experiment.lock")) {
    CreateResultFolder(folder);
    std::ofstream(folder / "experiment.lock", std::ios::app);
  }
}

void PrintPlan(const ExperimentPlan& plan) {
  int finished = 0;
  for (const PlannedCell& planned : plan.cells) {
    fmt::print("{:<9} {}\n", planned.finished ? "finished" : "to do", planned.cell.name);
    finished += planned.finished ? 1 : 0;
  }
  fmt::print("{} runs, {} finished\n", plan.cells.size(), finished);
}

void PrintOutcome(const ExperimentOutcome& outcome, const fs::path& tables, bool quiet) {
  PrintSummary(quiet, "{} runs: {} finished ({} of them before), {} failed\ntables: {}\n", outcome.cells,
               outcome.results.size(), outcome.reused, outcome.failures.size(), tables.string());
  for (const CellFailure& failure : outcome.failures) {
    PrintNotice(fmt::format("sqslam: {} failed: {}", failure.cell, failure.message));
  }
}

// Writes the tables, prints the outcome, and returns the exit code.
int Finish(const ExperimentConfig& config, const ExperimentOutcome& outcome, const fs::path& folder,
           bool quiet) {
  PrintOutcome(outcome, WriteTables(config, outcome, folder), quiet);
  if (outcome.interrupted) {  // tasks of a cluster keep running
    PrintNotice(
        fmt::format("sqslam: interrupted; run the same command to resume with the other {} runs",
                    outcome.cells - static_cast<int>(outcome.results.size() + outcome.failures.size())));
    return 130;
  }
  return outcome.failures.empty() ? 0 : outcome.failures.front().exit_code;
}

int RunIn(const fs::path& folder, const ExperimentConfig& config, const ExperimentArguments& arguments) {
  ClaimFolder(folder);
  const InterruptGuard interrupt;
  const auto stop = [&] { return interrupt.Interrupted(); };
  const bool here = arguments.where == "here";
  const bool last = !here && arguments.task == kLastTask;
  if (!arguments.task.empty() && !last) {
    return RunTask(config, {folder}, arguments.task, stop);
  }
  const std::optional<FileLock> lock = FileLock::Try(folder / "experiment.lock");
  if (!lock && last) {
    return 0;  // another program follows the tasks and will write the tables
  }
  ThrowIf<InputError>(!lock, "{}: another program is running this experiment, expected no other",
                      folder.string());
  const auto print = [&arguments](const std::string& line) {
    if (!arguments.quiet) {
      PrintLine(line);
    }
  };
  ExperimentPlan plan = PlanExperiment(config, {folder});
  if (arguments.fresh && !last) {
    for (PlannedCell& planned : plan.cells) {
      planned.finished.reset();
      if (!here) {  // tasks know only from the folder which runs are finished
        fs::remove(plan.folder.Run(planned.cell) / "cell.json");
      }
    }
  }
  if (here) {
    return Finish(config, RunExperiment(plan, stop, print), folder, arguments.quiet);
  }
  const ClusterOutcome made = RunOnSlurm(plan, {arguments.submit_only || last, last}, stop, print);
  if (made.end == ArrayEnd::kSubmitted) {
    print(fmt::format("a last job makes the tables: {}", (folder / "tables.md").string()));
    return 0;
  }
  return Finish(config, made.outcome, folder, arguments.quiet);
}

int Experiment(const ExperimentArguments& arguments) {
  ExperimentConfig config = ReadExperiment(arguments.config);
  config.jobs = arguments.jobs.value_or(config.jobs);
  ThrowIf<UsageError>(arguments.submit_only && arguments.where == "here",
                      "--submit-only: expected --on slurm");
  const fs::path output = arguments.output.empty() ? config.output : arguments.output;
  const fs::path folder = AbsolutePath(output);
  if (arguments.dry_run) {
    PrintPlan(PlanExperiment(config, {folder}));
    return 0;
  }
  return RunIn(folder, config, arguments);
}

}  // namespace

void AddExperimentCommand(Command& program) {
  const auto [command, a] =
      program.AddCommand("experiment", "Run many sequences and configurations and tabulate the results",
                         kExperimentNotes, Experiment);
  command.Group("Input");
  command.Positional("CONFIG", a.config, "Description of the experiment (YAML)").Required();
  command.Group("Output");
  command.Option("--output,-o DIR", a.output,
                 "New folder, or one to resume; default: output of CONFIG, or out/NAME");
  command.Group("Runs");
  command.Option("--jobs N", a.jobs, "Parallel runs, instead of jobs of CONFIG").AtLeast(1);
  command.Flag("--dry-run", a.dry_run, "List the runs and whether they are finished, then exit");
  command.Flag("--fresh", a.fresh, "Repeat all runs, for example after a new build");
  command.Group("Cluster");
  command.Option("--on WHERE", a.where, "Run on this computer or on a cluster").OneOf({"here", "slurm"});
  command.Flag("--submit-only", a.submit_only,
               "With --on slurm: submit all jobs and exit; a last job writes the tables");
  command.Option("--task RUN", a.task, "Make only this run, without tables; for tasks of a cluster");
  command.QuietFlag(a.quiet, "Print only errors");
}

}  // namespace sqslam::app
