#include "app/commands/render_arguments.h"

#include <algorithm>
#include <limits>

#include "render/camera/scene_framing.h"
#include "slam/io/frame_source.h"
#include "slam/util/data_path.h"
#include "slam/util/markup.h"
#include "slam/util/options.h"
#include "slam/util/text_lines.h"
#include "slam/util/throw_if.h"

namespace sqslam::app {
namespace fs = std::filesystem;
namespace {

bool IsPathFile(const std::string& path) {
  const std::string extension = fs::path(path).extension().string();
  return extension == ".yaml" || extension == ".yml";
}

CameraPath ParsePath(const std::string& name) {
  const std::optional<CameraPath> path = FromName<CameraPath>(name);
  ThrowIf<UsageError>(!path, "--camera-path {}: expected still, orbit, follow, first-person or FILE.yaml",
                      name);
  return *path;
}

void AddCameraOptions(Command& command, RenderArguments& a) {
  CameraOverrides& camera = a.picture.camera;
  command.Group("Camera");
  command.Option("--view NAME", camera.view, "Named view instead of the automatic one")
      .OneOf(ViewPresetNames());
  command
      .Option("--projection NAME", camera.projection,
              "orthographic: one scale at all depths, with a scale bar, as in a plan")
      .OneOf({"perspective", "orthographic"});
  command.Option("--camera-position X,Y,Z", camera.position, "Position in the map");
  command.Option("--camera-focal-point X,Y,Z", camera.focal_point, "Point in the map to look at");
  command.Option("--camera-view-up X,Y,Z", camera.view_up, "Map direction that points up in the picture");
  command.Option("--camera-view-angle DEG", camera.view_angle, "Vertical field of view").Range(1.0, 170.0);
  command.Option("--camera-azimuth-angle DEG", camera.azimuth, "Rotate around the focal point");
  command.Option("--camera-elevation-angle DEG", camera.elevation, "Raise the camera");
  command.Option("--camera-zoom-factor X", camera.zoom, "Above 1: closer").Range(0.01, 100.0);
  command.Option("--camera-frame N", a.camera_frame, "As the input camera saw frame N, with its calibration")
      .AtLeast(0);
  command.Flag("--overlay", a.overlay, "With --camera-frame: object outlines and names over the image");
  command.Flag("--photo", a.photo, "With --camera-frame: the map itself, but no cameras, over the image");
  command.Option("--camera-path PATH", a.path,
                 "For videos: still, orbit (default; with --growth a slow swing), follow, "
                 "first-person, or FILE.yaml with key frames (see configs/camera_paths/tour.yaml)");
}

void AddVideoOptions(Command& command, RenderArguments& a) {
  command.Group("Video");
  command.Flag("--growth", a.growth, "Replay the run beside its input images");
  command.Option("--frames N|A:B", a.frames, "Only the first N frames of the output, or A to B without B");
  command.Option("--fps N", a.fps, "Frames per second of a video").Range(1.0, 240.0);
  command
      .Option("--seconds S", a.seconds,
              "Length of a video, default 10; with --growth: its maximum, default 20")
      .Range(0.01, 36000.0);
  command.Option("--shard I/N", a.shard,
                 "Only piece I of N of a video, as FILE.part-I-of-N.mp4, or these numbered pictures");
  command.Option("--join FILE...", a.join, "Instead of MAP: join pieces or pictures to --output FILE.mp4")
      .Several();
}

}  // namespace

PictureOptions MakePictureOptions(const RenderArguments& a) {
  PictureOptions options = a.picture;
  if (a.resolution) {
    options.width = (*a.resolution)[0];
    options.height = (*a.resolution)[1];
  }
  options.style = a.style.Load();
  CheckStyle(options.style);
  CheckCamera(options.camera);
  return options;
}

VideoOptions MakeVideoOptions(const RenderArguments& a, const PictureOptions& picture, double fps) {
  VideoOptions options;
  options.picture = picture;
  options.seconds = a.seconds.value_or(a.growth ? kGrowthSeconds : options.seconds);
  options.fps = a.fps.value_or(fps);
  if (IsPathFile(a.path)) {
    options.path_file = ReadCameraPath(a.path, options.fps);
  } else if (!a.path.empty()) {
    options.path = ParsePath(a.path);
  }
  if (!a.frames.empty()) {
    const FrameRange range = ParseFrameRange(a.frames);
    const std::int64_t longest = std::numeric_limits<int>::max();
    options.first = static_cast<int>(std::min(range.start, longest));
    options.end = range.count > longest ? -1 : static_cast<int>(std::min(range.start + range.count, longest));
  }
  if (!a.shard.empty()) {
    options.shard = ParseShard(a.shard);
  }
  return options;
}

std::string FilesFingerprint(const RenderArguments& a) {
  std::string parts = Fingerprint(DumpOptions(a.style.Load()));
  const fs::path edits = EditsFile(MapFile(a.map), a.objects.edits);
  const fs::path path = IsPathFile(a.path) ? a.path : "";
  for (const fs::path& file : {edits, path, fs::path(a.layers.dense_cloud)}) {
    std::error_code none;
    parts += Fingerprint(fs::is_regular_file(file, none) ? ReadFile(file, "a file to draw from") : "");
  }
  return Fingerprint(parts);
}

bool MakesPage(const RenderArguments& a) {
  const fs::path extension = fs::path(a.output).extension();
  return extension == ".svg" || extension == ".pdf";
}

bool MakesFrames(const RenderArguments& a) { return IsFrameTemplate(a.output) || IsVideo(a.output); }

void CheckRenderArguments(const RenderArguments& a) {
  const bool frames = MakesFrames(a);
  a.cluster.Check();
  ThrowIf<UsageError>(a.cluster.OnSlurm() && (!a.shard.empty() || fs::path(a.output).extension() != ".mp4"),
                      "--on slurm: expected --output FILE.mp4 and no --shard");
  ParseFrameRange(a.frames);  // throws on invalid ranges before anything is read
  if (!a.join.empty()) {
    ThrowIf<UsageError>(a.cluster.OnSlurm() || fs::path(a.output).extension() != ".mp4" || !a.map.empty() ||
                            !a.objects.edits.empty(),
                        "--join: expected pieces and --output FILE.mp4, and no MAP, --edits or --on");
    return;
  }
  const bool wants_frames =
      a.growth || !a.frames.empty() || !a.shard.empty() || (!a.path.empty() && a.path != "still");
  const CameraOverrides& camera = a.picture.camera;
  const bool moved = !camera.view.empty() || camera.position || camera.focal_point || camera.view_up ||
                     camera.view_angle || camera.azimuth != 0.0 || camera.elevation != 0.0 ||
                     camera.zoom != 1.0;
  const bool orthographic = camera.projection == Projection::kOrthographic;
  const bool photo = a.overlay || a.photo;
  const std::string output = "--output " + a.output;
  const std::string over = a.overlay ? "--overlay" : "--photo";
  const std::vector<std::pair<bool, std::string>> contradictions = {
      {a.map.empty(), "render: MAP is missing, expected map.sqmap or the result folder that holds it"},
      {a.output.empty() && a.reference.empty(),
       "render: nothing to do, expected --output FILE, --reference FILE or both"},
      {MakesPage(a) && (a.camera_frame || !a.reference.empty() || !a.layers.ground_truth.empty()),
       output + ": vector graphics, expected FILE.png with --camera-frame, --reference and --ground-truth"},
      {!MakesPage(a) && !a.font.empty(),
       "--font: applies to vector graphics, expected --output FILE.svg or .pdf"},
      {!frames && !a.output.empty() && !MakesPage(a) && fs::path(a.output).extension() != ".png",
       output + ": expected FILE.png, .svg or .pdf, a name with {frame:04} that ends in .png, or FILE.mp4, "
                ".gif or .webp"},
      {frames && !a.shard.empty() && IsVideo(a.output) && fs::path(a.output).extension() != ".mp4",
       output + ": has no pieces, expected FILE.mp4 with --shard"},
      {frames && !a.reference.empty(),
       "--reference: compares one picture, expected --output FILE.png or none"},
      {!frames && wants_frames,
       output + ": one picture, expected FILE.mp4 or a name with {frame:04} for --growth, --frames, --shard "
                "and --camera-path"},
      {frames && a.camera_frame,
       "--camera-frame: makes one picture, expected --output FILE.png (for a video: --camera-path "
       "first-person)"},
      {a.camera_frame && (moved || orthographic),
       "--camera-frame: the view of a real camera, expected no --view, --projection or other --camera "
       "option"},
      {orthographic && !a.path.empty() && a.path != "still" && a.path != "orbit",
       "--projection orthographic: expected --camera-path still or orbit"},
      {a.at_frame && frames, "--at-frame: makes one picture, expected --output FILE.png"},
      {photo && !a.camera_frame, over + ": expected --camera-frame N, the frame to draw over"},
      {photo && a.picture.transparent,
       over + ": the photograph is the background, expected no --no-background"},
      {a.overlay && a.photo, "--overlay and --photo: expected outlines or the map itself, not both"}};
  for (const auto& [wrong, message] : contradictions) {
    ThrowIf<UsageError>(wrong, "{}", message);
  }
}

void StyleArguments::AddTo(Command& command) {
  command.Option("--style NAME", name,
                 "FILE.yaml, or one of configs/styles (" + ConfigNameList("configs/styles") + ")");
  command.Option("--set KEY=VALUE", settings, "Override one value of the style; may be repeated");
}

SceneStyle StyleArguments::Load(void (*adapt)(SceneStyle& style)) const {
  SceneStyle style = LoadStyle(name);
  if (adapt != nullptr) {
    adapt(style);
  }
  SetStyle(settings, style);
  CheckStyle(style);
  return style;
}

void AddBackendOption(Command& command, RenderBackend& backend) {
  command.Option("--rendering-backend NAME", backend, "Off-screen rendering library")
      .OneOf({"auto", "osmesa", "egl"});
}

void AddRenderOptions(Command& command, RenderArguments& a) {
  command.Group("Input");
  command.Positional("MAP", a.map, "map.sqmap, or the result folder that holds it");
  command.Option("--at-frame N", a.at_frame, "The map as of frame N, framed and coloured as at the end")
      .AtLeast(0);
  AddObjectOptions(command, a.objects);
  AddLayerOptions(command, a.layers);
  command.Group("Output");
  command.Option("--output,-o FILE", a.output,
                 "FILE.png, vector graphics FILE.svg or .pdf, a video FILE.mp4, .gif or .webp, or numbered "
                 "pictures {frame:04}.png");
  command.Option("--resolution W,H", a.resolution, "Size; default: 1280,720, or that of --camera-frame")
      .Range(16, 8192);
  command.Option("--font FILE", a.font,
                 "In a .svg or .pdf: font of all texts, a .ttf or .otf, which is embedded");
  command.Option("--reference FILE", a.reference, "Exit with code 5 if the picture differs from this one");
  command
      .Option("--reference-threshold X", a.threshold, "Maximum difference: 1 - SSIM where something is drawn")
      .Range(0.0, 1.0);
  command.Group("Style");
  a.style.AddTo(command);
  command.Flag("--no-background", a.picture.transparent, "Transparent background");
  AddCameraOptions(command, a);
  AddVideoOptions(command, a);
  a.cluster.AddTo(command);
  command.Group("General");
  AddBackendOption(command, a.picture.backend);
  command.QuietFlag(a.quiet, "No progress");
}

}  // namespace sqslam::app
