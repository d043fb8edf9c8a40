#include "render/video/video.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "render/camera/camera_path.h"
#include "render/camera/scene_framing.h"
#include "render/picture/photo.h"
#include "render/picture/picture_overlay.h"
#include "render/picture/picture_text.h"
#include "render/video/video_alignment.h"
#include "render/video/video_encoder.h"
#include "slam/util/throw_if.h"
#include "slam/util/to_vector.h"
#include "slam/util/worker_thread.h"

namespace sqslam {
namespace {

// Layout of a frame of a growth video, pixels. All sides are even.
struct GrowthLayout {
  cv::Size frame;
  cv::Rect image;  // the input image; empty: not shown
  cv::Rect view;   // the map
  cv::Rect timeline;
  double scale = 1.0;  // pixels per pixel of the style
};

int Even(double value) { return 2 * static_cast<int>(std::lround(0.5 * value)); }

GrowthLayout LayOut(cv::Size frame, bool show_image, const Camera& camera) {
  GrowthLayout layout;
  layout.frame = frame;
  layout.scale = PictureScale(frame);
  const int margin = Even(16.0 * layout.scale);
  const int bar = Even(46.0 * layout.scale);
  layout.timeline = {margin, frame.height - bar, frame.width - 2 * margin, bar};
  const int top = frame.height - bar;
  int left = 0;
  if (show_image && camera.width > 0 && camera.height > 0) {
    const double aspect = static_cast<double>(camera.width) / camera.height;
    const int width = Even(std::min(0.4 * frame.width, (top - 2.0 * margin) * aspect));
    const int height = Even(width / aspect);
    layout.image = {margin, margin, width, std::min(height, top - 2 * margin)};
    layout.image.y = std::max(margin, (top - layout.image.height) / 2);
    left = Even(margin + width);
  }
  layout.view = {left, 0, frame.width - left, top};
  return layout;
}

// Times on the timeline, in seconds of the run.
struct GrowthTimes {
  double start = 0.0;             // first snapshot
  double end = 0.0;               // last snapshot
  std::vector<double> keyframes;  // of the finished map
};

// Composes a frame: the view of the map, the input image with boxes and outlines of the objects, timeline and
// counts. Caches what is equal in consecutive frames. Not thread-safe.
class GrowthPage {
 public:
  GrowthPage(const GrowthLayout& layout, const SceneStyle& style, const LabelColors& colors,
             GrowthTimes times, InputImages images)
      : layout_(layout),
        style_(style),
        colors_(colors),
        times_(std::move(times)),
        images_(std::move(images)) {}

  cv::Mat Compose(const cv::Mat& view, const MapSnapshotPtr& map);

 private:
  cv::Mat DrawImage(const MapSnapshot& map);
  void DrawObjects(cv::Mat& part, const cv::Mat& image, const MapSnapshot& map) const;
  void DrawBoxes(cv::Mat& part, const cv::Mat& image, const MapSnapshot& map) const;
  void DrawTimeline(cv::Mat& page, const MapSnapshot& map) const;

