#include "app/commands/render_arguments.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <charconv>
#include <cmath>

#include "app/result/map_input.h"
#include "render/camera/scene_framing.h"
#include "slam/util/error.h"
#include "slam/util/options.h"

namespace sqslam::app {
namespace fs = std::filesystem;
namespace {

// "1.5,2,3" to numbers, or UsageError that names the option.
template <std::size_t N>
std::array<double, N> ParseNumbers(const std::string& option, const std::string& text, const char* expected) {
  std::array<double, N> numbers{};
  const char* at = text.data();
  const char* const end = at + text.size();
  for (std::size_t i = 0; i < N; ++i) {
    const auto [next, error] = std::from_chars(at, end, numbers[i]);
    const bool last = i + 1 == N;
    if (error != std::errc() || (last ? next != end : next == end || *next != ',')) {
      throw UsageError(fmt::format("{} {}: expected {}", option, text, expected));
    }
    at = next + (last ? 0 : 1);
  }
  return numbers;
}

std::optional<Eigen::Vector3d> ParseVector(const std::string& option, const std::string& text) {
  if (text.empty()) {
    return std::nullopt;
  }
  const auto numbers = ParseNumbers<3>(option, text, "X,Y,Z in map units, such as 0.5,-2,1");
  return Eigen::Vector3d(numbers[0], numbers[1], numbers[2]);
}

cv::Size ParseResolution(const std::string& text) {
  const auto size = ParseNumbers<2>("--resolution", text, "WIDTH,HEIGHT in pixels, such as 1280,720");
  for (const double side : size) {
    if (side != std::floor(side) || side < 16 || side > 8192) {
      throw UsageError(fmt::format("--resolution {}: expected whole numbers from 16 to 8192", text));
    }
  }
  return {static_cast<int>(size[0]), static_cast<int>(size[1])};
}

struct NamedPath {
  const char* name;
  CameraPath path;
};
constexpr std::array<NamedPath, 5> kPaths = {{{"still", CameraPath::kStill},
                                              {"orbit", CameraPath::kOrbit},
                                              {"turntable", CameraPath::kOrbit},
                                              {"follow", CameraPath::kFollow},
                                              {"first-person", CameraPath::kFirstPerson}}};

bool IsPathFile(const std::string& path) {
  const std::string extension = fs::path(path).extension().string();
  return extension == ".yaml" || extension == ".yml";
}

CameraPath ParsePath(const std::string& name) {
  for (const NamedPath& path : kPaths) {
    if (name == path.name) {
      return path.path;
    }
  }
  throw UsageError(fmt::format(
      "--camera-path {}: expected still, orbit, turntable, follow, first-person or FILE.yaml", name));
}

// "A:B", either of which may be missing.
void ParseFrames(const std::string& text, VideoOptions& options) {
  const std::size_t colon = text.find(':');
  const auto number = [&](const std::string& part, int missing) {
    int value = missing;
    const auto [end, error] = std::from_chars(part.data(), part.data() + part.size(), value);
    if (!part.empty() && (error != std::errc() || end != part.data() + part.size() || value < 0)) {
      throw UsageError(fmt::format("--frames {}: expected A:B, such as 0:30, the end excluded", text));
    }
    return value;
  };
  if (colon == std::string::npos) {
    throw UsageError(fmt::format("--frames {}: expected A:B, such as 0:30, the end excluded", text));
  }
  options.first = number(text.substr(0, colon), 0);
  options.end = number(text.substr(colon + 1), -1);
}

void AddCameraOptions(CLI::App& command, RenderArguments& a) {
  const char* group = "Camera";
  command
      .add_option("--view", a.view,
                  "front, right, back, left, top or isometric instead of the automatic view")
      ->check(CLI::IsMember(ViewPresetNames()))
      ->group(group);
  command.add_option("--camera-position", a.position, "X,Y,Z in the map")->group(group);
  command.add_option("--camera-focal-point", a.focal_point, "X,Y,Z in the map")->group(group);
  command.add_option("--camera-view-up", a.view_up, "X,Y,Z, the direction that is up in the picture")
      ->group(group);
  command.add_option("--camera-view-angle", a.view_angle, "Vertical, degrees")
      ->check(CLI::Range(1.0, 170.0))
      ->group(group);
  command.add_option("--camera-azimuth-angle", a.azimuth, "Turn around the focal point, degrees")
      ->group(group);
  command.add_option("--camera-elevation-angle", a.elevation, "Raise, degrees")->group(group);
  command.add_option("--camera-zoom-factor", a.zoom, "Above 1: nearer")
      ->check(CLI::Range(0.01, 100.0))
      ->group(group);
  command.add_option("--camera-frame", a.camera_frame,
                     "N: as the input camera saw frame N, its principal point included; without the cameras "
                     "unless --set cameras.* says otherwise");
  command.get_option("--camera-frame")->check(CLI::NonNegativeNumber)->group(group);
  command
      .add_flag("--overlay", a.overlay,
                "With --camera-frame: outlines and names of the objects over the photograph, without the "
                "distortion of its lens")
      ->group(group);
  command
      .add_option("--camera-path", a.path,
                  "For videos: still, orbit or turntable (default; with --growth a slow swing), follow, "
                  "first-person, or FILE.yaml with key frames (see configs/camera_paths)")
      ->group(group);
}

void AddVideoOptions(CLI::App& command, RenderArguments& a) {
  const char* group = "Video";
  command.add_flag("--growth", a.growth, "Play the run instead of the final map, the input image beside it")
      ->group(group);
  command.add_option("--frames", a.frames, "A:B, only these frames of the output, the end excluded")
      ->group(group);
  command.add_option("--fps", a.fps, "Frames a second of a video")
      ->check(CLI::Range(1.0, 240.0))
      ->group(group);
  command
      .add_option("--seconds", a.seconds, "Length of a video of the final map; longest of one of its growth")
      ->check(CLI::Range(0.01, 36000.0))
      ->capture_default_str()
      ->group(group);
  command
      .add_option(
          "--shard", a.shard,
          "I/N: only the I-th of N equal pieces of the video, as FILE.part-I-of-N.mp4 (numbered pictures "
          "keep their numbers)")
      ->group(group);
  command
      .add_option("--join", a.join,
                  "Instead of a MAP: put these pieces, or numbered pictures, together to --output FILE.mp4")
      ->group(group);
}

}  // namespace

PictureOptions MakePictureOptions(const RenderArguments& a) {
  PictureOptions options;
  if (!a.resolution.empty()) {
    const cv::Size size = ParseResolution(a.resolution);
    options.width = size.width;
    options.height = size.height;
  }
  options.transparent = a.no_background;
  options.backend = ParseRenderBackend(a.backend);
  options.style = LoadStyle(a.style);
  for (const std::string& setting : a.settings) {
    SetOption(setting, options.style);
  }
  CheckStyle(options.style);
  options.camera.view = a.view;
  options.camera.position = ParseVector("--camera-position", a.position);
  options.camera.focal_point = ParseVector("--camera-focal-point", a.focal_point);
  options.camera.view_up = ParseVector("--camera-view-up", a.view_up);
  if (options.camera.view_up && options.camera.view_up->norm() < 1e-9) {
    throw UsageError(fmt::format("--camera-view-up {}: expected a direction, not zero", a.view_up));
  }
  options.camera.view_angle = a.view_angle;
  options.camera.azimuth = a.azimuth;
  options.camera.elevation = a.elevation;
  options.camera.zoom = a.zoom;
  return options;
}

VideoOptions MakeVideoOptions(const RenderArguments& a, const PictureOptions& picture, double fps) {
  VideoOptions options;
  options.picture = picture;
  options.seconds = a.seconds;
  options.fps = a.fps.value_or(fps);
  if (IsPathFile(a.path)) {
    options.path_file = ReadCameraPath(a.path, options.fps);
  } else if (!a.path.empty()) {
    options.path = ParsePath(a.path);
  }
  if (!a.frames.empty()) {
    ParseFrames(a.frames, options);
  }
  if (!a.shard.empty()) {
    options.shard = ParseShard(a.shard);
  }
  return options;
}

bool MakesFrames(const RenderArguments& a) {
  return IsFrameTemplate(a.output) || fs::path(a.output).extension() == ".mp4";
}

void CheckRenderArguments(const RenderArguments& a) {
  const bool frames = MakesFrames(a);
  if (!a.join.empty()) {
    if (fs::path(a.output).extension() != ".mp4" || !a.map.empty() || !a.edits.empty()) {
      throw UsageError("--join: expected pieces and --output FILE.mp4, and no MAP or --edits");
    }
    return;
  }
  if (a.map.empty()) {
    throw UsageError("MAP is missing, expected map.sqmap or the result folder that holds it");
  }
  if (a.output.empty() && a.reference.empty()) {
    throw UsageError("nothing to do, expected --output FILE, --reference FILE or both");
  }
  if (!frames && !a.output.empty() && fs::path(a.output).extension() != ".png") {
    throw UsageError(
        fmt::format("--output {}: expected FILE.png, a name with {{frame:04}} that ends in .png, or "
                    "FILE.mp4",
                    a.output));
  }
  if (frames && !a.reference.empty()) {
    throw UsageError("--reference: compares one picture, expected --output FILE.png or none");
  }
  const bool wants_frames =
      a.growth || !a.frames.empty() || !a.shard.empty() || (!a.path.empty() && a.path != "still");
  if (!frames && wants_frames) {
    throw UsageError(
        fmt::format("--output {}: one picture, expected FILE.mp4 or a name with {{frame:04}} for "
                    "--growth, --frames, --shard and --camera-path",
                    a.output));
  }
  if (frames && a.camera_frame) {
    throw UsageError(
        "--camera-frame: makes one picture, expected --output FILE.png (the camera's way is --camera-path "
        "first-person)");
  }
  const bool moved = !a.view.empty() || !a.position.empty() || !a.focal_point.empty() || !a.view_up.empty() ||
                     a.view_angle || a.azimuth != 0.0 || a.elevation != 0.0 || a.zoom != 1.0;
  if (a.camera_frame && moved) {
    throw UsageError(
        "--camera-frame: the view of a real camera, expected no --view and no other --camera option");
  }
  if (a.at_frame && (frames || a.camera_frame)) {
    throw UsageError("--at-frame: makes one picture, expected --output FILE.png and no --camera-frame");
  }
  if (a.overlay && !a.camera_frame) {
    throw UsageError("--overlay: expected --camera-frame N, the frame to draw over");
  }
  if (a.overlay && a.no_background) {
    throw UsageError("--overlay: the photograph is the background, expected no --no-background");
  }
}

void AddRenderOptions(CLI::App& command, RenderArguments& a) {
  command.add_option("MAP", a.map, "map.sqmap, or the result folder that holds it");
  command.add_option("--output", a.output,
                     "FILE.png, FILE.mp4, or numbered pictures by a name with {frame:04}");
  command.add_option("--resolution", a.resolution,
                     "WIDTH,HEIGHT in pixels [1280,720; with --camera-frame the size of the images]");
  command
      .add_option("--at-frame", a.at_frame,
                  "N: the map as it was at frame N of the run instead of the finished one, whose framing and "
                  "colours it keeps")
      ->check(CLI::NonNegativeNumber);
  command.add_flag("--no-background", a.no_background, "Transparent instead of the style's background");
  command.add_option("--rendering-backend", a.backend, "auto, osmesa or egl")
      ->check(CLI::IsMember({"auto", "osmesa", "egl"}))
      ->capture_default_str();
  command.add_option("--style", a.style, "A style's name (paper, dark) or FILE.yaml")->capture_default_str();
  command.add_option("--set", a.settings, "KEY=VALUE of the style, repeatable")->expected(1)->take_all();
  command.add_option("--reference", a.reference,
                     "Compare the picture with this one; exit code 5 if it differs");
  command
      .add_option("--reference-threshold", a.threshold,
                  "Largest 1 - SSIM, averaged where something is drawn, that still passes")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  command.add_flag("--quiet", a.quiet, "No progress");
  AddEditsOption(command, a.edits);
  AddLayerOptions(command, a.layers);
  AddCameraOptions(command, a);
  AddVideoOptions(command, a);
}

}  // namespace sqslam::app
