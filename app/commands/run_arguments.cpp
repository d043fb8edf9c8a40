#include "app/commands/run_arguments.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <optional>

#include "app/commands/sequence_arguments.h"
#include "slam/util/atomic_file.h"
#include "slam/util/error.h"
#include "slam/util/options.h"

namespace sqslam::app {
namespace fs = std::filesystem;
namespace {

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

}  // namespace

void RunArguments::AddTo(CLI::App& command) {
  command.add_option(
      "INPUT", input,
      "Sequence folder (rgb.txt, camera.yaml, boxes.txt), dataset folder, image folder, video, or the "
      "index of a live camera");
  command.add_option("--camera-index", camera_index, "A live camera of this machine, instead of INPUT")
      ->check(CLI::NonNegativeNumber);
  command.add_option("--format", format, "How INPUT is laid out; auto tells by the names in it")
      ->check(CLI::IsMember(AllNames<SequenceFormat>()))
      ->capture_default_str();
  command.add_option(
      "--camera", camera,
      "Calibration: FILE.yaml; a preset of configs/cameras such as tum-freiburg1; or auto: guess the focal "
      "length and refine it on the images; default: camera.yaml in the sequence folder, else the dataset's "
      "preset");
  command.add_option(
      "--resize", resize,
      "Make the images smaller first: WIDTH, WIDTH,HEIGHT or a factor such as 0.5; calibration "
      "and boxes are those of the images as they are");
  command.add_option("--config", config, "Options of the pipeline (YAML, see configs/default.yaml)");
  command.add_option("--set", set, "Override one option, key=value; may be repeated")
      ->expected(1)
      ->take_all();
  command.add_option("--detections", detections, "boxes.txt, or a folder with one TIMESTAMP.txt a frame");
  command.add_option("--detector", detector,
                     "Network that finds the boxes while mapping: a name of configs/detectors, FILE.yaml, or "
                     "none; default: boxes of the sequence, else the first of yolox-nano and centernet whose "
                     "weights are there");
  command.add_option("--output", output, "Result folder; default: out/NAME, out/NAME-2, ...");
  command.add_option("--start", start, "First frame")->check(CLI::NonNegativeNumber);
  command.add_option("--frames", frames, "Number of frames at most; default: all")
      ->check(CLI::PositiveNumber);
  command.add_option("--stride", stride, "Take every n-th frame")->check(CLI::PositiveNumber);
  command.add_flag("--deterministic", deterministic,
                   "Track and map in turn: the same result from run to run");
  command.add_option("--seed", seed, "Seed of every random source")->check(CLI::NonNegativeNumber);
  command.add_flag("--realtime", realtime,
                   "Play at the sequence's own speed and drop what comes too fast, as a live camera does");
  command
      .add_option(
          "--representation", representation,
          "What objects are shown and written as: superquadric (default); ellipsoid, cuboid: at the same "
          "place and of the same size; quadric: the dual quadric of the boxes alone, as in QuadricSLAM")
      ->check(CLI::IsMember(AllNames<Representation>()));
  command.add_option("--association", association, "Which tests associate boxes with objects")
      ->check(CLI::IsMember(AllNames<AssociationMethod>()));
  command.add_option(
      "--video", video,
      "FILE.mp4: afterwards, make a video of the map's growth, as `sqslam render --growth` does");
  command.add_flag("--no-render", no_render, "No pictures and no report");
  command.add_flag("--quiet", quiet, "No progress and no summary; warnings and errors stay");
  command.add_flag("--dump-config", dump_config, "Print all options as they would be used, and end");
}

SystemOptions RunArguments::Options() const {
  SystemOptions options;
  if (!config.empty()) {
    LoadOptions(config, options);
  }
  for (const std::string& assignment : set) {
    SetOption(assignment, options);
  }
  options.deterministic = options.deterministic || deterministic;
  options.seed = seed >= 0 ? seed : options.seed;
  if (!detector.empty()) {
    options.detection.network = detector;
  }
  if (!representation.empty()) {
    options.objects.representation = *FromName<Representation>(representation);
  }
  if (!association.empty()) {
    options.objects.association.method = *FromName<AssociationMethod>(association);
  }
  CheckOptions(options);
  return options;
}

RunPictures RunArguments::Pictures() const {
  if (!video.empty()) {
    CheckVideoName(video);
  }
  return {video, !no_render};
}

RunRequest RunArguments::Request() const {
  if (!detections.empty() && !detector.empty() && detector != "none") {
    throw UsageError(
        "--detections and --detector: boxes come from a file or from a network, expected one of them");
  }
  RunRequest request;
  request.sequence = {input, ParseSequenceFormat(format), camera, detections, resize};
  if (camera_index >= 0 && !input.empty()) {
    throw UsageError("INPUT and --camera-index: expected one of them");
  }
  request.live_camera = camera_index >= 0 ? std::optional(camera_index) : LiveCameraOf(input);
  request.range = {start, frames, stride};
  request.output =
      output.empty()
          ? FreeResultFolder(
                "out", request.live_camera ? fmt::format("camera{}", *request.live_camera) : NameOf(input))
          : fs::path(output);
  request.options = Options();
  request.realtime = realtime;
  return request;
}

}  // namespace sqslam::app
