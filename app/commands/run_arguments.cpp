#include "app/commands/run_arguments.h"

#include <fmt/format.h>

#include <filesystem>

#include "app/terminal/terminal.h"
#include "slam/io/coco.h"
#include "slam/io/live_source.h"
#include "slam/util/atomic_file.h"
#include "slam/util/data_path.h"
#include "slam/util/options.h"
#include "slam/util/text_lines.h"
#include "slam/util/throw_if.h"

namespace sqslam::app {
namespace fs = std::filesystem;
namespace {

// Returns a camera index: a number of up to three digits that names no file or folder.
std::optional<int> LiveCameraOf(const std::string& input) {
  const std::optional<int> number = ParseNumber<int>(input);
  return number && *number >= 0 && *number <= 999 && !fs::exists(input) ? number : std::nullopt;
}

// Splits "person,potted plant" into normalized labels; empty for "none".
std::vector<std::string> Labels(const std::string& text) {
  std::vector<std::string> labels;
  for (const std::string& label : Split(text == "none" ? "" : text, ',')) {
    ThrowIf<UsageError>(label.empty(), "--ignore {}: expected labels such as person,car, or none", text);
    labels.push_back(NormalizedLabel(label));
  }
  return labels;
}

// Checks the video path before the run rather than after it.
void CheckVideoName(const fs::path& video) {
  ThrowIf<UsageError>(video.extension() != ".mp4", "--video {}: expected FILE.mp4", video.string());
  const fs::path folder = video.has_parent_path() ? video.parent_path() : fs::path(".");
  ThrowIf<UsageError>(!fs::is_directory(folder), "--video {}: folder {} does not exist, expected one",
                      video.string(), folder.string());
}

}  // namespace

std::string NameOfInput(const fs::path& input) {
  const fs::path path = fs::absolute(input).lexically_normal();
  const std::string name =
      path.has_filename() ? path.stem().string() : path.parent_path().filename().string();
  return name.empty() ? "run" : name;
}

Argument& SequenceArguments::AddTo(Command& command, const std::string& input_help, bool with_camera) {
  command.Group("Input");
  Argument& positional = command.Positional("INPUT", input, input_help);
  command.Option("--format NAME", format, "Layout of INPUT; auto: detect it from file names");
  if (with_camera) {
    command.Option(
        "--camera NAME", camera,
        "Calibration, scaled to the images: FILE.yaml, also of Kalibr, ROS, OpenCV, ORB-SLAM, stella_vslam, "
        "COLMAP (cameras.txt, .bin) or nerfstudio (transforms.json); a preset of configs/cameras (" +
            ConfigNameList("configs/cameras") +
            "); or auto: guess the focal length and refine it from the images. Default: "
            "camera.yaml in the sequence folder, else the dataset's preset");
  }
  command.Option(
      "--resize SIZE", resize,
      "Scale images to WIDTH, WIDTH,HEIGHT or a factor such as 0.5 (1: full size); calibration, boxes and "
      "exports refer to the original size. Default: at most " +
          std::to_string(kMaxMappedSide) +
          " pixels on the longer side, small images at 480,360 or as many pixels");
  command.Option("--start N", start, "First frame").AtLeast(0);
  command.Option("--frames N|A:B", frames, "The first N frames, or A to B without B; A or B may be omitted");
  command.Option("--stride N", stride, "Use every N-th frame").AtLeast(1);
  return positional;
}

SequenceRequest SequenceArguments::Request() const { return {input, format, camera, {}, resize}; }

void RunArguments::AddTo(Command& command) {
  SequenceArguments::AddTo(command,
                           "Sequence folder (rgb.txt, camera.yaml, boxes.txt), dataset folder, image folder, "
                           "video, index of a live camera, or stream address (rtsp://..., http://...)");
  command.Option("--camera-index N", camera_index, "Live camera, instead of INPUT").AtLeast(0);
  command.Option("--detections PATH", detections,
                 "Boxes: boxes.txt, a folder with a text file per image, COCO JSON, MOTChallenge or CSV; see "
                 "docs/formats.md");
  command.Option(
      "--detector NAME", detector,
      "Network that detects objects while mapping: one of configs/detectors (" +
          ConfigNameList("configs/detectors") +
          "), FILE.yaml, or none. Default: boxes of the sequence, else the first of yolox-nano and "
          "centernet whose weights are installed");
  command.Option("--mask PATH", mask,
                 "Ignore black regions of an image, or of IMAGE.png in a folder, such as 0001.jpg.png");
  command.Option(
      "--ignore LABELS", ignore,
      "Classes of moving objects that are neither tracked nor mapped, such as person,car; none: map "
      "all. Default: no keypoints on people, animals and vehicles, no people as objects");
  command.Option(
      "--extend RESULT", extend,
      "Continue a finished run's map, with its options. The new video may start outside the mapped "
      "area and join it later. The new result holds both; objects keep their ids");
  command.Option("--scale-from THING", scale_from,
                 "Scale to metres, as `sqslam scale` does: LABEL=METRES, the height of an object, such as "
                 "cup=0.096; board, or board=COLUMNSxROWS,SQUARE,MARKER[,DICTIONARY] (mm), a ChArUco board");
  command.Group("Output");
  command.Option("--output,-o DIR", output, "Result folder; default: out/NAME, out/NAME-2, ...");
  command.Option("--video FILE.mp4", video, "Also write a video, as `sqslam render --growth` does");
  command
      .Option(
          "--dense [final|live]", dense,
          "Compute depth maps, a dense cloud and a mesh, as `sqslam densify` does. final: after the run; "
          "live: "
          "in the background, each stored in the recording at once. Default: final for recordings, unless "
          "with --no-render")
      .ImplicitValue("final");
  command.Flag("--no-dense", no_dense,
               "Leave out depth maps, dense cloud and mesh: half the time, sparse pictures");
  command.Flag("--no-render", no_render, "Do not write pictures and the report");
  command.Group("Mapping");
  command.Option("--config FILE", config, "Pipeline options (YAML, see configs/default.yaml)");
  command.Option("--set KEY=VALUE", set, "Override one option; may be repeated");
  command.Flag("--dump-config", dump_config, "Print all options with their values, then exit");
  command.Option("--representation NAME", representation,
                 "Shape of objects in pictures and files: superquadric (default); ellipsoid, cuboid: the one "
                 "that overlaps it most; quadric: the dual quadric of the boxes alone, as in QuadricSLAM");
  command.Option("--quadric-init NAME", quadric_init,
                 "Initialisation of quadrics: multi-view (default); single-view: from one view, support, "
                 "class proportions and texture symmetry, as in SO-SLAM");
  command.Option("--association NAME", association, "Tests that associate boxes with objects");
  command.Flag("--deterministic", deterministic,
               "Track and map in turn and record no times: all files are the same byte for byte");
  command.Option("--seed N", seed, "Seed of all random numbers").AtLeast(0);
  command.Flag("--realtime", realtime, "Play at the recorded speed; drop frames that come too fast");
  command.QuietFlag(quiet, "Print only warnings and errors");
}

SystemOptions RunArguments::Options() const {
  SystemOptions options = extend.empty() ? SystemOptions() : OptionsOfRun(extend);
  if (!config.empty()) {
    LoadOptions(config, options);
  }
  SetOptions(set, options);
  options.deterministic = options.deterministic || deterministic;
  options.seed = seed.value_or(options.seed);
  if (!detector.empty()) {
    options.detection.network = detector;
  }
  if (!ignore.empty()) {
    options.tracking.moving.labels = Labels(ignore);
    options.objects.detections.ignored_labels = options.tracking.moving.labels;
    options.dense.moving_labels = options.tracking.moving.labels;
  }
  options.objects.representation = representation.value_or(options.objects.representation);
  options.objects.quadric_init = quadric_init.value_or(options.objects.quadric_init);
  options.objects.association.method = association.value_or(options.objects.association.method);
  CheckOptions(options);
  return options;
}

// The cloud is made for the pictures.
std::optional<DenseTime> RunArguments::Dense(bool live) const {
  ThrowIf<UsageError>(dense && no_dense, "--dense and --no-dense: expected one of them");
  const bool pictures = !no_render || !video.empty();
  return dense || no_dense || live || !pictures ? dense : DenseTime::kFinal;
}

RunPictures RunArguments::Pictures() const {
  if (!video.empty()) {
    CheckVideoName(video);
  }
  return {video, !no_render};
}

RunRequest RunArguments::Request() const {
  ThrowIf<UsageError>(input.empty() && !camera_index,
                      "run: INPUT is missing, expected a sequence folder, an image folder, a video, a camera "
                      "index or an address");
  ThrowIf<UsageError>(
      !detections.empty() && !detector.empty() && detector != "none",
      "--detections and --detector: boxes come from a file or from a network, expected one of them");
  RunRequest request;
  request.command = CommandLine();
  request.sequence = SequenceArguments::Request();
  request.sequence.detections = detections;
  request.sequence.mask = mask;
  ThrowIf<UsageError>(camera_index && !input.empty(), "INPUT and --camera-index: expected one of them");
  request.live_camera = camera_index ? camera_index : LiveCameraOf(input);
  request.stream = IsStreamAddress(input) ? input : "";
  ThrowIf<UsageError>(request.IsLive() && !mask.empty(),
                      "--mask: a live camera has no recorded images, expected a sequence or a video");
  request.range = Range();
  request.extend = extend;
  if (!scale_from.empty()) {
    request.scale_from = ParseScaleReference(scale_from);
  }
  request.output =
      output.empty()
          ? UnusedResultFolder("out", request.live_camera ? fmt::format("camera{}", *request.live_camera)
                                      : request.IsLive()  ? "stream"
                                                          : NameOfInput(input))
          : fs::path(output);
  request.options = Options();
  request.dense = Dense(request.IsLive());
  request.realtime = realtime;
  return request;
}

}  // namespace sqslam::app
