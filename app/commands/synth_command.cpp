#include <fmt/format.h>

#include <string>

#include "app/commands/commands.h"
#include "app/commands/render_arguments.h"
#include "slam/geometry/angles.h"

namespace sqslam::app {
namespace {

constexpr const char* kSynthNotes = R"(
Writes rgb/, rgb.txt, camera.yaml, groundtruth.txt, objects_gt.json, boxes.txt and boxes_noisy.txt.

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
  if (!arguments.quiet) {
    fmt::print("{}: {} frames, {} boxes of {} objects, {:.2f} m at {:.2f} m/s, turning {:.0f} deg/s\n",
               arguments.output, summary.frames, summary.boxes, summary.objects, summary.path_length,
               summary.mean_speed, summary.mean_turn_rate * kDegreesPerRadian);
  }
}

}  // namespace

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
