#include "render/video/video.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "render/camera/camera_path.h"
#include "render/video/video_alignment.h"
#include "render/video/video_layout.h"
#include "slam/util/error.h"
#include "slam/util/worker_thread.h"

namespace sqslam {
namespace {

struct FrameRange {
  int first;
  int end;
};

FrameRange RangeOf(const VideoOptions& options, int total) {
  const FrameRange range{options.first, options.end < 0 ? total : std::min(options.end, total)};
  if (range.first < 0 || range.first >= range.end) {
    throw UsageError(fmt::format("frames {}:{}: nothing to write, expected a part of the {} frames there are",
                                 options.first, options.end < 0 ? std::string() : std::to_string(options.end),
                                 total));
  }
  const auto [first, end] = FramesOf(options.shard, range.first, range.end);
  if (first >= end) {
    throw UsageError(fmt::format("--shard {}/{}: nothing to write, expected at most {} pieces for {} frames",
                                 options.shard.index, options.shard.count, range.end - range.first,
                                 range.end - range.first));
  }
  return {first, end};
}

// Views along the given poses; where a pose is missing (tracking lost), the one before stays.
std::vector<ViewCamera> PathAlong(const std::vector<Rigid3d>& poses, CameraPath path, const Camera& camera,
                                  const PictureRenderer& renderer) {
  std::vector<ViewCamera> views;
  for (const Rigid3d& pose : poses) {
    views.push_back(path == CameraPath::kFirstPerson
                        ? FirstPerson(pose, camera, renderer.SceneRadius())
                        : Behind(pose, renderer.Up(), 0.6 * renderer.SceneRadius()));
  }
  return path == CameraPath::kFollow ? Smooth(views, 4.0) : views;
}

// The axis of turntables.
Eigen::Vector3d UpOf(const VideoOptions& options, const PictureRenderer& renderer) {
  return options.picture.camera.view_up.value_or(renderer.Up());
}

std::vector<ViewCamera> PathOfMap(const MapSnapshot& map, const VideoOptions& options, int frames,
                                  const PictureRenderer& renderer) {
  if (options.path_file) {
    return ViewsAlong(*options.path_file, map, options.picture, options.frame_poses, frames, options.fps);
  }
  switch (options.path) {
    case CameraPath::kStill:
      return std::vector<ViewCamera>(static_cast<std::size_t>(frames), renderer.DefaultCamera());
    case CameraPath::kOrbit:
      return OrbitPath(renderer.DefaultCamera(), frames, UpOf(options, renderer));
    default:
      if (map.keyframes.empty()) {
        throw UsageError("this map has no keyframes to move along, expected --camera-path still or orbit");
      }
      return PathAlong(AlongKeyframes(map, frames), options.path, map.camera, renderer);
  }
}

// The snapshot that each frame of a growth video shows: the newest of its moment, so that the video keeps the
// run's time.
std::vector<int> SnapshotOfFrame(const RecordingReader& recording, const VideoOptions& options) {
  std::vector<double> times;
  for (int i = 0; i < recording.Size(); ++i) {
    times.push_back(recording.Read(i)->timestamp);
  }
  const double whole = times.back() - times.front();
  const int total = std::max(recording.Size(),
                             static_cast<int>(std::lround(std::min(whole, options.seconds) * options.fps)));
  std::vector<int> snapshots;
  for (int frame = 0; frame < total; ++frame) {
    const double share = total > 1 ? static_cast<double>(frame) / (total - 1) : 1.0;
    const double moment = times.front() + share * whole;
    const auto next = std::upper_bound(times.begin(), times.end(), moment + 1e-9);
    snapshots.push_back(std::max(0, static_cast<int>(next - times.begin()) - 1));
  }
  snapshots.back() = recording.Size() - 1;
  return snapshots;
}

// The view of each frame, in the map frame of the last snapshot.
std::vector<ViewCamera> PathOfGrowth(const RecordingReader& recording, const std::vector<int>& snapshots,
                                     const MapSnapshot& last, const VideoOptions& options,
                                     const PictureOptions& picture, const PictureRenderer& renderer) {
  if (options.path_file) {
    return ViewsAlong(*options.path_file, last, picture, options.frame_poses,
                      static_cast<int>(snapshots.size()), options.fps);
  }
  if (options.path == CameraPath::kStill) {
    return std::vector<ViewCamera>(snapshots.size(), renderer.DefaultCamera());
  }
  if (options.path == CameraPath::kOrbit) {
    return SwingPath(renderer.DefaultCamera(), static_cast<int>(snapshots.size()), UpOf(options, renderer));
  }
  std::vector<Rigid3d> of_snapshots;
  for (int i = 0; i < recording.Size(); ++i) {
    const MapSnapshotPtr map = recording.Read(i);
    const Sim3d s = AlignByKeyframes(*map, last);
    if (map->T_map_camera) {
      of_snapshots.push_back({s.rotation * map->T_map_camera->rotation, s * map->T_map_camera->translation});
    } else {
      of_snapshots.push_back(of_snapshots.empty() ? Rigid3d{} : of_snapshots.back());
    }
  }
  std::vector<Rigid3d> poses;
  for (const int snapshot : snapshots) {
    poses.push_back(of_snapshots[static_cast<std::size_t>(snapshot)]);
  }
  return PathAlong(poses, options.path, last.camera, renderer);
}

void CheckOpaque(const VideoOptions& options, const std::filesystem::path& output) {
  if (options.picture.transparent && !IsFrameTemplate(output.string())) {
    throw UsageError(
        fmt::format("{}: a video has no transparency, expected a name with {{frame:04}} that ends in "
                    ".png with --no-background",
                    output.string()));
  }
}

// Pictures of a video file are smoothed as the style says for videos.
PictureOptions PicturesFor(const std::filesystem::path& output, PictureOptions picture) {
  if (!IsFrameTemplate(output.string())) {
    picture.style.anti_aliasing = picture.style.video_anti_aliasing;
  }
  return picture;
}

GrowthTimes TimesOf(const RecordingReader& recording, const MapSnapshot& last) {
  GrowthTimes times{recording.Read(0)->timestamp, last.timestamp, {}};
  for (const SnapshotKeyframe& keyframe : last.keyframes) {
    times.keyframes.push_back(keyframe.timestamp);
  }
  return times;
}

// A page of a growth video to be put together.
struct ComposerJob {
  cv::Mat view;
  MapSnapshotPtr map;
  int number;
};

}  // namespace

int WriteOrbit(const MapSnapshot& map, const VideoOptions& options, const std::filesystem::path& output,
               const VideoProgress& progress) {
  CheckOpaque(options, output);
  const double seconds =
      options.path_file ? options.path_file->Length().value_or(options.seconds) : options.seconds;
  // A path from a file ends with its last key, unless it goes around.
  const int last = options.path_file && !options.path_file->loop ? 1 : 0;
  const int total = last + std::max(1, static_cast<int>(std::lround(seconds * options.fps)));
  const FrameRange range = RangeOf(options, total);
  FrameWriter writer(output, {options.picture.width, options.picture.height}, options.fps);
  PictureRenderer renderer(PicturesFor(output, options.picture));
  renderer.SetMap(map);
  const std::vector<ViewCamera> views = PathOfMap(map, options, total, renderer);
  int done = 0;
  for (bool go_on = true; go_on && range.first + done < range.end;) {
    const int i = range.first + done++;
    writer.Add(renderer.Render(views[static_cast<std::size_t>(i)]), i);
    go_on = !progress || progress(done, range.end - range.first);
  }
  writer.Close();
  return done;
}

int WriteGrowthVideo(const RecordingReader& recording, const VideoOptions& options,
                     const std::filesystem::path& output, const VideoProgress& progress) {
  if (options.picture.transparent) {
    throw UsageError("a video of growth has a background, expected no --no-background");
  }
  if (recording.Size() == 0) {
    throw InputError("the recording holds no snapshot, expected at least one");
  }
  const std::vector<int> snapshots = SnapshotOfFrame(recording, options);
  const FrameRange range = RangeOf(options, static_cast<int>(snapshots.size()));
  const cv::Size size(options.picture.width, options.picture.height);
  FrameWriter writer(output, size, options.fps);
  const MapSnapshotPtr last = recording.Last();
  const GrowthLayout layout = LayOut(size, options.show_image, last->camera);
  PictureOptions view = PicturesFor(output, options.picture);
  view.width = layout.view.width;
  view.height = layout.view.height;
  PictureRenderer renderer(view);
  renderer.SetMap(*last);
  const std::vector<ViewCamera> views = PathOfGrowth(recording, snapshots, *last, options, view, renderer);
  // Pages are put together while the next view is drawn and the last page encoded.
  GrowthPage page(layout, view.style, renderer.Colors(), TimesOf(recording, *last));
  WorkerThread<ComposerJob> composer(3, [&page, &writer](const ComposerJob& job) {
    writer.Add(page.Compose(job.view, job.map), job.number);
  });
  int shown = -1;
  int done = 0;
  MapSnapshotPtr map;
  for (bool go_on = true; go_on && range.first + done < range.end;) {
    const int i = range.first + done++;
    const int snapshot = snapshots[static_cast<std::size_t>(i)];
    if (snapshot != shown) {
      const MapSnapshotPtr read = recording.Read(snapshot);
      map = std::make_shared<const MapSnapshot>(Transformed(AlignByKeyframes(*read, *last), *read));
      renderer.SetMapKeepingFrame(*map);
      shown = snapshot;
    }
    composer.Add({renderer.Render(views[static_cast<std::size_t>(i)]), map, i});
    go_on = !progress || progress(done, range.end - range.first);
  }
  composer.Finish();
  writer.Close();
  return done;
}

}  // namespace sqslam
