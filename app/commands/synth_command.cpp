#include <fmt/format.h>

#include <cstdio>
#include <memory>
#include <numbers>
#include <string>

#include "app/commands/commands.h"
#include "app/commands/render_arguments.h"
#include "app/commands/run_arguments.h"
#include "app/terminal/terminal.h"
#include "render/synthetic/synthetic_sequence.h"

namespace sqslam::app {
namespace {

constexpr const char* kSynthNotes = R"(
Writes rgb/, rgb.txt, camera.yaml, groundtruth.txt, objects_gt.json, boxes.txt and boxes_noisy.txt.

Examples:
  sqslam synth assets/scenes/desk.yaml -o out/desk
  sqslam synth my_scene.yaml -o out/mine --frames 60 --noise --seed 7
)";

struct SynthArguments {
  std::string scene;
  std::string output;
  std::string frames;
  std::string backend = "auto";
  SynthesisOptions options;
  bool quiet = false;
};

void Synthesize(SynthArguments arguments) {
  arguments.options.frames = SceneFrames(arguments.frames);
  arguments.options.backend = ParseRenderBackend(arguments.backend);
  const SceneDescription scene = ReadScene(arguments.scene);
  const int frames = arguments.options.frames > 0 ? arguments.options.frames : scene.frames;
  Progress progress(frames, arguments.quiet);
  const SynthesisSummary summary = WriteSyntheticSequence(
      scene, arguments.output, arguments.options, [&](int done, int) { progress.Update(done, "rendering"); });
  progress.Finish();
  if (!arguments.quiet) {
    fmt::print("{}: {} frames, {} boxes of {} objects, {:.2f} m at {:.2f} m/s, turning {:.0f} deg/s\n",
               arguments.output, summary.frames, summary.boxes, summary.objects, summary.path_length,
               summary.mean_speed, summary.mean_turn_rate * 180.0 / std::numbers::pi);
  }
}

}  // namespace

void AddSynthCommand(Command& program) {
  const auto a = std::make_shared<SynthArguments>();
  Command& command =
      program.AddCommand("synth", "Render a scene into an image sequence with exact ground truth");
  command.Group("Input");
  command.Positional("SCENE", a->scene, "Scene description (YAML)").Required();
  command.Option("--frames N", a->frames, "Only the first N frames of the scene");
  command.Flag("--noise", a->options.noisy_detections,
               "boxes.txt as a detector would give them: shaky edges, misses, wrong labels");
  command.Option("--seed N", a->options.seed, "Seed of the hand's tremor, image noise and detector");
  command.Group("Output");
  command.Option("--output,-o DIR", a->output, "Folder to make").Required();
  command.Option("--supersampling N", a->options.supersampling, "Drawn this many times larger, then averaged")
      .Range(1, 4);
  command.Group("General");
  AddBackendOption(command, a->backend);
  command.Flag("--quiet,-q", a->quiet, "No progress, no summary");
  command.Notes(kSynthNotes);
  command.OnRun([a] { Synthesize(*a); });
}

}  // namespace sqslam::app
