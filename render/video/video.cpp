#include "render/video/video.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "render/camera/camera_path.h"
#include "render/video/video_alignment.h"
#include "render/video/video_encoder.h"
#include "render/video/video_layout.h"
#include "slam/util/error.h"
#include "slam/util/worker_thread.h"

namespace sqslam {
namespace {

// The frames to write: [first, second).
std::pair<int, int> RangeOf(const VideoOptions& options, int total) {
  const int last = options.end < 0 ? total : std::min(options.end, total);
  if (options.first < 0 || options.first >= last) {
    throw UsageError(fmt::format("frames {}:{}: nothing to write, expected a part of the {} frames there are",
                                 options.first, options.end < 0 ? std::string() : std::to_string(options.end),
                                 total));
  }
  const auto [first, end] = FramesOf(options.shard, options.first, last);
  if (first >= end) {
    throw UsageError(fmt::format("--shard {}/{}: nothing to write, expected at most {} pieces for {} frames",
                                 options.shard.index, options.shard.count, last - options.first,
                                 last - options.first));
  }
  return {first, end};
}

// Views along the given poses; where a pose is missing (tracking lost), the one before stays.
std::vector<ViewCamera> PathAlong(const std::vector<Rigid3d>& poses, CameraPath path, const Camera& camera,
                                  const PictureRenderer& renderer) {
  std::vector<ViewCamera> views;
  for (const Rigid3d& pose : poses) {
    views.push_back(path == CameraPath::kFirstPerson
                        ? FirstPerson(pose, camera, renderer.Focus().radius)
                        : Behind(pose, renderer.Focus().up, 0.6 * renderer.Focus().radius));
  }
  return path == CameraPath::kFollow ? Smooth(views, 4.0) : views;
}

// The views of a video's frames, in the frame of `map`. `turn`: about the vertical; `poses`: of the input
// camera, where the path follows it.
template <typename Turn, typename Poses>
std::vector<ViewCamera> ViewsOf(const MapSnapshot& map, const VideoOptions& options,
                                const PictureOptions& picture, int frames, const PictureRenderer& renderer,
                                const Turn& turn, const Poses& poses) {
  if (options.path_file) {
    return ViewsAlong(*options.path_file, map, picture, options.frame_poses, frames, options.fps);
  }
  switch (options.path) {
    case CameraPath::kStill:
      return std::vector<ViewCamera>(static_cast<std::size_t>(frames), renderer.DefaultCamera());
    case CameraPath::kOrbit:
      return turn(renderer.DefaultCamera(), frames,
                  options.picture.camera.view_up.value_or(renderer.Focus().up));
    default:
      return PathAlong(poses(), options.path, map.camera, renderer);
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

// The poses of the input camera in the map frame of the last snapshot, one for each frame.
std::vector<Rigid3d> PosesOfGrowth(const RecordingReader& recording, const std::vector<int>& snapshots,
                                   const MapSnapshot& last) {
  std::vector<Rigid3d> of_snapshots;
  for (int i = 0; i < recording.Size(); ++i) {
    const MapSnapshotPtr map = recording.Read(i);
    of_snapshots.push_back(map->T_map_camera      ? AlignByKeyframes(*map, last) * *map->T_map_camera
                           : of_snapshots.empty() ? Rigid3d{}
                                                  : of_snapshots.back());
  }
  std::vector<Rigid3d> poses;
  for (const int snapshot : snapshots) {
    poses.push_back(of_snapshots[static_cast<std::size_t>(snapshot)]);
  }
  return poses;
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

// Returns how many frames of the range were drawn until `progress` ended it.
template <typename DrawFrame>
int DrawFrames(const std::pair<int, int>& range, const VideoProgress& progress, const DrawFrame& draw) {
  int done = 0;
  for (bool go_on = true; go_on && range.first + done < range.second;) {
    draw(range.first + done++);
    go_on = !progress || progress(done, range.second - range.first);
  }
  return done;
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
  if (options.picture.transparent && !IsFrameTemplate(output.string())) {
    throw UsageError(
        fmt::format("{}: a video has no transparency, expected a name with {{frame:04}} that ends in "
                    ".png with --no-background",
                    output.string()));
  }
  const double seconds =
      options.path_file ? options.path_file->Length().value_or(options.seconds) : options.seconds;
  // A path from a file ends with its last key, unless it goes around.
  const int last = options.path_file && !options.path_file->loop ? 1 : 0;
  const int total = last + std::max(1, static_cast<int>(std::lround(seconds * options.fps)));
  const std::pair<int, int> range = RangeOf(options, total);
  FrameWriter writer(output, {options.picture.width, options.picture.height}, options.fps);
  PictureRenderer renderer(PicturesFor(output, options.picture));
  renderer.SetMap(map);
  const auto poses = [&] {
    if (map.keyframes.empty()) {
      throw UsageError("this map has no keyframes to move along, expected --camera-path still or orbit");
    }
    return AlongKeyframes(map, total);
  };
  const std::vector<ViewCamera> views =
      ViewsOf(map, options, options.picture, total, renderer, OrbitPath, poses);
  const int done = DrawFrames(
      range, progress, [&](int i) { writer.Add(renderer.Render(views[static_cast<std::size_t>(i)]), i); });
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
  const int total = static_cast<int>(snapshots.size());
  const std::pair<int, int> range = RangeOf(options, total);
  const cv::Size size(options.picture.width, options.picture.height);
  FrameWriter writer(output, size, options.fps);
  const MapSnapshotPtr last = recording.Last();
  const GrowthLayout layout = LayOut(size, options.show_image, last->camera);
  PictureOptions view = PicturesFor(output, options.picture);
  view.width = layout.view.width;
  view.height = layout.view.height;
  PictureRenderer renderer(view);
  renderer.SetMap(*last);
  const auto swing = [](const ViewCamera& middle, int frames, const Eigen::Vector3d& up) {
    return SwingPath(middle, frames, up);
  };
  const std::vector<ViewCamera> views = ViewsOf(*last, options, view, total, renderer, swing,
                                                [&] { return PosesOfGrowth(recording, snapshots, *last); });
  // Pages are put together while the next view is drawn and the last page encoded.
  GrowthPage page(layout, view.style, renderer.Colors(), TimesOf(recording, *last));
  WorkerThread<ComposerJob> composer(3, [&page, &writer](const ComposerJob& job) {
    writer.Add(page.Compose(job.view, job.map), job.number);
  });
  int shown = -1;
  MapSnapshotPtr map;
  const int done = DrawFrames(range, progress, [&](int i) {
    const int snapshot = snapshots[static_cast<std::size_t>(i)];
    if (snapshot != shown) {
      const MapSnapshotPtr read = recording.Read(snapshot);
      map = std::make_shared<const MapSnapshot>(Transformed(AlignByKeyframes(*read, *last), *read));
      renderer.SetMapKeepingFrame(*map);
      shown = snapshot;
    }
    composer.Add({renderer.Render(views[static_cast<std::size_t>(i)]), map, i});
  });
  composer.Finish();
  writer.Close();
  return done;
}

}  // namespace sqslam
