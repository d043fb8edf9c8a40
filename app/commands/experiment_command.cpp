#include <fmt/format.h>

#include <fstream>
#include <memory>
#include <optional>
#include <string>

#include "app/commands/commands.h"
#include "app/experiment/cluster_run.h"
#include "app/experiment/runner.h"
#include "app/experiment/tables.h"
#include "app/terminal/terminal.h"
#include "slam/util/atomic_file.h"
#include "slam/util/error.h"
#include "slam/util/file_lock.h"

namespace sqslam::app {
namespace fs = std::filesystem;
namespace {

constexpr const char* kExperimentNotes = R"(
Runs every combination of sequences, representations, associations, methods, variants and repetitions that
CONFIG.yaml asks for, holds each run against ground truth, and writes four tables with medians and ranges
(tables.md; table-1 to table-4 as .md, .tex and .csv): IoU by object class, IoU by sequence, landmarks by
association, time by number of objects.

Called again it goes on where it was stopped, tries failed runs again, and makes only those runs again whose
settings or inputs have changed. Each run is a process of its own; its output is in runs/NAME.log.

| sequences:                   # what is mapped
|   - path: data/kitchen       # as for sqslam run; or scene: FILE.yaml
|     name: kitchen            # also: detections, frames (N or A:B), start,
|                              # stride, format, camera, set, and evaluate:
|                              # false where there is no ground truth
| representations: [superquadric, ellipsoid, quadric, cuboid]
| associations: all            # or a list; so for methods (refined, paper)
| max_objects: [0, 4, 8, all]  # only boxes of the N objects with most boxes
| repetitions: 5
| variants:                    # options under a name, beside the defaults
|   - {name: no-lines, set: [objects.yaw.line_interval=0]}
| grids:                       # several grids, each with axes of its own
|   - {representations: all, methods: all}
|   - {associations: all, sequences: [kitchen]}
| jobs: 1                      # runs at a time; times are only good with 1
| objects: [kitchen/mug-1]     # get rows of their own in Table I
| # also: output, config (pipeline options), seed, deterministic
| slurm:                       # with --on slurm; all may be left out
|   partition: batch           # so time and memory: as sbatch takes them
|   cpus: 2                    # for each run
|   sbatch: [--account=maps]   # further options
|   setup: [module load x]     # lines of shell before the program
|   program: sqslam            # instead of this one: a container
|   retries: 2                 # of a run that ends without a result
|   poll: 5                    # seconds between looks at the queue

On a Slurm cluster each run is a task of an array. The command follows them as it does at home and makes the
tables. Ctrl-C leaves the tasks at work; the same command takes up again. With --submit-only a last job makes
again what failed, and the tables.

Examples:
  sqslam experiment configs/experiments/desk.yaml
  sqslam experiment paper.yaml -o out/paper --jobs 4
  sqslam experiment paper.yaml --on slurm --jobs 40
  sqslam experiment paper.yaml --dry-run           which runs there are, and which are finished
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
  if (!quiet) {
    fmt::print("{} runs: {} finished ({} of them before), {} failed\ntables: {}\n", outcome.cells,
               outcome.results.size(), outcome.reused, outcome.failures.size(), tables.string());
  }
  for (const CellFailure& failure : outcome.failures) {
    fmt::print(stderr, "sqslam: {} failed: {}\n", failure.cell, failure.message);
  }
}

// Writes the tables, prints the outcome, and returns the exit code.
int Finish(const ExperimentConfig& config, const ExperimentOutcome& outcome, const fs::path& folder,
           bool quiet) {
  PrintOutcome(outcome, WriteTables(config, outcome, folder), quiet);
  if (outcome.interrupted) {  // tasks of a cluster keep running
    fmt::print(stderr, "sqslam: interrupted; the same command goes on with the other {} runs\n",
               outcome.cells - static_cast<int>(outcome.results.size() + outcome.failures.size()));
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
  if (!lock) {
    throw InputError(
        fmt::format("{}: an experiment is at work in it, expected to be the only one", folder.string()));
  }
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
    return Finish(config, RunExperiment(std::move(plan), stop, print), folder, arguments.quiet);
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
  if (arguments.submit_only && arguments.where == "here") {
    throw UsageError("--submit-only: expected --on slurm");
  }
  const fs::path output = arguments.output.empty() ? config.output : arguments.output;
  fs::path folder = fs::absolute(output).lexically_normal();
  if (!folder.has_filename()) {  // "out/desk/"
    folder = folder.parent_path();
  }
  if (arguments.dry_run) {
    PrintPlan(PlanExperiment(config, {folder}));
    return 0;
  }
  return RunIn(folder, config, arguments);
}

}  // namespace

void AddExperimentCommand(Command& program) {
  const auto a = std::make_shared<ExperimentArguments>();
  Command& command = program.AddCommand(
      "experiment", "Many runs and their tables: sequences, representations, associations, repetitions");
  command.Group("Input");
  command.Positional("CONFIG", a->config, "Description of the experiment (YAML)").Required();
  command.Group("Output");
  command.Option("--output,-o DIR", a->output,
                 "Folder of the experiment, made or gone on with; default: output of CONFIG, or out/NAME");
  command.Group("Runs");
  command.Option("--jobs N", a->jobs, "Runs at a time, instead of jobs of CONFIG").AtLeast(1);
  command.Flag("--dry-run", a->dry_run, "List the runs and whether they are finished, and end");
  command.Flag("--fresh", a->fresh, "Make every run again, as after a new build of the program");
  command.Group("Cluster");
  command.Option("--on WHERE", a->where, "Make the runs on this computer or on a cluster")
      .OneOf({"here", "slurm"});
  command.Flag("--submit-only", a->submit_only,
               "With --on slurm: hand everything over and end; a last job makes the tables");
  command.Option("--task RUN", a->task, "Make only this run, without tables; tasks of a cluster are this");
  command.Group("General");
  command.Flag("--quiet,-q", a->quiet, "Print nothing but errors");
  command.Notes(kExperimentNotes);
  command.OnRun([a] { return Experiment(*a); });
}

}  // namespace sqslam::app