  GrowthLayout layout_;
  SceneStyle style_;
  LabelColors colors_;
  GrowthTimes times_;
  InputImages images_;
  TextPainter text_;
  MapSnapshotPtr shown_;  // the map whose image was drawn last
  cv::Mat image_;
};

cv::Mat GrowthPage::Compose(const cv::Mat& view, const MapSnapshotPtr& map) {
  cv::Mat page(layout_.frame, CV_8UC3, ToBgr(ParseColor(style_.background)));
  view.copyTo(page(layout_.view));
  if (!layout_.image.empty()) {
    if (shown_ != map) {
      image_ = DrawImage(*map);
      shown_ = map;
    }
    image_.copyTo(page(layout_.image));
  }
  DrawTimeline(page, *map);
  return page;
}

cv::Mat GrowthPage::DrawImage(const MapSnapshot& map) {
  const Eigen::Vector3d ink = ParseColor(style_.text.color);
  const Eigen::Vector3d paper = ParseColor(style_.background);
  const cv::Mat image = images_.Read(map);
  cv::Mat part(layout_.image.size(), CV_8UC3);
  if (image.empty()) {
    part.setTo(ToBgr(0.92 * paper + 0.08 * ink));
    text_.Draw(part, "image not found", {part.cols / 2, part.rows / 2}, style_.text.size * layout_.scale,
               0.5 * ink + 0.5 * paper, TextPainter::Align::kCenter);
    return part;
  }
  cv::resize(image, part, part.size(), 0.0, 0.0, image.cols > part.cols ? cv::INTER_AREA : cv::INTER_LINEAR);
  DrawObjects(part, image, map);
  DrawBoxes(part, image, map);
  return part;
}

// Draws outlines with lens distortion.
void GrowthPage::DrawObjects(cv::Mat& part, const cv::Mat& image, const MapSnapshot& map) const {
  if (!map.T_map_camera || image.cols != map.camera.width || image.rows != map.camera.height) {
    return;
  }
  const ImagePlacement place = PlaceImage(map.camera, {cv::Point(), part.size()});
  std::vector<ObjectOutline> outlines = OutlinesOf(map.objects, place.camera, *map.T_map_camera);
  DrawOutlines(part, outlines, colors_, style_.overlay, 0.8 * layout_.scale);
}

void GrowthPage::DrawBoxes(cv::Mat& part, const cv::Mat& image, const MapSnapshot& map) const {
  std::map<int, const SnapshotObject*> objects;
  for (const SnapshotObject& object : map.objects) {
    objects[object.id] = &object;
  }
  const double sx = static_cast<double>(part.cols) / image.cols;
  const double sy = static_cast<double>(part.rows) / image.rows;
  const double size = 0.72 * style_.text.size * layout_.scale;
  for (const SnapshotDetection& seen : map.detections) {
    const auto found = objects.find(seen.object_id);
    const bool mapped = found != objects.end();
    const Eigen::Vector3d color = colors_(mapped ? found->second->label : seen.detection.label);
    const Box2d& box = seen.detection.box;
    const cv::Rect area(cv::Point(cvRound(box.x * sx), cvRound(box.y * sy)),
                        cv::Point(cvRound((box.x + box.width) * sx), cvRound((box.y + box.height) * sy)));
    DrawFrame(part, area, layout_.scale, color, mapped ? 1.0 : 0.7);
    if (mapped) {  // boxes that belong to no object of the map get no name
      const cv::Size tag = TagSize(ShownName(*found->second), text_, size);
      DrawTag(part, ShownName(*found->second),
              {std::clamp(area.x, 0, std::max(0, part.cols - tag.width)), std::max(0, area.y - tag.height)},
              color, text_, size);
    }
  }
}

void GrowthPage::DrawTimeline(cv::Mat& page, const MapSnapshot& map) const {
  const Eigen::Vector3d ink = ParseColor(style_.text.color);
  const Eigen::Vector3d paper = ParseColor(style_.background);
  const Eigen::Vector3d played = ParseColor(style_.cameras.current_color);
  const double size = 0.9 * style_.text.size * layout_.scale;
  const cv::Rect& area = layout_.timeline;
  const int thick = std::max(2, static_cast<int>(std::lround(4.0 * layout_.scale)));
  const cv::Rect track(area.x, area.y + thick, area.width, thick);
  const auto at = [&](double timestamp) {
    const double share = (timestamp - times_.start) / std::max(times_.end - times_.start, 1e-9);
    return static_cast<int>(std::lround(track.width * std::clamp(share, 0.0, 1.0)));
  };
  const int done = at(map.timestamp);
  DrawPanel(page, track, 0.5 * thick, 0.85 * paper + 0.15 * ink);
  DrawPanel(page, {track.x, track.y, done, thick}, 0.5 * thick, played);
  const int tick = std::max(1, static_cast<int>(std::lround(1.5 * layout_.scale)));
  for (const double timestamp : times_.keyframes) {
    const int x = at(timestamp);
    const cv::Rect mark(track.x + std::min(x, track.width - tick), track.y - thick, tick, thick);
    DrawPanel(page, mark, 0.0,
              timestamp <= map.timestamp ? played : Eigen::Vector3d(0.7 * paper + 0.3 * ink));
  }
  const int y = area.y + 2 * thick + static_cast<int>(1.1 * size);
  const std::string when = fmt::format("{:.1f} s   frame {}", map.timestamp - times_.start, map.frame_index);
  const std::string counts =
      fmt::format("{} keyframes   {} points   {} object{}", map.keyframes.size(), map.points.size(),
                  map.objects.size(), map.objects.size() == 1 ? "" : "s");
  text_.Draw(page, when, {area.x, y}, size, ink);
  text_.Draw(page, counts, {area.br().x, y}, size, ink, TextPainter::Align::kRight);
}

// Returns the frames to write: [first, second). Pieces of a video are whole segments, numbered pictures need
// no such cuts.
std::pair<int, int> RangeOf(const VideoOptions& options, int total, const std::filesystem::path& output) {
  const int last = options.end < 0 ? total : std::min(options.end, total);
  ThrowIf<UsageError>(options.first < 0 || options.first >= last,
                      "frames {}:{}: nothing to write, expected a range within the {} frames", options.first,
                      options.end < 0 ? std::string() : std::to_string(options.end), total);
  const int segment = IsFrameTemplate(output.string()) ? 1 : SegmentFrames(options.fps);
  const int frames = last - options.first;
  const auto [first, end] = ItemsOf(options.shard, options.first, last, segment);
  ThrowIf<UsageError>(
      first >= end,
      "--shard {}/{}: nothing to write, expected at most {} pieces for {} frames, cut every {} frames",
      options.shard.index, options.shard.count, (frames + segment - 1) / segment, frames, segment);
  return {first, end};
}

// Returns the views along the given poses.
std::vector<ViewCamera> PathAlong(const std::vector<Rigid3d>& poses, CameraPath path, const Camera& camera,
                                  const PictureRenderer& renderer) {
  std::vector<ViewCamera> views = ToVector(poses, [&](const Rigid3d& pose) {
    return path == CameraPath::kFirstPerson
               ? FirstPerson(pose, camera, renderer.Focus().radius)
               : Behind(pose, renderer.Focus().up, 0.6 * renderer.Focus().radius);
  });
  return path == CameraPath::kFollow ? Smooth(views, 4.0) : views;
}

// Returns the views of a video's frames, in the map frame of `map`. `turn` makes a path about the vertical;
// `poses` returns the input camera's poses, for paths that follow it.
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
    case CameraPath::kOrbit: {
      const CameraOverrides& wanted = options.picture.camera;
      const Eigen::Vector3d up = wanted.view_up.value_or(renderer.Focus().up);
      ViewCamera view = renderer.ViewOf(wanted, false);
      if (!wanted.position && !wanted.focal_point) {
        const double aspect = static_cast<double>(picture.width) / picture.height;
        const ViewCamera whole = Zoom(view, 1.0 / wanted.zoom);
        view = Zoom(view,
                    whole.Distance() / DistanceForAll(turn(whole, 24, up), renderer.Focus().outline, aspect));
      }
      return turn(view, frames, up);
    }
    default:
      return PathAlong(poses(), options.path, map.camera, renderer);
  }
}

