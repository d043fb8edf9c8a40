#include "render/video_layout.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

namespace sqslam {
namespace {

int Even(double value) { return 2 * static_cast<int>(std::lround(0.5 * value)); }

cv::Scalar ToBgr(const Eigen::Vector3d& color) {
  return {255.0 * color.z(), 255.0 * color.y(), 255.0 * color.x()};
}

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

GrowthPage::GrowthPage(const GrowthLayout& layout, const SceneStyle& style, const LabelColors& colors)
    : layout_(layout), style_(style), colors_(colors) {}

cv::Mat GrowthPage::Compose(const cv::Mat& view, const MapSnapshot& map, const GrowthMoment& moment) const {
  cv::Mat page(layout_.frame, CV_8UC3, ToBgr(ParseColor(style_.background)));
  view.copyTo(page(layout_.view));
  if (!layout_.image.empty()) {
    DrawImage(page, map);
  }
  DrawTimeline(page, map, moment);
  return page;
}

void GrowthPage::DrawImage(cv::Mat& page, const MapSnapshot& map) const {
  const Eigen::Vector3d ink = ParseColor(style_.text.color);
  const Eigen::Vector3d paper = ParseColor(style_.background);
  const cv::Mat image = map.image_path.empty() ? cv::Mat() : cv::imread(map.image_path, cv::IMREAD_COLOR);
  cv::Mat part = page(layout_.image);
  if (image.empty()) {
    part.setTo(ToBgr(0.92 * paper + 0.08 * ink));
    text_.Draw(part, "image not found", {part.cols / 2, part.rows / 2}, style_.text.size * layout_.scale,
               0.5 * ink + 0.5 * paper, TextPainter::Align::kCenter);
    return;
  }
  cv::resize(image, part, part.size(), 0.0, 0.0, image.cols > part.cols ? cv::INTER_AREA : cv::INTER_LINEAR);
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
    DrawFrame(part, area, (mapped ? 2.4 : 1.0) * layout_.scale, color, mapped ? 1.0 : 0.7);
    if (!mapped) {  // not yet, or no longer, part of the map: a thin box without a name
      continue;
    }
    std::string shown = seen.detection.label;
    std::replace(shown.begin(), shown.end(), '_', ' ');
    const int width = text_.Width(shown, size) + static_cast<int>(0.8 * size);
    const int height = static_cast<int>(1.5 * size);
    const cv::Rect tag(std::clamp(area.x, 0, std::max(0, part.cols - width)), std::max(0, area.y - height),
                       width, height);
    DrawPanel(part, tag, 0.2 * size, color, 0.9);
    const bool light = color.dot(Eigen::Vector3d(0.2126, 0.7152, 0.0722)) > 0.5;
    text_.Draw(part, shown, {tag.x + tag.width / 2, tag.y + tag.height / 2}, size,
               Eigen::Vector3d::Constant(light ? 0.05 : 1.0), TextPainter::Align::kCenter);
  }
}

void GrowthPage::DrawTimeline(cv::Mat& page, const MapSnapshot& map, const GrowthMoment& moment) const {
  const Eigen::Vector3d ink = ParseColor(style_.text.color);
  const Eigen::Vector3d paper = ParseColor(style_.background);
  const double size = 0.9 * style_.text.size * layout_.scale;
  const cv::Rect& area = layout_.timeline;
  const int thick = std::max(2, static_cast<int>(std::lround(4.0 * layout_.scale)));
  const cv::Rect track(area.x, area.y + thick, area.width, thick);
  DrawPanel(page, track, 0.5 * thick, 0.85 * paper + 0.15 * ink);
  const int done = static_cast<int>(std::lround(track.width * std::clamp(moment.progress, 0.0, 1.0)));
  DrawPanel(page, {track.x, track.y, done, thick}, 0.5 * thick, ParseColor(style_.cameras.current_color));
  const int y = area.y + 2 * thick + static_cast<int>(1.1 * size);
  const std::string when = fmt::format("{:.1f} s   frame {}", moment.seconds, map.frame_index);
  const std::string counts =
      fmt::format("{} keyframes   {} points   {} object{}", map.keyframes.size(), map.points.size(),
                  map.objects.size(), map.objects.size() == 1 ? "" : "s");
  text_.Draw(page, when, {area.x, y}, size, ink);
  text_.Draw(page, counts, {area.br().x, y}, size, ink, TextPainter::Align::kRight);
}

}  // namespace sqslam
