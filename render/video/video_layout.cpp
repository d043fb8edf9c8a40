#include "render/video/video_layout.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "render/picture/outlines.h"
#include "slam/io/image_files.h"

namespace sqslam {
namespace {

int Even(double value) { return 2 * static_cast<int>(std::lround(0.5 * value)); }

}  // namespace

GrowthLayout LayOut(cv::Size frame, bool show_image, const Camera& camera) {
  GrowthLayout layout;
  layout.frame = frame;
  layout.scale = std::min(frame.height / 720.0, frame.width / 960.0);
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

GrowthPage::GrowthPage(const GrowthLayout& layout, const SceneStyle& style, const LabelColors& colors,
                       GrowthTimes times)
    : layout_(layout), style_(style), colors_(colors), times_(std::move(times)) {}

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

cv::Mat GrowthPage::DrawImage(const MapSnapshot& map) const {
  const Eigen::Vector3d ink = ParseColor(style_.text.color);
  const Eigen::Vector3d paper = ParseColor(style_.background);
  const cv::Mat image = map.image_path.empty()
                            ? cv::Mat()
                            : ReadImageInSize(map.image_path, {map.camera.width, map.camera.height});
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

// The outlines where the lens shows the objects.
void GrowthPage::DrawObjects(cv::Mat& part, const cv::Mat& image, const MapSnapshot& map) const {
  if (!map.T_map_camera || image.cols != map.camera.width || image.rows != map.camera.height) {
    return;
  }
  const ImagePlacement place = PlaceImage(map.camera, {cv::Point(), part.size()});
  std::vector<ObjectOutline> outlines = OutlinesOf(map.objects, place.camera, *map.T_map_camera);
  DrawOutlines(part, outlines, colors_, style_.overlay, 0.8 * layout_.scale);
}

void GrowthPage::DrawBoxes(cv::Mat& part, const cv::Mat& image, const MapSnapshot& map) const {
  std::map<int, std::string> labels;
  for (const SnapshotObject& object : map.objects) {
    labels[object.id] = object.label;
  }
  const double sx = static_cast<double>(part.cols) / image.cols;
  const double sy = static_cast<double>(part.rows) / image.rows;
  const double size = 0.72 * style_.text.size * layout_.scale;
  for (const SnapshotDetection& seen : map.detections) {
    const auto found = labels.find(seen.object_id);
    const bool mapped = found != labels.end();
    const std::string& name = mapped ? found->second : seen.detection.label;
    const Eigen::Vector3d color = colors_(name);
    const Box2d& box = seen.detection.box;
    const cv::Rect area(cv::Point(cvRound(box.x * sx), cvRound(box.y * sy)),
                        cv::Point(cvRound((box.x + box.width) * sx), cvRound((box.y + box.height) * sy)));
    DrawFrame(part, area, layout_.scale, color, mapped ? 1.0 : 0.7);
    if (mapped) {  // not yet, or no longer, part of the map: a box without a name
      const cv::Size tag = TagSize(seen.detection.label, text_, size);
      DrawTag(part, seen.detection.label,
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

}  // namespace sqslam