// State of the map that a frame of a growth video shows, and the share of the way to it from the one before.
struct GrowthMoment {
  int snapshot = 0;
  double share = 1.0;
};

// Returns the moments of a growth video's frames, in step with the run: the newest state at their time, which
// has come within half a second or by the time of the next.
std::vector<GrowthMoment> MomentsOf(const RecordingReader& recording, const VideoOptions& options) {
  constexpr double kMotion = 0.5;  // seconds of the video, at most
  std::vector<double> times;
  for (int i = 0; i < recording.Size(); ++i) {
    times.push_back(recording.Timestamp(i));
  }
  const double whole = times.back() - times.front();
  const int total = std::max(recording.Size(),
                             static_cast<int>(std::lround(std::min(whole, options.seconds) * options.fps)));
  const double run_per_video = std::max(1.0, whole / options.seconds);  // seconds
  std::vector<GrowthMoment> moments;
  for (int frame = 0; frame < total; ++frame) {
    const double part = total > 1 ? static_cast<double>(frame) / (total - 1) : 1.0;
    const double moment = times.front() + part * whole;
    const auto next = std::upper_bound(times.begin(), times.end(), moment + 1e-9);
    const auto newest = next == times.begin() ? next : std::prev(next);
    const double gap = next == times.end() ? 0.0 : *next - *newest;
    const double motion = std::min(gap, kMotion * run_per_video);
    moments.push_back({static_cast<int>(newest - times.begin()),
                       motion > 0.0 ? std::clamp((moment - *newest) / motion, 0.0, 1.0) : 1.0});
  }
  moments.back() = {recording.Size() - 1, 1.0};
  return moments;
}

