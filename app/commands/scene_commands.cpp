#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <limits>
#include <string>

#include "app/commands/commands.h"
#include "app/commands/render_arguments.h"
#include "app/report/report.h"
#include "app/run/terminal_run.h"
#include "app/terminal/terminal.h"
#include "render/synthetic/synthetic_sequence.h"
#include "slam/evaluation/evaluation.h"
#include "slam/geometry/angles.h"
#include "slam/io/frame_source.h"
#include "slam/run/run_pipeline.h"
#include "slam/util/atomic_file.h"
#include "slam/util/data_path.h"
#include "slam/util/stopwatch.h"
#include "slam/util/throw_if.h"

namespace sqslam::app {
namespace fs = std::filesystem;
namespace {

// Options of a scene that is rendered to a sequence.
struct SceneArguments {
  std::string frames;
  SynthesisOptions options;
  bool quiet = false;

  // Returns 0 for all frames. Throws UsageError if --frames does not begin at frame 0.
  int Frames() const {
    const FrameRange range = ParseFrameRange(frames);
    ThrowIf<UsageError>(range.start > 0,
                        "--frames {}: a scene is rendered from its first frame on, expected N", frames);
    const std::int64_t longest = std::numeric_limits<int>::max();
    return frames.empty() ? 0 : static_cast<int>(std::min(range.count, longest));
  }

  SynthesisSummary Render(const fs::path& file, const fs::path& output) const {
    SynthesisOptions chosen = options;
    chosen.frames = Frames();
    const SceneDescription scene = ReadScene(file);
    Progress progress(quiet);
    return WriteSyntheticSequence(scene, output, chosen,
                                  [&](int done, int total) { progress.Update(done, total, "rendering"); });
  }
};

constexpr const char* kDemoExamples = R"(
Renders the bundled desk to OUTPUT/desk, maps it to OUTPUT/result, evaluates the map against the exact ground
truth and writes OUTPUT/result/report.html. Needs no input and no display.

Examples:
  sqslam demo
  sqslam demo -o out/quick --frames 120 --no-video
)";

struct DemoArguments {
  std::string output;
  SceneArguments scene;
  bool deterministic = false;
  bool no_video = false;
};

// Prints "1/3  Rendering ..." before a step, and its result and duration after it.
class Steps {
 public:
  explicit Steps(bool quiet) : quiet_(quiet) {}

  void Begin(const std::string& what) {
    stopwatch_ = {};
    if (!quiet_) {
      PrintLine(fmt::format("{}/3  {}", ++number_, what));
    }
  }
  void End(const std::string& result) const {
    if (!quiet_) {
      PrintLine(fmt::format("     {} ({:.1f} s)", result, stopwatch_.Seconds()));
    }
  }

