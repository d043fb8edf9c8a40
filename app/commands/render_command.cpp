#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <optional>
#include <string>
#include <vector>

#include "app/cluster/array_work.h"
#include "app/commands/commands.h"
#include "app/commands/render_arguments.h"
#include "app/result/map_input.h"
#include "app/terminal/terminal.h"
#include "render/figures/map_page.h"
#include "render/picture/photo.h"
#include "render/video/video_alignment.h"
#include "slam/io/image_files.h"
#include "slam/snapshot/recording.h"
#include "slam/util/json_file.h"
#include "slam/util/throw_if.h"

namespace sqslam::app {
namespace fs = std::filesystem;
namespace {

// Writes picture, reference and difference side by side to NAME-difference.png beside the picture, or in the
// working folder if no picture is written.
fs::path WriteDifference(const RenderArguments& a, const cv::Mat& image, const cv::Mat& reference) {
  cv::Mat apart;
  cv::absdiff(image, reference, apart);
  if (apart.channels() == 4) {  // opaque, or the difference would be invisible
    apart.forEach<cv::Vec4b>([](cv::Vec4b& pixel, const int*) { pixel[3] = 255; });
  }
  cv::Mat side_by_side;
  cv::hconcat(std::vector<cv::Mat>{image, reference, apart}, side_by_side);
  const fs::path output = a.output;
  const fs::path path = a.output.empty()
                            ? fs::path(fs::path(a.reference).stem().string() + "-difference.png")
                            : output.parent_path() / (output.stem().string() + "-difference.png");
  WritePicture(path, side_by_side);
  return path;
}

int CompareWithReference(const RenderArguments& a, const cv::Mat& image) {
  const cv::Mat reference = ReadImage(a.reference, cv::IMREAD_UNCHANGED);
  ThrowIf<InputError>(reference.empty(), "{}: cannot be read, expected the reference picture", a.reference);
  if (image.size() != reference.size() || image.type() != reference.type()) {
    PrintNotice(fmt::format(
        "sqslam: {}: {}x{} with {} channels, expected {}x{} with {} as the picture has{}", a.reference,
        reference.cols, reference.rows, reference.channels(), image.cols, image.rows, image.channels(),
        image.size() == reference.size()
            ? ""
            : fmt::format("; --resolution {},{} draws it in that size", reference.cols, reference.rows)));
    return 5;
  }
  const double difference = PictureDifference(image, reference);
  const bool same = difference <= a.threshold;
  if (same) {
    fmt::print("differs from {} by {:.4f}, within {}\n", a.reference, difference, a.threshold);
    return 0;
  }
  PrintNotice(
      fmt::format("sqslam: differs from {} by {:.4f}, more than {}; picture, reference and difference: {}",
                  a.reference, difference, a.threshold, WriteDifference(a, image, reference).string()));
  return 5;
}

// Returns the map as of --at-frame in the frame of the finished one, or the finished one.
MapSnapshot MapAtFrame(const RenderArguments& a, const RecordingReader& reader) {
  const MapSnapshotPtr last = reader.Last();
  if (!a.at_frame) {
    return *last;
  }
  int snapshot = -1;
  while (snapshot + 1 < reader.Size() && reader.FrameIndex(snapshot + 1) <= *a.at_frame) {
    ++snapshot;
  }
  ThrowIf<UsageError>(snapshot < 0, "--at-frame {}: there was no map yet, expected {} or more", *a.at_frame,
                      reader.FrameIndex(0));
  const MapSnapshotPtr read = reader.Read(snapshot);
  MapSnapshot map = Transformed(AlignByKeyframes(*read, *last), *read);
  if (map.frame_index != *a.at_frame) {
    try {
      map.T_map_camera = InputFrames(reader, MapFile(a.map)).PoseOf(*a.at_frame);
    } catch (const UsageError&) {  // tracking was lost
      map.T_map_camera.reset();
    }
  }
  return map;
}

// Renders the map as the input camera saw it in one frame; with --overlay or --photo over its image.
cv::Mat RenderCameraFrame(const RenderArguments& a, PictureOptions options, const RecordingReader& reader) {
  InputFrames frames(reader, MapFile(a.map));
  const MapSnapshot map = MapAtFrame(a, reader);
  Rigid3d pose;
  try {
    pose =
        a.at_frame == a.camera_frame && map.T_map_camera ? *map.T_map_camera : frames.PoseOf(*a.camera_frame);
  } catch (const UsageError& error) {
    throw UsageError("--camera-frame: {}", error.what());
  }
  if (a.overlay) {
    return RenderOverPhoto(map, frames.ImageOf(*a.camera_frame), pose, options);
  }
  if (a.photo) {
    return RenderOnPhoto(*reader.Last(), map, frames.ImageOf(*a.camera_frame), pose, options);
  }
  const bool cameras_wanted = std::ranges::any_of(
      a.style.settings, [](const std::string& setting) { return setting.starts_with("cameras."); });
  if (!cameras_wanted) {  // frusta around the eye would cover everything
    options.style.cameras.trajectory = options.style.cameras.keyframes = options.style.cameras.current =
        false;
  }
  PictureRenderer renderer(options);
  renderer.SetMap(*reader.Last());
  renderer.SetMapKeepingFrame(map);
  const ImagePlacement place = PlaceImage(map.camera, {0, 0, options.width, options.height});
  return renderer.Render(ThroughCamera(pose, place.camera));
}

// Renders the map as of --at-frame with the framing and colours of the finished one.
cv::Mat RenderAtFrame(const RenderArguments& a, const PictureOptions& options,
                      const RecordingReader& reader) {
  PictureRenderer renderer(options);
  renderer.SetMap(*reader.Last());
  renderer.SetMapKeepingFrame(MapAtFrame(a, reader));
  return renderer.Render();
}

int RenderStill(const RenderArguments& a, const PictureOptions& options, const RecordingReader& reader) {
  if (MakesPage(a)) {
    if (!a.font.empty()) {
      UseFont(a.font);
    }
    WriteFigure(DrawMapPage(*reader.Last(), MapAtFrame(a, reader), options), a.output);
    return 0;
  }
  const cv::Mat image = a.camera_frame ? RenderCameraFrame(a, options, reader)
                        : a.at_frame   ? RenderAtFrame(a, options, reader)
                                       : RenderPicture(*reader.Last(), options);
  if (!a.output.empty()) {
    WritePicture(a.output, image);
  }
  return a.reference.empty() ? 0 : CompareWithReference(a, image);
}

// Writes frames to a file by write(progress), which returns their number. Returns the exit code.
int WriteFrames(const RenderArguments& a, const fs::path& output, auto&& write) {
  StoppableProgress progress(a.quiet);
  int total = 0;
  const int written = write([&](int done, int of) { return progress(done, total = of); });
  progress.Finish();
  if (!progress.interrupt.Interrupted() || written >= total) {
    return 0;
  }
  PrintNotice(fmt::format("sqslam: interrupted; {} of {} frames are in {}", written, total, output.string()));
  return 130;
}

int RenderFrames(const RenderArguments& a, const PictureOptions& picture, const RecordingReader& reader) {
  constexpr double kGifFps = 12.5;  // a picture that plays by itself should stay small; whole hundredths
  VideoOptions options =
      MakeVideoOptions(a, picture, fs::path(a.output).extension() == ".gif" ? kGifFps : 30.0);
  std::optional<InputFrames> frames;
  options.frame_poses = [&](std::int64_t frame) {
    if (!frames) {
      frames.emplace(reader, MapFile(a.map));
    }
    return frames->PoseOf(frame);
  };
  const fs::path output = IsFrameTemplate(a.output) ? fs::path(a.output) : PartName(a.output, options.shard);
  return WriteFrames(a, output, [&](const VideoProgress& progress) {
    return a.growth ? WriteGrowthVideo(reader, options, output, progress)
                    : WriteOrbit(*reader.Last(), options, output, progress);
  });
}

int JoinPieces(const RenderArguments& a) {
  return WriteFrames(a, a.output, [&](const VideoProgress& progress) {
    return JoinVideo(a.join, a.output, a.fps.value_or(30.0), progress);
  });
}

int RenderHere(const RenderArguments& a) {
  if (!a.join.empty()) {
    return JoinPieces(a);
  }
  PictureOptions options = MakePictureOptions(a);
  const RecordingReader reader = OpenMap(MapFile(a.map), a.objects, HiddenObjects::kLeaveOut);
  if (a.camera_frame && !a.resolution) {
    const Camera camera = reader.Last()->camera;
    options.width = camera.width;
    options.height = camera.height;
  }
  options.layers = ReadLayers(a.layers, reader, MapFile(a.map), options.style, a.growth || a.at_frame);
  return MakesFrames(a) ? RenderFrames(a, options, reader) : RenderStill(a, options, reader);
}

// Returns everything that the content of a video's pieces depends on.
std::string SettingsOfPieces(const RenderArguments& a) {
  std::vector<std::string> words = ArgumentsWithoutTask();
  std::erase_if(words, [](const std::string& word) {
    return word == "--submit-only" || word == "--quiet" || word == "-q";
  });
  const fs::path map = MapFile(a.map);
  return JsonText(nlohmann::ordered_json{{"arguments", words},
                                         {"map_bytes", fs::file_size(map)},
                                         {"map_time", fs::last_write_time(map).time_since_epoch().count()},
                                         {"files", FilesFingerprint(a)}});
}

int RenderOnSlurm(const RenderArguments& a) {
  const auto make = [&](const Shard& shard, const fs::path& piece, int) {
    RenderArguments part = a;
    part.shard = fmt::format("{}/{}", shard.index, shard.count);
    part.output = piece.parent_path() / fs::path(a.output).filename();  // RenderFrames adds the shard
    return RenderHere(part);
  };
  std::string begun;
  const auto settings = [&] { return begun = SettingsOfPieces(a); };
  const auto join = [&](const std::vector<std::string>& pieces, int) {
    ThrowIf<InputError>(SettingsOfPieces(a) != begun,
                        "{}: a file that it is drawn from has changed while the pieces were made, "
                        "expected the same map, style and files throughout; run the command again",
                        a.output);
    RenderArguments all = a;
    all.join = pieces;
    return JoinPieces(all);
  };
  return DoOnSlurm({fs::path(a.output).stem().string(), a.output, settings, make, join}, a.cluster, a.quiet);
}

int Render(const RenderArguments& a) {
  CheckRenderArguments(a);
  CreateFolderOf(a.output);
  return a.cluster.OnSlurm() ? RenderOnSlurm(a) : RenderHere(a);
}

constexpr const char* kRenderNotes = R"(
By default the view shows the objects and their surroundings; the --camera options change it, angles in degrees.
Styles are in configs/styles. --set overrides a value of the style (objects.opacity=0.5, objects.labels=true,
points.size=3, cameras.keyframes=false, grid.show=false, text.legend=false, anti_aliasing=fxaa,
video_anti_aliasing=ssaa, objects.colors.cup=#0072b2, ...). covisibility.show=true draws lines between keyframes that share at least
covisibility.min_points map points. clip.axis=x, y, z or view cuts points, objects and dense cloud above a plane
along that axis (view: nearer to the camera); clip.offset moves the plane from the centre of the scene (1: by its
radius), clip.flip=true cuts the other side.

The dense cloud of sqslam run or densify is drawn with the map, and the objects then look like glass. dense_cloud.show=false
omits it; dense_cloud.look=mesh draws the surface fused from the depth maps instead, in an unfinished map the part
seen so far; dense_cloud.points=true adds the map points. objects.look (solid, glass, outline, parts),
objects.glass, objects.line, objects.line_width, dense_cloud.size and dense_cloud.detail change the look.

Views are named as seen from the average camera position, which is the front; top looks straight down with the
front at the bottom. With --projection orthographic, top is a plan: it is turned until the longest wall, or the path, lies
along the picture. overlay.width, overlay.fill, overlay.hidden, overlay.labels and overlay.points configure
--overlay.

After Ctrl-C a video ends with the last frame drawn. --join does not re-encode pieces of a video: it makes the same
file as a video that is drawn at once. With --on slurm, tasks render the pieces to FILE.pieces, and the command joins
them at the end; after Ctrl-C, run the same command to wait for them again.

Examples:
  sqslam render out/kitchen -o kitchen.png
  sqslam render out/kitchen -o figure.png --no-background --resolution 2400,1600 --set objects.labels=true
  sqslam render out/kitchen -o figure.pdf --set objects.labels=true      silhouettes and texts as vectors
  sqslam render out/kitchen -o turn.gif --resolution 640,360 --seconds 6
  sqslam render out/kitchen -o plan.png --view top --projection orthographic
  sqslam render out/kitchen -o tidy.png --edits auto --set objects.labels=true
  sqslam render out/kitchen -o early.png --at-frame 120
  sqslam render out/kitchen -o seen.png --camera-frame 240 --overlay
  sqslam render out/kitchen -o paths.png --view top --ground-truth auto --set covisibility.show=true
  sqslam render out/kitchen -o dense.png --dense-cloud room.ply --dense-cloud-frame world
  sqslam render out/kitchen -o section.png --set clip.axis=z --set clip.offset=0.1
  sqslam render out/kitchen -o turn.mp4 --camera-path orbit
  sqslam render out/kitchen -o tour.mp4 --camera-path configs/camera_paths/tour.yaml
  sqslam render out/kitchen -o growth.mp4 --growth --set dense_cloud.look=mesh
  sqslam render out/kitchen -o 'frames/{frame:04}.png' --growth --frames 0:30
  sqslam render out/kitchen -o growth.mp4 --growth --on slurm --shards 8
  sqslam render --join growth.part-*-of-8.mp4 -o growth.mp4
  sqslam render out/kitchen --reference kitchen.png --reference-threshold 0.04
)";

}  // namespace

void AddRenderCommand(Command& program) {
  const auto [command, a] = program.AddCommand(
      "render", "Draw a map as a picture, numbered pictures or a video", kRenderNotes, Render);
  AddRenderOptions(command, a);
}

}  // namespace sqslam::app
