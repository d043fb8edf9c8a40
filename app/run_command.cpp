#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cctype>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/commands.h"
#include "app/run_pipeline.h"
#include "app/sequence_arguments.h"
#include "slam/io/atomic_file.h"
#include "slam/util/error.h"
#include "slam/util/options.h"

namespace sqslam::app {
namespace fs = std::filesystem;
namespace {

constexpr const char* kExamples = R"(
Examples:
  sqslam run data/kitchen                        a folder with rgb.txt, camera.yaml and boxes.txt
  sqslam run data/kitchen --output out/k1 --frames 300 --deterministic
  sqslam run photos/ --camera phone.yaml --detections boxes/
  sqslam run living_room_traj2_frei_png          ICL-NUIM, RGB-D Scenes v2 and 7-Scenes as downloaded
  sqslam run rgbd_dataset_freiburg1_xyz --camera tum-freiburg1
  sqslam run 0 --camera webcam.yaml              a live camera, until Ctrl-C
  sqslam run film.mp4 --camera phone.yaml --set tracking.features.num_features=1500
  sqslam run data/kitchen --video kitchen.mp4
  sqslam run --dump-config > my.yaml             every option with its default
)";

// What the command line says, before it makes sense.
struct RunArguments {
  std::string input;
  std::string format = "auto";
  std::string camera;
  std::string config;
  std::vector<std::string> set;
  std::string detections;
  std::string output;
  std::int64_t start = 0;
  std::int64_t frames = std::numeric_limits<std::int64_t>::max();
  std::int64_t stride = 1;
  bool deterministic = false;
  std::int64_t seed = -1;
  bool realtime = false;
  std::string representation;
  std::string association;
  std::string video;
  bool no_render = false;
  bool quiet = false;
  bool dump_config = false;
};

SystemOptions MakeOptions(const RunArguments& arguments) {
  SystemOptions options;
  if (!arguments.config.empty()) {
    LoadOptions(arguments.config, options);
  }
  for (const std::string& assignment : arguments.set) {
    SetOption(assignment, options);
  }
  options.deterministic = options.deterministic || arguments.deterministic;
  options.seed = arguments.seed >= 0 ? arguments.seed : options.seed;
  if (!arguments.representation.empty()) {
    options.objects.representation = arguments.representation;
  }
  if (!arguments.association.empty()) {
    options.objects.association.method = arguments.association;
  }
  CheckOptions(options);
  return options;
}

// The name of the sequence, for the default result folder: that of the folder even for "." or
// "data/kitchen/".
std::string NameOf(const fs::path& input) {
  const fs::path path = fs::absolute(input).lexically_normal();
  const std::string name =
      path.has_filename() ? path.stem().string() : path.parent_path().filename().string();
  return name.empty() ? "run" : name;
}

// A camera index: a small number that is no file or folder.
std::optional<int> LiveCameraOf(const std::string& input) {
  constexpr std::size_t kMaxDigits = 3;
  const bool is_number =
      input.size() <= kMaxDigits &&
      std::all_of(input.begin(), input.end(), [](unsigned char c) { return std::isdigit(c) != 0; });
  return is_number && !fs::exists(input) ? std::optional(std::stoi(input)) : std::nullopt;
}

// Before the run rather than after it.
void CheckVideoName(const fs::path& video) {
  if (video.extension() != ".mp4") {
    throw UsageError(fmt::format("--video {}: expected FILE.mp4", video.string()));
  }
  const fs::path folder = video.has_parent_path() ? video.parent_path() : fs::path(".");
  if (!fs::is_directory(folder)) {
    throw UsageError(
        fmt::format("--video {}: there is no folder {}, expected one", video.string(), folder.string()));
  }
}

RunRequest MakeRequest(const RunArguments& arguments) {
  if (!arguments.video.empty()) {
    CheckVideoName(arguments.video);
  }
  RunRequest request;
  request.sequence = {arguments.input, ParseSequenceFormat(arguments.format), arguments.camera, arguments.detections};
  request.live_camera = LiveCameraOf(arguments.input);
  request.range = {arguments.start, arguments.frames, arguments.stride};
  request.output = arguments.output.empty()
                       ? FreeResultFolder("out", request.live_camera ? "camera" + arguments.input
                                                                     : NameOf(arguments.input))
                       : fs::path(arguments.output);
  request.options = MakeOptions(arguments);
  request.video = arguments.video;
  request.realtime = arguments.realtime;
  request.render = !arguments.no_render;
  request.quiet = arguments.quiet;
  return request;
}

void Print(const RunSummary& summary) {
  const RunStats& stats = summary.stats;
  const std::string dropped = stats.dropped > 0 ? fmt::format(" ({} more dropped)", stats.dropped) : "";
  fmt::print("{} of {} frames tracked{}, {} keyframes, {} points, {} objects in {:.1f} s\nresult: {}\n",
             stats.tracked, stats.frames, dropped, stats.keyframes, stats.points, stats.objects,
             stats.wall_seconds, summary.output.string());
}

void Run(const RunArguments& arguments, int& exit_code) {
  if (arguments.dump_config) {
    fmt::print("{}", DumpOptions(MakeOptions(arguments)));
    return;
  }
  if (arguments.input.empty()) {
    throw UsageError(
        "run: INPUT is missing, expected a sequence folder, an image folder, a video or a camera index");
  }
  const RunSummary summary = RunPipeline(MakeRequest(arguments));
  if (!arguments.quiet) {
    Print(summary);
  }
  if (summary.interrupted) {
    fmt::print(stderr, "sqslam: interrupted; what had been mapped is in {}\n", summary.output.string());
    exit_code = 130;
  }
}

}  // namespace