 private:
  bool quiet_;
  int number_ = 0;
  Stopwatch stopwatch_;
};

void RenderSequence(const DemoArguments& arguments, const fs::path& sequence, Steps& steps) {
  steps.Begin("Rendering the desk as a hand-held camera sees it");
  const SynthesisSummary summary = arguments.scene.Render(DataPath("assets/scenes/desk.yaml"), sequence);
  steps.End(fmt::format("{} frames, {} objects, a path of {:.2f} m", summary.frames, summary.objects,
                        summary.path_length));
}

FinishedRun MapSequence(const DemoArguments& arguments, const fs::path& sequence, const fs::path& result,
                        Steps& steps) {
  steps.Begin("Mapping it");
  RunRequest request;
  request.sequence.path = sequence;
  request.output = result;
  request.command = CommandLine();
  request.options.deterministic = arguments.deterministic;
  request.dense = DenseTime::kFinal;
  TerminalRun host({arguments.no_video ? "" : result / "growth.mp4"}, arguments.scene.quiet);
  FinishedRun run = RunPipeline(request, host);
  steps.End(fmt::format("{} of {} frames tracked, {} objects", run.stats.tracked, run.stats.frames,
                        run.stats.objects));
  return run;
}

int Demo(const DemoArguments& arguments) {
  arguments.scene.Frames();  // throws on invalid ranges before anything is written
  const fs::path output =
      arguments.output.empty() ? UnusedResultFolder("out", "demo") : fs::path(arguments.output);
  CreateResultFolder(output);
  const fs::path sequence = output / "desk";
  const fs::path result = output / "result";
  Steps steps(arguments.scene.quiet);
  RenderSequence(arguments, sequence, steps);
  const FinishedRun run = MapSequence(arguments, sequence, result, steps);
  if (run.interrupted) {
    return EndInterrupted(run);
  }
  steps.Begin("Evaluating the map against the ground truth");
  const Evaluation evaluation = EvaluateResult(result, sequence);
  WriteEvaluation(result / "eval.json", evaluation);
  WriteReport({result, "", run.sequence, {}, &run, &evaluation});
  steps.End(fmt::format("mean 3D IoU {:.3f}", evaluation.iou.mean));
  PrintSummary(arguments.scene.quiet, "\n{}", FormatEvaluation(evaluation));
  fmt::print("\nreport:   {}\n", (result / "report.html").string());
  fmt::print("picture:  {}\n", (result / "map.png").string());
  if (fs::exists(result / "growth.mp4")) {
    fmt::print("video:    {}\n", (result / "growth.mp4").string());
  }
  return 0;
}

constexpr const char* kSynthNotes = R"(
Writes rgb/, rgb.txt, camera.yaml, groundtruth.txt, objects_gt.json, dense.ply (points of the true surface,
for eval --dense), boxes.txt and boxes_noisy.txt.

Examples:
  sqslam synth assets/scenes/desk.yaml -o out/desk
  sqslam synth my_scene.yaml -o out/mine --frames 60 --noise --seed 7
)";

struct SynthArguments : SceneArguments {
  std::string scene;
  std::string output;
};

void Synthesize(const SynthArguments& arguments) {
  const SynthesisSummary summary = arguments.Render(arguments.scene, arguments.output);
  PrintSummary(arguments.quiet,
               "{}: {} frames, {} boxes of {} objects, {:.2f} m at {:.2f} m/s, turning {:.0f} deg/s\n",
               arguments.output, summary.frames, summary.boxes, summary.objects, summary.path_length,
               summary.mean_speed, summary.mean_turn_rate * kDegreesPerRadian);
}

}  // namespace

void AddDemoCommand(Command& program) {
  const auto [command, a] = program.AddCommand(
      "demo", "Render, map and evaluate a synthetic desk; needs no input", kDemoExamples, Demo);
  command.Group("Input");
  command.Option("--frames N", a.scene.frames, "Only the first N frames of the scene");
  command.Option("--seed N", a.scene.options.seed, "Seed of the camera shake and the image noise");
  command.Group("Output");
  command.Option("--output,-o DIR", a.output, "Output folder; default: out/demo, out/demo-2, ...");
  command.Flag("--no-video", a.no_video, "Do not write a video of the growing map");
  command.Group("General");
  command.Flag("--deterministic", a.deterministic,
               "Run tracking and mapping in turn, and record no times: all files are the same byte for byte");
  AddBackendOption(command, a.scene.options.backend);
  command.QuietFlag(a.scene.quiet, "Print only the paths of the results");
}

void AddSynthCommand(Command& program) {
  const auto [command, a] = program.AddCommand(
      "synth", "Render a scene into an image sequence with exact ground truth", kSynthNotes, Synthesize);
  command.Group("Input");
  command.Positional("SCENE", a.scene, "Scene description (YAML)").Required();
  command.Option("--frames N", a.frames, "Only the first N frames of the scene");
  command.Flag("--noise", a.options.noisy_detections,
               "Make boxes.txt like that of a detector: inaccurate edges, misses, wrong labels");
  command.Option("--seed N", a.options.seed, "Seed of camera shake, image noise and detector");
  command.Group("Output");
  command.Option("--output,-o DIR", a.output, "Output folder").Required();
  command.Option("--supersampling N", a.options.supersampling, "Render N times larger, then average")
      .Range(1, 4);
  command.Group("General");
  AddBackendOption(command, a.options.backend);
  command.QuietFlag(a.quiet, "No progress and no summary");
}

}  // namespace sqslam::app
