#include "render/picture_overlay.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>

#include "render/scene_order.h"

namespace sqslam {
namespace {

// "potted_plant" as people write it.
std::string Readable(std::string label) {
  std::replace(label.begin(), label.end(), '_', ' ');
  return label;
}

struct ViewAxes {
  Eigen::Vector3d right, up, back;
};

ViewAxes AxesOf(const ViewCamera& camera) {
  const Eigen::Vector3d back = (camera.position - camera.focal_point).normalized();
  const Eigen::Vector3d right = camera.view_up.cross(back).normalized();
  return {right, back.cross(right), back};
}

constexpr double kLeastText = 9.0;  // pixels; smaller letters cannot be read

double TextSize(const SceneStyle& style, double scale) {
  return std::max(style.text.size * scale, kLeastText);
}

int Pixels(double value) { return static_cast<int>(std::lround(value)); }

}  // namespace

SeenPoint Project(const ViewCamera& camera, cv::Size image, const Eigen::Vector3d& p_map) {
  const ViewAxes axes = AxesOf(camera);
  const Eigen::Vector3d d = p_map - camera.position;
  const double depth = -d.dot(axes.back);
  const double focal = 0.5 * image.height / std::tan(0.5 * camera.view_angle * std::numbers::pi / 180.0);
  return {{0.5 * image.width + focal * d.dot(axes.right) / depth,
           0.5 * image.height - focal * d.dot(axes.up) / depth},
          depth};
}

void DrawLegend(cv::Mat& image, const MapSnapshot& map, const LabelColors& colors, const SceneStyle& style,
                const TextPainter& text, double scale) {
  std::map<std::string, int> counts;
  for (const SnapshotObject& object : map.objects) {
    ++counts[object.label];
  }
  if (counts.empty()) {
    return;
  }
  const double size = TextSize(style, scale);
  const int line = Pixels(1.55 * size);
  int widest = 0;
  int widest_count = 0;
  for (const auto& [label, count] : counts) {
    widest = std::max(widest, text.Width(Readable(label), size));
    widest_count = std::max(widest_count, text.Width(std::to_string(count), size));
  }
  const int swatch = Pixels(0.85 * size);
  const int gap = Pixels(0.6 * size);
  const int margin = Pixels(1.2 * size);
  const int width = swatch + gap + widest + 2 * gap + widest_count;
  const int left = image.cols - margin - width;
  const Eigen::Vector3d ink = ParseColor(style.text.color);
  const cv::Rect panel(left - gap, margin - gap, width + 2 * gap,
                       line * static_cast<int>(counts.size()) + 2 * gap);
  if (image.channels() == 3) {
    DrawPanel(image, panel, 0.4 * size, ParseColor(style.background), 0.8);
  }
  int y = margin + line / 2;
  for (const auto& [label, count] : counts) {
    DrawPanel(image, {left, y - swatch / 2, swatch, swatch}, 0.2 * size, colors(label));
    text.Draw(image, Readable(label), {left + swatch + gap, y}, size, ink);
    text.Draw(image, std::to_string(count), {left + width, y}, size,
              0.6 * ink + 0.4 * ParseColor(style.background), TextPainter::Align::kRight);
    y += line;
  }
}

void DrawAxes(cv::Mat& image, const ViewCamera& camera, double grid_cell, const SceneStyle& style,
              const TextPainter& text, double scale) {
  const double size = TextSize(style, scale);
  const double length = 2.2 * size;
  const cv::Point2d origin(1.6 * size + length, image.rows - 1.6 * size - 0.9 * length);
  const ViewAxes view = AxesOf(camera);
  const std::array<const char*, 3> names = {"x", "y", "z"};
  const std::array<Eigen::Vector3d, 3> colors = {ParseColor("#c0392b"), ParseColor("#2e8b57"),
                                                 ParseColor("#2f6db5")};
  std::array<int, 3> order = {0, 1, 2};  // away from the viewer first
  std::sort(order.begin(), order.end(), [&](int a, int b) { return view.back[a] < view.back[b]; });
  for (const int axis : order) {
    const auto at = static_cast<std::size_t>(axis);
    const cv::Point2d direction(view.right[axis], -view.up[axis]);
    DrawLine(image, origin, origin + length * direction, 0.13 * size, colors[at]);
    text.Draw(image, names[at], origin + (length + 0.7 * size) * direction, std::max(0.85 * size, kLeastText),
              colors[at], TextPainter::Align::kCenter);
  }
  if (style.grid.show) {
    const Eigen::Vector3d ink = 0.75 * ParseColor(style.text.color) + 0.25 * ParseColor(style.background);
    text.Draw(image, fmt::format("grid {:.4g} map unit{}", grid_cell, grid_cell == 1.0 ? "" : "s"),
              {Pixels(2.0 * length + 3.0 * size), Pixels(image.rows - 1.6 * size)},
              std::max(0.85 * size, kLeastText), ink);
  }
}

void DrawLabels(cv::Mat& image, const MapSnapshot& map, const ViewCamera& camera, const SceneStyle& style,
                const TextPainter& text, double scale) {
  const double size = std::max(0.9 * style.text.size * scale, kLeastText);
  for (const SnapshotObject& object : map.objects) {
    const double height = SupportExtent(object.superquadric, camera.view_up.normalized());
    const Eigen::Vector3d top =
        object.superquadric.T_map_object.translation + height * camera.view_up.normalized();
    const SeenPoint seen = Project(camera, image.size(), top);
    if (seen.depth > 0.0) {
      text.DrawOver(image, Readable(object.label), {Pixels(seen.pixel.x), Pixels(seen.pixel.y - 0.8 * size)},
                    size, ParseColor(style.text.color), ParseColor(style.background),
                    TextPainter::Align::kCenter);
    }
  }
}

}  // namespace sqslam