// Returns the input camera's pose at each frame, in the map frame of the last snapshot. While tracking is
// lost, the previous pose stays; before the first one, that one.
std::vector<Rigid3d> PosesOfGrowth(const RecordingReader& recording, const std::vector<GrowthMoment>& moments,
                                   const MapSnapshot& last) {
  std::map<int, Rigid3d> tracked;  // by snapshot
  for (int i = 0; i < recording.Size(); ++i) {
    const MapSnapshotPtr map = recording.Read(i);
    if (map->T_map_camera) {
      tracked[i] = AlignByKeyframes(*map, last) * *map->T_map_camera;
    }
  }
  std::vector<Rigid3d> poses;
  for (const GrowthMoment& moment : moments) {
    const auto next = tracked.upper_bound(moment.snapshot);
    poses.push_back(tracked.empty() ? Rigid3d{} : (next == tracked.begin() ? next : std::prev(next))->second);
  }
  return poses;
}

// Applies the style's anti-aliasing for videos, unless the output is numbered pictures.
PictureOptions PicturesFor(const std::filesystem::path& output, PictureOptions picture) {
  if (!IsFrameTemplate(output.string())) {
    picture.style.anti_aliasing = picture.style.video_anti_aliasing;
  }
  return picture;
}

GrowthTimes TimesOf(const RecordingReader& recording, const MapSnapshot& last) {
  GrowthTimes times{recording.Timestamp(0), last.timestamp, {}};
  for (const SnapshotKeyframe& keyframe : last.keyframes) {
    times.keyframes.push_back(keyframe.timestamp);
  }
  return times;
}

// Draws the frames of a range until `progress` returns false. Returns the number of frames drawn.
template <typename DrawFrame>
int DrawFrames(const std::pair<int, int>& range, const VideoProgress& progress, const DrawFrame& draw) {
  int done = 0;
  for (bool go_on = true; go_on && range.first + done < range.second;) {
    draw(range.first + done++);
    go_on = !progress || progress(done, range.second - range.first);
  }
  return done;
}

// The states of a recording in the frame of the last one, each read once while they are asked for in order.
class StatesOfGrowth {
 public:
  StatesOfGrowth(const RecordingReader& recording, const MapSnapshot& last)
      : recording_(recording), last_(last) {}

  // Returns the state before and this one; the first one is both.
  const std::pair<MapSnapshotPtr, MapSnapshotPtr>& At(int snapshot) {
    if (snapshot != number_) {
      const bool next = snapshot == number_ + 1 && states_.second;
      states_.first = next ? states_.second : snapshot > 0 ? Read(snapshot - 1) : nullptr;
      states_.second = Read(snapshot);
      states_.first = states_.first ? states_.first : states_.second;
      number_ = snapshot;
    }
    return states_;
  }

