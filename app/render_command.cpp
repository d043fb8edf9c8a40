#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <memory>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/quality/qualityssim.hpp>
#include <optional>
#include <string>
#include <vector>

#include "app/commands.h"
#include "app/interrupt.h"
#include "app/map_file.h"
#include "app/progress.h"
#include "render/video.h"
#include "slam/io/atomic_file.h"
#include "slam/io/recording.h"
#include "slam/util/error.h"
#include "slam/util/options.h"

namespace sqslam::app {
namespace fs = std::filesystem;
namespace {

struct Arguments {
  std::string map;
  std::string output;
  std::string resolution = "1280,720";
  bool no_background = false;
  std::string backend = "auto";
  std::string style = "paper";
  std::vector<std::string> settings;
  std::string position, focal_point, view_up;
  std::optional<double> view_angle;
  double azimuth = 0.0;
  double elevation = 0.0;
  double zoom = 1.0;
  std::string path;
  bool growth = false;
  std::string frames;
  std::optional<double> fps;
  double seconds = 10.0;
  std::string reference;
  double threshold = 0.04;
  bool quiet = false;
};

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

PictureOptions MakePictureOptions(const Arguments& a) {
  PictureOptions options;
  const auto size = ParseNumbers<2>("--resolution", a.resolution, "WIDTH,HEIGHT in pixels, such as 1280,720");
  for (const double side : size) {
    if (side != std::floor(side) || side < 16 || side > 8192) {
      throw UsageError(fmt::format("--resolution {}: expected whole numbers from 16 to 8192", a.resolution));
    }
  }
  options.width = static_cast<int>(size[0]);
  options.height = static_cast<int>(size[1]);
  options.transparent = a.no_background;
  options.backend = ParseRenderBackend(a.backend);
  options.style = LoadStyle(a.style);
  for (const std::string& setting : a.settings) {
    SetOption(setting, options.style);
  }
  CheckStyle(options.style);
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

CameraPath ParsePath(const std::string& name) {
  return name == "follow"         ? CameraPath::kFollow
         : name == "first-person" ? CameraPath::kFirstPerson
         : name == "still"        ? CameraPath::kStill
                                  : CameraPath::kOrbit;
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

// Compares as f3d does: size and channels first, then 1 - SSIM (the mean over the channels).
double Difference(const cv::Mat& image, const cv::Mat& reference) {
  if (image.size() != reference.size() || image.type() != reference.type()) {
    return 1.0;
  }
  const cv::Scalar similarity = cv::quality::QualitySSIM::compute(image, reference, cv::noArray());
  double sum = 0.0;
  for (int c = 0; c < image.channels(); ++c) {
    sum += similarity[c];
  }
  return 1.0 - sum / image.channels();
}

int CompareWithReference(const Arguments& a, const cv::Mat& image) {
  const cv::Mat reference = cv::imread(a.reference, cv::IMREAD_UNCHANGED);
  if (reference.empty()) {
    throw InputError(fmt::format("{}: cannot be read as a picture, expected the reference", a.reference));
  }
  if (image.size() != reference.size() || image.type() != reference.type()) {
    fmt::print(stderr, "sqslam: {}: {}x{} with {} channels, expected {}x{} with {} as the picture has\n",
               a.reference, reference.cols, reference.rows, reference.channels(), image.cols, image.rows,
               image.channels());
    return 5;
  }
  const double difference = Difference(image, reference);
  const bool same = difference <= a.threshold;
  fmt::print(same ? stdout : stderr, "{}differs from {} by {:.4f}, {} {}\n",
             same ? "" : "sqslam: ", a.reference, difference, same ? "within" : "more than", a.threshold);
  return same ? 0 : 5;
}

int RenderStill(const Arguments& a, const PictureOptions& options, const RecordingReader& reader) {
  const cv::Mat image = RenderPicture(*reader.Last(), options);
  if (!a.output.empty()) {
    std::vector<std::uint8_t> bytes;
    cv::imencode(".png", image, bytes);
    WriteFileAtomically(a.output, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  }
  return a.reference.empty() ? 0 : CompareWithReference(a, image);
}

int RenderFrames(const Arguments& a, const PictureOptions& picture, const RecordingReader& reader) {
  VideoOptions options;
  options.picture = picture;
  options.path = ParsePath(a.path);
  options.seconds = a.seconds;
  // A run of any length plays in about twenty seconds unless told otherwise.
  const double growth_fps = std::clamp(std::round(reader.Size() / 20.0), 5.0, 30.0);
  options.fps = a.fps.value_or(a.growth ? growth_fps : 30.0);
  if (!a.frames.empty()) {
    ParseFrames(a.frames, options);
  }
  const InterruptGuard interrupt;
  std::optional<Progress> progress;
  const auto report = [&](int done, int total) {
    if (!progress) {
      progress.emplace(total, a.quiet);
    }
    progress->Update(done, "");
    return !interrupt.Interrupted();
  };
  a.growth ? WriteGrowthVideo(reader, options, a.output, report)
           : WriteOrbit(*reader.Last(), options, a.output, report);
  if (progress) {
    progress->Finish();
  }
  return interrupt.Interrupted() ? 130 : 0;
}

int Render(const Arguments& a) {
  const std::string extension = fs::path(a.output).extension().string();
  const bool frames = IsFrameTemplate(a.output) || extension == ".mp4";
  if (a.output.empty() && a.reference.empty()) {
    throw UsageError("nothing to do, expected --output FILE, --reference FILE or both");
  }
  if (!frames && !a.output.empty() && extension != ".png") {
    throw UsageError(
        fmt::format("--output {}: expected FILE.png, a name with {{frame:04}} that ends in .png, or "
                    "FILE.mp4",
                    a.output));
  }
  if (frames && !a.reference.empty()) {
    throw UsageError("--reference: compares one picture, expected --output FILE.png or none");
  }
  if (!frames && (a.growth || !a.frames.empty() || (!a.path.empty() && a.path != "still"))) {
    throw UsageError(
        fmt::format("--output {}: one picture, expected FILE.mp4 or a name with {{frame:04}} for "
                    "--growth, --frames and --camera-path",
                    a.output));
  }
  const PictureOptions options = MakePictureOptions(a);
  const RecordingReader reader(MapFile(a.map));
  if (reader.Size() == 0) {
    throw InputError(fmt::format("{}: holds no snapshot, expected a map", a.map));
  }
  return frames ? RenderFrames(a, options, reader) : RenderStill(a, options, reader);
}

constexpr const char* kFooter = R"(
The view frames the objects and what is around them; the --camera options change it, angles in degrees.
Styles lie in configs/styles; --set changes one value of a style (objects.opacity=0.5, objects.labels=true,
points.size=3, cameras.keyframes=false, grid.show=false, text.legend=false, anti_aliasing=fxaa, ...).

Examples:
  sqslam render out/kitchen --output kitchen.png
  sqslam render out/kitchen --output figure.png --no-background --resolution 2400,1600 --set objects.labels=true
  sqslam render out/kitchen --output above.png --camera-elevation-angle 40 --camera-zoom-factor 1.3
  sqslam render out/kitchen --output turn.mp4 --camera-path orbit
  sqslam render out/kitchen --output growth.mp4 --growth --resolution 1280,480
  sqslam render out/kitchen --output 'frames/{frame:04}.png' --growth --frames 0:30
  sqslam render out/kitchen --reference kitchen.png --reference-threshold 0.04
)";

void AddCameraOptions(CLI::App& command, Arguments& a) {
  const char* group = "Camera";
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
  command
      .add_option("--camera-path", a.path,
                  "For videos: still, orbit (default; with --growth a slow swing), follow, first-person")
      ->check(CLI::IsMember({"still", "orbit", "follow", "first-person"}))
      ->group(group);
}

}  // namespace

void AddRenderCommand(CLI::App& app, int& exit_code) {
  const auto a = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand("render", "Draw a map: a picture, numbered pictures or a video");
  command->footer(kFooter);
  command->add_option("MAP", a->map, "map.sqmap, or the result folder that holds it")->required();
  command->add_option("--output", a->output,
                      "FILE.png, FILE.mp4, or numbered pictures by a name with {frame:04}");
  command->add_option("--resolution", a->resolution, "WIDTH,HEIGHT in pixels")->capture_default_str();
  command->add_flag("--no-background", a->no_background, "Transparent instead of the style's background");
  command->add_option("--rendering-backend", a->backend, "auto, osmesa or egl")
      ->check(CLI::IsMember({"auto", "osmesa", "egl"}))
      ->capture_default_str();
  command->add_option("--style", a->style, "A style's name (paper, dark) or FILE.yaml")
      ->capture_default_str();
  command->add_option("--set", a->settings, "KEY=VALUE of the style, repeatable")->expected(1)->take_all();
  command->add_flag("--growth", a->growth,
                    "Play the run instead of the final map, the input image beside it");
  command->add_option("--frames", a->frames, "A:B, only these frames of the output, the end excluded");
  command->add_option("--fps", a->fps, "Frames a second of a video")->check(CLI::Range(1.0, 240.0));
  command->add_option("--seconds", a->seconds, "Length of a video of the final map")
      ->check(CLI::Range(0.01, 3600.0))
      ->capture_default_str();
  command->add_option("--reference", a->reference,
                      "Compare the picture with this one; exit code 5 if it differs");
  command->add_option("--reference-threshold", a->threshold, "Largest 1 - SSIM that still passes")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  command->add_flag("--quiet", a->quiet, "No progress");
  AddCameraOptions(*command, *a);
  command->callback([a, &exit_code] { exit_code = Render(*a); });
}

}  // namespace sqslam::app
