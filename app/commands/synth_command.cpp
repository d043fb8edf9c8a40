#include <fmt/format.h>

#include <cstdio>
#include <memory>
#include <numbers>
#include <string>

#include "app/commands/commands.h"
#include "app/terminal/terminal.h"
#include "render/synthetic/synthetic_sequence.h"

namespace sqslam::app {
namespace {

struct SynthArguments {
  std::string scene;
  std::string output;
  std::string backend = "auto";
  SynthesisOptions options;
  bool quiet = false;
};

void Synthesize(SynthArguments arguments) {
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

void AddSynthCommand(CLI::App& app, int&) {
  const auto arguments = std::make_shared<SynthArguments>();
  CLI::App* synth =
      app.add_subcommand("synth", "Render a scene into an image sequence with exact ground truth");
  synth->footer(
      "\nWrites rgb/, rgb.txt, camera.yaml, groundtruth.txt, objects_gt.json, boxes.txt and "
      "boxes_noisy.txt.\n"
      "\nExamples:\n  sqslam synth assets/scenes/desk.yaml --output out/desk\n"
      "  sqslam synth my_scene.yaml --output out/mine --frames 60 --noise --seed 7\n");
  synth->add_option("SCENE", arguments->scene, "Scene description (YAML)")->required();
  synth->add_option("--output,-o", arguments->output, "Folder to make")->required();
  synth->add_option("--frames", arguments->options.frames, "Stop after this many frames; 0: all of the scene")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  synth->add_flag("--noise", arguments->options.noisy_detections,
                  "boxes.txt as a detector would give them: shaky edges, misses, wrong labels");
  synth->add_option("--seed", arguments->options.seed, "Of the hand's tremor, image noise and detector")
      ->capture_default_str();
  synth
      ->add_option("--supersampling", arguments->options.supersampling,
                   "Drawn this many times larger, then averaged")
      ->check(CLI::Range(1, 4))
      ->capture_default_str();
  synth->add_option("--rendering-backend", arguments->backend, "auto, osmesa or egl")->capture_default_str();
  synth->add_flag("--quiet,-q", arguments->quiet, "No progress, no summary");
  synth->callback([arguments] { Synthesize(*arguments); });
}

}  // namespace sqslam::app