 private:
  MapSnapshotPtr Read(int snapshot) const {
    const MapSnapshotPtr read = recording_.Read(snapshot);
    return std::make_shared<const MapSnapshot>(Transformed(AlignByKeyframes(*read, last_), *read));
  }

  const RecordingReader& recording_;
  const MapSnapshot& last_;
  int number_ = -1;
  std::pair<MapSnapshotPtr, MapSnapshotPtr> states_;
};

// A frame of a growth video to compose.
struct ComposerJob {
  cv::Mat view;
  MapSnapshotPtr map;
  int number;
};

}  // namespace

int WriteOrbit(const MapSnapshot& map, const VideoOptions& options, const std::filesystem::path& output,
               const VideoProgress& progress) {
  ThrowIf<UsageError>(options.picture.transparent && !IsFrameTemplate(output.string()),
                      "{}: a video has no transparency, expected a name with {{frame:04}} that ends in .png "
                      "with --no-background",
                      output.string());
  const double seconds =
      options.path_file ? options.path_file->Length().value_or(options.seconds) : options.seconds;
  // A path from a file ends at its last key, unless it is a loop.
  const int last = options.path_file && !options.path_file->loop ? 1 : 0;
  const int total = last + std::max(1, static_cast<int>(std::lround(seconds * options.fps)));
  const std::pair<int, int> range = RangeOf(options, total, output);
  FrameWriter writer(output, {options.picture.width, options.picture.height}, options.fps);
  PictureRenderer renderer(PicturesFor(output, options.picture));
  renderer.SetMap(map);
  const auto poses = [&] {
    ThrowIf<UsageError>(map.keyframes.empty(),
                        "this map has no keyframes to move along, expected --camera-path still or orbit");
    return PosesAlongKeyframes(map, total);
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
  ThrowIf<UsageError>(options.picture.transparent,
                      "--no-background: does not apply to --growth, expected only one of them");
  const MapSnapshotPtr last = recording.Last();
  const std::vector<GrowthMoment> moments = MomentsOf(recording, options);
  const int total = static_cast<int>(moments.size());
  const std::pair<int, int> range = RangeOf(options, total, output);
  const cv::Size size(options.picture.width, options.picture.height);
  FrameWriter writer(output, size, options.fps);
  const GrowthLayout layout = LayOut(size, options.show_image, last->camera);
  PictureOptions view = PicturesFor(output, options.picture);
  view.width = layout.view.width;
  view.height = layout.view.height;
  PictureRenderer renderer(view);
  renderer.SetMap(*last);
  const auto swing = [](const auto&... middle) { return SwingPath(middle...); };
  const std::vector<ViewCamera> views = ViewsOf(*last, options, view, total, renderer, swing,
                                                [&] { return PosesOfGrowth(recording, moments, *last); });
  // A page is composed while the next view is drawn and the previous page is encoded.
  GrowthPage page(layout, view.style, renderer.Colors(), TimesOf(recording, *last), InputImages(recording));
  WorkerThread<ComposerJob> composer(3, [&page, &writer](const ComposerJob& job) {
    writer.Add(page.Compose(job.view, job.map), job.number);
  });
  StatesOfGrowth states(recording, *last);
  MapSnapshotPtr map;
  double shown = 0.0;  // share of the way to `map`
  const int done = DrawFrames(range, progress, [&](int i) {
    const GrowthMoment& moment = moments[static_cast<std::size_t>(i)];
    const auto& [before, now] = states.At(moment.snapshot);
    if (now != map || shown != moment.share) {
      renderer.SetMapKeepingFrame(moment.share < 1.0 ? Between(*before, *now, moment.share) : *now);
      map = now;
      shown = moment.share;
    }
    composer.Add({renderer.Render(views[static_cast<std::size_t>(i)]), map, i});
  });
  composer.Finish();
  writer.Close();
  return done;
}

}  // namespace sqslam
