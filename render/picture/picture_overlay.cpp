#include "render/picture/picture_overlay.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <numeric>

namespace sqslam {
namespace {

constexpr double kMinTextSize = 9.0;  // pixels; smaller text is not readable

double TextSize(const SceneStyle& style, double scale) {
  return std::max(style.text.size * scale, kMinTextSize);
}

int Pixels(double value) { return static_cast<int>(std::lround(value)); }

constexpr int kMaxLinesAway = 7;  // lines by which a text may be moved away

constexpr double kCoverCost = 4.0;  // cost of fully covering another object, in ranks of the candidate list

// Returns the candidate places in order of preference.
std::vector<LabelPlace> Candidates(const LabelRequest& request) {
  const cv::Rect& b = request.bounds;
  const cv::Size& s = request.size;
  const int gap = std::max(2, s.height / 4);
  const int centered = b.x + (b.width - s.width) / 2;
  const int middle = b.y + (b.height - s.height) / 2;
  std::vector<LabelPlace> places = {
      {{{centered, b.y - gap - s.height}, s}, false},
      {{{centered, b.br().y + gap}, s}, false},
      {{{b.br().x + gap, middle}, s}, false},
      {{{b.x - gap - s.width, middle}, s}, false},
  };
  for (int step = 1; step <= kMaxLinesAway; ++step) {
    for (const int shift : {0, s.width / 2 + gap, -s.width / 2 - gap}) {
      places.push_back({{{centered + shift, b.y - gap - s.height - step * (s.height + gap)}, s}, true});
      places.push_back({{{centered + shift, b.br().y + gap + step * (s.height + gap)}, s}, true});
    }
  }
  return places;
}

// Returns the area of other objects that a text would cover, as a share of its own area.
double Covered(const cv::Rect& area, std::span<const LabelRequest> requests, std::size_t own) {
  double sum = 0.0;
  for (std::size_t i = 0; i < requests.size(); ++i) {
    sum += i == own ? 0.0 : (requests[i].bounds & area).area();
  }
  return sum / std::max(1, area.area());
}

}  // namespace

SeenPoint Project(const ViewCamera& camera, cv::Size image, const Eigen::Vector3d& p_map) {
  const ViewAxes axes = AxesOf(camera);
  const Eigen::Vector3d d = p_map - camera.position;
  const double depth = -d.dot(axes.back);
  if (camera.pinhole) {  // scaled to the picture; pixels start at its corner
    const Eigen::Vector2d pixel =
        camera.pinhole->Project({d.dot(axes.right), -d.dot(axes.up), depth}) + Eigen::Vector2d::Constant(0.5);
    return {
        {pixel.x() * image.width / camera.pinhole->width, pixel.y() * image.height / camera.pinhole->height},
        depth};
  }
  const double focal = camera.FocalLength(image.height);
  return {{0.5 * image.width + focal * d.dot(axes.right) / depth,
           0.5 * image.height - focal * d.dot(axes.up) / depth},
          depth};
}

std::vector<LabelPlace> PlaceLabels(std::span<const LabelRequest> requests, cv::Size picture,
                                    std::span<const cv::Rect> taken) {
  std::vector<std::size_t> order(requests.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(
      order, [&](std::size_t a, std::size_t b) { return requests[a].depth < requests[b].depth; });
  const cv::Rect whole({0, 0}, picture);
  std::vector<cv::Rect> used(taken.begin(), taken.end());
  std::vector<LabelPlace> places(requests.size());
  for (const std::size_t index : order) {
    double least = std::numeric_limits<double>::infinity();
    const std::vector<LabelPlace> candidates = Candidates(requests[index]);
    for (std::size_t rank = 0; rank < candidates.size(); ++rank) {
      const cv::Rect& area = candidates[rank].area;
      const bool inside = (area & whole) == area;
      const bool free =
          std::ranges::none_of(used, [&](const cv::Rect& other) { return !(other & area).empty(); });
      const double cost = static_cast<double>(rank) + kCoverCost * Covered(area, requests, index);
      if (inside && free && cost < least) {
        least = cost;
        places[index] = candidates[rank];
      }
    }
    if (!places[index].area.empty()) {
      used.push_back(places[index].area);
    }
  }
  return places;
}

namespace {

// A line of the legend.
struct SceneLegendEntry {
  std::string name;
  std::string count;  // or nothing
  Eigen::Vector3d color = Eigen::Vector3d::Zero();
  bool line = false;  // drawn as a line, otherwise as a square
};

// Lists the map's classes with their counts, and the kinds of lines that need an explanation.
std::vector<SceneLegendEntry> SceneLegend(const std::vector<SnapshotObject>& objects, bool keyframes,
                                          const PictureCaptions& captions, const SceneStyle& style) {
  std::vector<SceneLegendEntry> entries;
  std::map<std::string, int> counts;
  int uncertain = 0;
  for (const SnapshotObject& object : objects) {
    const bool solid = style.objects.uncertain == UncertainObjects::kSolid || IsReliable(object);
    counts[object.label] += style.objects.show && solid ? 1 : 0;
    uncertain += style.objects.show && !solid ? 1 : 0;
  }
  for (const auto& [label, count] : counts) {
    if (count > 0) {
      entries.push_back({ReadableLabel(label), std::to_string(count), captions.colors(label)});
    }
  }
  if (uncertain > 0) {
    entries.push_back({"uncertain", std::to_string(uncertain), ParseColor(style.grid.color), true});
  }
  const auto line = [&](const char* name, const std::string& color) {
    entries.push_back({name, "", ParseColor(color), true});
  };
  if (captions.true_path && style.cameras.trajectory && keyframes) {
    line("estimated path", style.cameras.color);
  }
  if (captions.true_path) {
    line("true path", style.ground_truth.color);
  }
  if (captions.covisibility) {
    line("covisible", style.covisibility.color);
  }
  return entries;
}

// Layout of the legend in the top-right corner. `scale`: pixels per pixel of the style.
struct LegendLayout {
  LegendLayout(cv::Size picture, const std::vector<SceneLegendEntry>& entries, const SceneStyle& style,
               const TextPainter& text, double scale)
      : size(TextSize(style, scale)),
        line(Pixels(1.55 * size)),
        swatch(Pixels(0.85 * size)),
        gap(Pixels(0.6 * size)) {
    if (entries.empty()) {
      return;
    }
    int widest = 0;
    int widest_count = 0;
    for (const SceneLegendEntry& entry : entries) {
      widest = std::max(widest, text.Width(entry.name, size));
      widest_count = std::max(widest_count, text.Width(entry.count, size));
    }
    const int margin = Pixels(1.2 * size);
    width = swatch + gap + widest + (widest_count > 0 ? 2 * gap + widest_count : 0);
    panel = {picture.width - margin - width - gap, margin - gap, width + 2 * gap,
             line * static_cast<int>(entries.size()) + 2 * gap};
  }

  double size;
  int line, swatch, gap;
  int width = 0;   // of the lines
  cv::Rect panel;  // behind it; empty without entries
};

void DrawSceneLegend(cv::Mat& image, const std::vector<SceneLegendEntry>& entries, const LegendLayout& layout,
                     bool panel_behind, const SceneStyle& style, const TextPainter& text) {
  const double size = layout.size;
  const Eigen::Vector3d ink = ParseColor(style.text.color);
  if (panel_behind && !layout.panel.empty()) {
    DrawPanel(image, layout.panel, 0.4 * size, ParseColor(style.background), 0.8);
  }
  const int left = layout.panel.x + layout.gap;
  int y = layout.panel.y + layout.gap + layout.line / 2;
  for (const SceneLegendEntry& entry : entries) {
    if (entry.line) {
      DrawLine(image, cv::Point2d(left, y), cv::Point2d(left + layout.swatch, y), 0.16 * size, entry.color);
    } else {
      DrawPanel(image, {left, y - layout.swatch / 2, layout.swatch, layout.swatch}, 0.2 * size, entry.color);
    }
    text.Draw(image, entry.name, {left + layout.swatch + layout.gap, y}, size, ink);
    text.Draw(image, entry.count, {left + layout.width, y}, size,
              0.6 * ink + 0.4 * ParseColor(style.background), TextPainter::Align::kRight);
    y += layout.line;
  }
}

// Layout of the map's axes and of the text with the grid's cell size, in the bottom-left corner.
struct AxesLayout {
  AxesLayout(cv::Size picture, double grid_cell, bool metric, const SceneStyle& style,
             const TextPainter& text, double scale)
      : size(TextSize(style, scale)),
        small(std::max(0.85 * size, kMinTextSize)),
        length(2.2 * size),
        origin(1.6 * size + length, picture.height - 1.6 * size - 0.9 * length),
        cell_at(Pixels(2.0 * length + 3.0 * size), Pixels(picture.height - 1.6 * size)) {
    int right = Pixels(origin.x + length + size);
    if (style.grid.show) {
      cell = metric ? fmt::format("grid {:.4g} m", grid_cell)
                    : fmt::format("grid {:.4g} map unit{}", grid_cell, grid_cell == 1.0 ? "" : "s");
      right = std::max(right, cell_at.x + text.Width(cell, small));
    }
    const int top = Pixels(origin.y - length - size);
    area = {0, top, right, picture.height - top};
  }

  double size, small, length;
  cv::Point2d origin;
  cv::Point cell_at;
  std::string cell;  // or nothing
  cv::Rect area;     // of axes and text
};

void DrawAxes(cv::Mat& image, const ViewCamera& camera, const AxesLayout& layout, const SceneStyle& style,
              const TextPainter& text) {
  const ViewAxes view = AxesOf(camera);
  const std::array<const char*, 3> names = {"x", "y", "z"};
  const std::array<Eigen::Vector3d, 3> colors = {ParseColor("#c0392b"), ParseColor("#2e8b57"),
                                                 ParseColor("#2f6db5")};
  std::array<int, 3> order = {0, 1, 2};  // farthest from the viewer first
  std::ranges::sort(order, [&](int a, int b) { return view.back[a] < view.back[b]; });
  for (const int axis : order) {
    const auto at = static_cast<std::size_t>(axis);
    const cv::Point2d direction(view.right[axis], -view.up[axis]);
    DrawLine(image, layout.origin, layout.origin + layout.length * direction, 0.13 * layout.size, colors[at]);
    text.Draw(image, names[at], layout.origin + (layout.length + 0.7 * layout.size) * direction, layout.small,
              colors[at], TextPainter::Align::kCenter);
  }
  if (!layout.cell.empty()) {
    const Eigen::Vector3d ink = 0.75 * ParseColor(style.text.color) + 0.25 * ParseColor(style.background);
    text.Draw(image, layout.cell, layout.cell_at, layout.small, ink);
  }
}

// Returns the bounding box of an object in the picture, from points on its surface; empty if the object
// reaches behind the camera.
cv::Rect SeenBounds(const PosedSuperquadric& solid, const ViewCamera& camera, cv::Size picture) {
  Eigen::AlignedBox2d bounds;
  constexpr int kSteps = 12;
  for (int i = 0; i <= kSteps; ++i) {
    for (int k = 0; k < 2 * kSteps; ++k) {
      const Eigen::Vector3d p =
          solid.shape.PointAt(std::numbers::pi * (static_cast<double>(i) / kSteps - 0.5),
                              std::numbers::pi * (static_cast<double>(k) / kSteps - 1.0));
      const SeenPoint seen = Project(camera, picture, solid.T_map_object * p);
      if (seen.depth <= 0.0) {
        return {};
      }
      bounds.extend(Eigen::Vector2d(seen.pixel.x, seen.pixel.y));
    }
  }
  const cv::Rect whole(cv::Point(Pixels(bounds.min().x()), Pixels(bounds.min().y())),
                       cv::Point(Pixels(bounds.max().x()) + 1, Pixels(bounds.max().y()) + 1));
  return whole & cv::Rect({0, 0}, picture);
}

// Draws names beside the objects without overlap with each other or `taken`.
void DrawLabels(cv::Mat& image, const std::vector<SnapshotObject>& objects, const ViewCamera& camera,
                const SceneStyle& style, const TextPainter& text, double scale,
                std::span<const cv::Rect> taken) {
  const double size = std::max(0.9 * style.text.size * scale, kMinTextSize);
  const Eigen::Vector3d ink = ParseColor(style.text.color);
  std::vector<LabelRequest> requests;
  std::vector<std::string> names;
  for (const SnapshotObject& object : objects) {
    const cv::Rect bounds = SeenBounds(object.superquadric, camera, image.size());
    if (!bounds.empty()) {
      names.push_back(ReadableLabel(ShownName(object)) + (IsReliable(object) ? "" : "?"));
      requests.push_back({bounds,
                          {text.Width(names.back(), size) + Pixels(0.4 * size), Pixels(1.2 * size)},
                          (object.superquadric.T_map_object.translation - camera.position).norm()});
    }
  }
  const std::vector<LabelPlace> places = PlaceLabels(requests, image.size(), taken);
  for (std::size_t i = 0; i < places.size(); ++i) {
    const cv::Rect& area = places[i].area;
    if (area.empty()) {
      continue;
    }
    const cv::Point2d middle(area.x + 0.5 * area.width, area.y + 0.5 * area.height);
    if (places[i].leader) {
      const cv::Rect& bounds = requests[i].bounds;
      const bool above = area.y < bounds.y;
      DrawLine(image, {middle.x, above ? static_cast<double>(area.br().y) : static_cast<double>(area.y)},
               {bounds.x + 0.5 * bounds.width, bounds.y + (above ? 0.15 : 0.85) * bounds.height}, 0.07 * size,
               ink, 0.7);
    }
    text.Draw(image, names[i], {Pixels(middle.x), Pixels(middle.y)}, size, ink, TextPainter::Align::kCenter,
              ParseColor(style.background));
  }
}

}  // namespace

PictureCaptions::PictureCaptions(const SceneStyle& style, const MapSnapshot& map, const SceneLayers& layers,
                                 const SceneFocus& focus, const LabelColors& label_colors,
                                 const ViewCamera& camera)
    : colors(label_colors),
      grid_cell(GridCell(focus)),
      clip(MakeClipPlane(style.clip, focus, camera)),
      covisibility(style.covisibility.show && !map.covisibility.empty()),
      true_path(style.ground_truth.show && !layers.true_path.empty()) {}

double PictureScale(cv::Size picture) { return std::min(picture.height / 720.0, picture.width / 960.0); }

namespace {

std::vector<SnapshotObject> NamedObjects(const MapSnapshot& map, const PictureCaptions& captions,
                                         const SceneStyle& style) {
  std::vector<SnapshotObject> objects = map.objects;
  std::erase_if(objects, [&](const SnapshotObject& object) {
    return (captions.clip && !captions.clip->KeepsSomeOf(object.superquadric)) ||
           (style.objects.uncertain == UncertainObjects::kHide && !IsReliable(object));
  });
  return objects;
}

}  // namespace

std::vector<cv::Rect> CaptionAreas(cv::Size picture, const MapSnapshot& map, const PictureCaptions& captions,
                                   const SceneStyle& style, const TextPainter& text) {
  const double scale = PictureScale(picture);
  std::vector<cv::Rect> areas;
  if (style.text.legend) {
    const auto entries =
        SceneLegend(NamedObjects(map, captions, style), !map.keyframes.empty(), captions, style);
    areas.push_back(LegendLayout(picture, entries, style, text, scale).panel);
  }
  if (style.text.scale) {
    areas.push_back(AxesLayout(picture, captions.grid_cell, map.metric, style, text, scale).area);
  }
  std::erase_if(areas, [](const cv::Rect& area) { return area.empty(); });
  return areas;
}

void DrawTexts(cv::Mat& image, const MapSnapshot& map, const ViewCamera& camera,
               const PictureCaptions& captions, const SceneStyle& style, const TextPainter& text) {
  const std::vector<SnapshotObject> objects = NamedObjects(map, captions, style);
  const double scale = PictureScale(image.size());
  if (style.text.legend) {
    const auto entries = SceneLegend(objects, !map.keyframes.empty(), captions, style);
    DrawSceneLegend(image, entries, {image.size(), entries, style, text, scale},
                    captions.panel || image.channels() == 3, style, text);
  }
  if (style.text.scale) {
    DrawAxes(image, camera, {image.size(), captions.grid_cell, map.metric, style, text, scale}, style, text);
  }
  if (style.objects.labels && style.objects.show) {
    DrawLabels(image, objects, camera, style, text, scale,
               CaptionAreas(image.size(), map, captions, style, text));
  }
}

}  // namespace sqslam