void AddRunCommand(CLI::App& app, int& exit_code) {
  const auto arguments = std::make_shared<RunArguments>();
  RunArguments& a = *arguments;
  CLI::App* run = app.add_subcommand("run", "Map an image sequence: objects, points, trajectory, pictures");
  run->footer(kExamples);
  run->add_option(
      "INPUT", a.input,
      "Sequence folder (rgb.txt, camera.yaml, boxes.txt), dataset folder, image folder, video, or the "
      "index of a live camera");
  run->add_option("--format", a.format, "How INPUT is laid out; auto tells by the names in it")
      ->check(CLI::IsMember({"auto", "tum", "icl-nuim", "scenes-v2", "7-scenes", "images", "video"}))
      ->capture_default_str();
  run->add_option(
      "--camera", a.camera,
      "Calibration: FILE.yaml, or a preset of configs/cameras such as tum-freiburg1; default: camera.yaml in "
      "the sequence folder, else the dataset's preset");
  run->add_option("--config", a.config, "Options of the pipeline (YAML, see configs/default.yaml)");
  run->add_option("--set", a.set, "Override one option, key=value; may be repeated")->expected(1)->take_all();
  run->add_option("--detections", a.detections, "boxes.txt, or a folder with one TIMESTAMP.txt a frame");
  run->add_option("--output", a.output, "Result folder; default: out/NAME, out/NAME-2, ...");
  run->add_option("--start", a.start, "First frame")->check(CLI::NonNegativeNumber);
  run->add_option("--frames", a.frames, "Number of frames at most; default: all")->check(CLI::PositiveNumber);
  run->add_option("--stride", a.stride, "Take every n-th frame")->check(CLI::PositiveNumber);
  run->add_flag("--deterministic", a.deterministic, "Track and map in turn: the same result from run to run");
  run->add_option("--seed", a.seed, "Seed of every random source")->check(CLI::NonNegativeNumber);
  run->add_flag("--realtime", a.realtime,
                "Play at the sequence's own speed and drop what comes too fast, as a live camera does");
  run->add_option(
         "--representation", a.representation,
         "What objects are shown and written as: superquadric (default); ellipsoid, cuboid: at the same "
         "place and of the same size; quadric: the dual quadric of the boxes alone, as in QuadricSLAM")
      ->check(CLI::IsMember({"superquadric", "ellipsoid", "quadric", "cuboid"}));
  run->add_option("--association", a.association, "Which tests associate boxes with objects")
      ->check(CLI::IsMember({"full", "iou", "iou+points", "iou+ttest", "nonparametric", "ensemble"}));
  run->add_option("--video", a.video,
                  "FILE.mp4: afterwards, make a video of the map's growth, as `sqslam render --growth` does");
  run->add_flag("--no-render", a.no_render, "No pictures and no report");
  run->add_flag("--quiet", a.quiet, "No progress and no summary; warnings and errors stay");
  run->add_flag("--dump-config", a.dump_config, "Print all options as they would be used, and end");
  run->callback([arguments, &exit_code] { Run(*arguments, exit_code); });
}

}  // namespace sqslam::app
