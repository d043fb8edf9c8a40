#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <memory>
#include <optional>
#include <string>

#include "app/commands/commands.h"
#include "app/experiment/runner.h"
#include "app/experiment/tables.h"
#include "app/terminal/terminal.h"
#include "slam/util/atomic_file.h"
#include "slam/util/error.h"

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

Examples:
  sqslam experiment configs/experiments/desk.yaml
  sqslam experiment paper.yaml -o out/paper --jobs 4
  sqslam experiment paper.yaml --dry-run           which runs there are, and which are finished
)";

struct ExperimentArguments {
  std::string config;
  std::string output;
  std::optional<int> jobs;
  bool dry_run = false;
  bool fresh = false;
  bool quiet = false;
};

// Keeps a second program out of the folder. The descriptor is left open in child processes on purpose: should
// this program be killed, the runs that it left behind still hold the folder until they end.
class FolderLock {
 public:
  explicit FolderLock(const fs::path& folder)
      : file_(::open((folder / "experiment.lock").c_str(), O_RDWR | O_CREAT, 0644)) {
    if (file_ < 0) {
      throw InputError(
          fmt::format("{}: cannot be written, expected a folder for the experiment", folder.string()));
    }
    if (::flock(file_, LOCK_EX | LOCK_NB) != 0) {
      ::close(file_);
      throw InputError(
          fmt::format("{}: an experiment is at work in it, expected to be the only one", folder.string()));
    }
  }
  ~FolderLock() { ::close(file_); }
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

 private:
  int file_;
};

// Makes the folder, or takes one that an experiment has made; nothing else is touched.
void ClaimFolder(const fs::path& folder) {
  if (!fs::exists(folder / "experiment.lock")) {
    CreateResultFolder(folder);
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

int RunIn(const fs::path& folder, const ExperimentConfig& config, bool fresh, bool quiet) {
  ClaimFolder(folder);
  const FolderLock lock(folder);
  const InterruptGuard interrupt;
  const auto print = [quiet](const std::string& line) {
    if (!quiet) {
      fmt::print("{}\n", line);
      std::fflush(stdout);
    }
  };
  ExperimentPlan plan = PlanExperiment(config, {folder});
  for (PlannedCell& planned : plan.cells) {
    planned.finished = fresh ? std::nullopt : planned.finished;
  }
  const ExperimentOutcome outcome = RunExperiment(
      std::move(plan), [&] { return interrupt.Interrupted(); }, print);
  PrintOutcome(outcome, WriteTables(config, outcome, folder), quiet);
  if (outcome.interrupted) {
    fmt::print(stderr, "sqslam: interrupted; the same command goes on with the other {} runs\n",
               outcome.cells - static_cast<int>(outcome.results.size() + outcome.failures.size()));
    return 130;
  }
  return outcome.failures.empty() ? 0 : outcome.failures.front().exit_code;
}

int Experiment(const ExperimentArguments& arguments) {
  ExperimentConfig config = ReadExperiment(arguments.config);
  config.jobs = arguments.jobs.value_or(config.jobs);
  const fs::path output = arguments.output.empty() ? config.output : arguments.output;
  fs::path folder = fs::absolute(output).lexically_normal();
  if (!folder.has_filename()) {  // "out/desk/"
    folder = folder.parent_path();
  }
  if (arguments.dry_run) {
    PrintPlan(PlanExperiment(config, {folder}));
    return 0;
  }
  return RunIn(folder, config, arguments.fresh, arguments.quiet);
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
  command.Group("General");
  command.Flag("--quiet,-q", a->quiet, "Print nothing but errors");
  command.Notes(kExperimentNotes);
  command.OnRun([a] { return Experiment(*a); });
}

}  // namespace sqslam::app
