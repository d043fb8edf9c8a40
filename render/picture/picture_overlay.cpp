#include "render/picture/picture_overlay.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "render/picture/label_layout.h"
#include "render/scene/color_scale.h"
#include "render/scene/object_look.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace {

constexpr double kMinTextSize = 9.0;  // pixels; smaller text is not readable

double TextSize(const SceneStyle& style, double scale) {
  return std::max(style.text.size * scale, kMinTextSize);
}

int Pixels(double value) { return static_cast<int>(std::lround(value)); }

}  // namespace

SeenPoint Project(const ViewCamera& view, cv::Size image, const Eigen::Vector3d& p_map) {
  const ViewCamera camera = FromAfar(view);
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
  const bool by_class = !captions.truth || captions.truth->iou.empty();  // else a colour bar explains them
  for (const auto& [label, count] : counts) {
    if (count > 0 && by_class) {
      entries.push_back({ReadableLabel(label), std::to_string(count), captions.colors(label)});
    }
  }
  if (uncertain > 0) {
    entries.push_back({"uncertain", std::to_string(uncertain), ParseColor(style.grid.color), true});
  }
  const auto line = [&](const char* name, const std::string& color) {
    entries.push_back({name, "", ParseColor(color), true});
  };
  if (captions.true_path && style.cameras.trajectory && keyframes && !captions.truth) {
    line("estimated path", style.cameras.color);
  }
  if (captions.true_path) {
    line("true path", style.ground_truth.color);
  }
  if (captions.truth && !captions.truth->solids.empty()) {
    line("true objects (dashed)", style.ground_truth.color);
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

std::string LengthText(double length, bool metric) {
  return metric ? fmt::format("{:.4g} m", length)
                : fmt::format("{:.4g} map unit{}", length, length == 1.0 ? "" : "s");
}

// Layout of the map's axes, of the text with the grid's cell size and of an orthographic picture's scale bar,
// in the bottom-left corner.
struct AxesLayout {
  AxesLayout(cv::Size picture, const PictureCaptions& captions, bool metric, const SceneStyle& style,
             const TextPainter& text, double scale)
      : size(TextSize(style, scale)),
        small(std::max(0.85 * size, kMinTextSize)),
        length(2.2 * size),
        origin(1.6 * size + length, picture.height - 1.6 * size - 0.9 * length),
        cell_at(Pixels(2.0 * length + 3.0 * size), Pixels(picture.height - 1.6 * size)) {
    int right = Pixels(origin.x + length + size);
    if (style.grid.show) {
      cell = "grid " + LengthText(captions.grid_cell, metric);
      right = std::max(right, cell_at.x + text.Width(cell, small));
    }
    if (captions.picture_height > 0.0) {
      const double unit = picture.height / captions.picture_height;  // pixels
      const double bar = RoundLength(0.25 * picture.width / unit);
      bar_text = LengthText(bar, metric);
      bar_from = {double(cell_at.x), cell_at.y - (cell.empty() ? 0.0 : 1.5 * small)};
      bar_to = bar_from + cv::Point2d(bar * unit, 0.0);
      right = std::max(right, Pixels(bar_to.x + small) + text.Width(bar_text, small));
    }
    if (!cell.empty() || !bar_text.empty()) {
      const int gap = Pixels(0.6 * small), line = Pixels(1.5 * small);
      const int first = Pixels(bar_text.empty() ? cell_at.y : bar_from.y);
      const int last = Pixels(cell.empty() ? bar_from.y : cell_at.y);
      panel = {cell_at.x - gap, first - line / 2 - gap / 2, right - cell_at.x + 2 * gap,
               last - first + line + gap};
    }
    const int top = Pixels(origin.y - length - size);
    area = {0, top, right, picture.height - top};
  }

  double size, small, length;
  cv::Point2d origin;
  cv::Point cell_at;
  std::string cell;  // or nothing
  cv::Point2d bar_from, bar_to;
  std::string bar_text;  // or nothing
  cv::Rect panel;        // behind the texts; empty without them
  cv::Rect area;         // of all of them
};

void DrawScaleBar(cv::Mat& image, const AxesLayout& layout, const Eigen::Vector3d& ink,
                  const TextPainter& text) {
  const double width = 0.13 * layout.size;
  const cv::Point2d tick(0.0, 0.35 * layout.size);
  DrawLine(image, layout.bar_from, layout.bar_to, width, ink);
  for (const cv::Point2d& end : {layout.bar_from, layout.bar_to}) {
    DrawLine(image, end - tick, end + tick, width, ink);
  }
  text.Draw(image, layout.bar_text, {Pixels(layout.bar_to.x + 0.6 * layout.small), Pixels(layout.bar_to.y)},
            layout.small, ink);
}

void DrawAxes(cv::Mat& image, const ViewCamera& camera, const AxesLayout& layout, bool panel_behind,
              const SceneStyle& style, const TextPainter& text) {
  if (panel_behind && !layout.panel.empty()) {
    DrawPanel(image, layout.panel, 0.4 * layout.size, ParseColor(style.background), 0.8);
  }
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
  const Eigen::Vector3d ink = 0.75 * ParseColor(style.text.color) + 0.25 * ParseColor(style.background);
  if (!layout.cell.empty()) {
    text.Draw(image, layout.cell, layout.cell_at, layout.small, ink);
  }
  if (!layout.bar_text.empty()) {
    DrawScaleBar(image, layout, ink, text);
  }
}

// A colour bar with the values at its ends.
struct ColorBar {
  std::string name, low, high;
};

std::vector<ColorBar> BarsOf(const MapTruth* truth) {
  std::vector<ColorBar> bars;
  if (truth != nullptr && !truth->iou.empty()) {
    bars.push_back({"3D IoU", "0", "1"});
  }
  if (truth != nullptr && truth->MaxCameraError() > 0.0) {
    bars.push_back({"camera error", "0", fmt::format("{:.3g} mm", 1e3 * truth->MaxCameraError())});
  }
  return bars;
}

// Layout of the colour bars in the bottom-right corner, one above the other.
struct BarsLayout {
  BarsLayout(cv::Size picture, const std::vector<ColorBar>& bars, const SceneStyle& style,
             const TextPainter& text, double scale)
      : size(std::max(0.85 * TextSize(style, scale), kMinTextSize)),
        line(Pixels(1.7 * size)),
        bar(Pixels(8.0 * size)),
        gap(Pixels(0.5 * size)) {
    int high = 0;
    for (const ColorBar& one : bars) {
      name = std::max(name, text.Width(one.name, size));
      low = std::max(low, text.Width(one.low, size));
      high = std::max(high, text.Width(one.high, size));
    }
    const cv::Size panel_size(name + low + bar + high + 5 * gap,
                              line * static_cast<int>(bars.size()) + 2 * gap);
    if (!bars.empty()) {
      panel = {cv::Point(picture.width - gap, picture.height - gap) - cv::Point(panel_size), panel_size};
    }
  }

  double size;
  int line, bar, gap;
  int name = 0, low = 0;  // widths of the names, and of the values before the bars
  cv::Rect panel;         // empty without bars
};

void DrawColorBars(cv::Mat& image, const std::vector<ColorBar>& bars, const BarsLayout& layout,
                   const SceneStyle& style, const TextPainter& text) {
  constexpr int kSteps = 64;
  if (layout.panel.empty()) {
    return;
  }
  const Eigen::Vector3d ink = ParseColor(style.text.color);
  DrawPanel(image, layout.panel, 0.4 * layout.size, ParseColor(style.background), 0.8);
  int y = layout.panel.y + layout.gap + layout.line / 2;
  for (const ColorBar& one : bars) {
    const int values = layout.panel.x + 2 * layout.gap + layout.name;
    const int begin = values + layout.low + layout.gap;
    text.Draw(image, one.name, {values - layout.gap, y}, layout.size, ink, TextPainter::Align::kRight);
    text.Draw(image, one.low, {begin - layout.gap, y}, layout.size, ink, TextPainter::Align::kRight);
    for (int i = 0; i < kSteps; ++i) {
      const cv::Rect step(cv::Point(begin + layout.bar * i / kSteps, y - Pixels(0.4 * layout.size)),
                          cv::Point(begin + layout.bar * (i + 1) / kSteps, y + Pixels(0.4 * layout.size)));
      DrawPanel(image, step, 0.0, Viridis((i + 0.5) / kSteps));
    }
    text.Draw(image, one.high, {begin + layout.bar + layout.gap, y}, layout.size, ink);
    y += layout.line;
  }
}

// Draws a leader from the text to a dot on its object, with an edge in the colour of the background.
void DrawLeader(cv::Mat& image, const LabelPlace& place, double size, const SceneStyle& style) {
  const Eigen::Vector3d ink = ParseColor(style.text.color);
  const Eigen::Vector3d paper = ParseColor(style.background);
  const double width = std::max(1.0, 0.07 * size);
  const double dot = 3.5 * width;
  const cv::Point2d from = LeaderStart(place);
  const cv::Point2d to = place.anchor;
  DrawLine(image, from, to, 3.0 * width, paper, 0.6);
  const auto round = [&](double side, const Eigen::Vector3d& color) {
    const cv::Point corner(Pixels(to.x - 0.5 * side), Pixels(to.y - 0.5 * side));
    DrawPanel(image, {corner, cv::Size(Pixels(side), Pixels(side))}, 0.5 * side, color);
  };
  round(dot + 2.0 * width, paper);
  DrawLine(image, from, to, width, ink);
  round(dot, ink);
}

// Draws names at the visible parts of the objects, without overlap with each other or `taken`.
void DrawLabels(cv::Mat& image, const std::vector<SnapshotObject>& objects, const ViewCamera& camera,
                const PictureCaptions& captions, const SceneStyle& style, const TextPainter& text,
                double scale, std::span<const cv::Rect> taken) {
  const double size = std::max(0.9 * style.text.size * scale, kMinTextSize);
  cv::Mat1b hidden(image.size(), std::uint8_t{0});
  if (!captions.hidden.empty()) {
    captions.hidden.copyTo(hidden);
  }
  for (const cv::Rect& area : taken) {
    hidden(area & cv::Rect({0, 0}, image.size())).setTo(255);
  }
  const SeenSolids seen = SeeSolids(
      ToVector(
          objects,
          [&](const SnapshotObject& object) {
            return NamedSolid{object.superquadric, HidesOthers(object, style.objects, captions.see_through)};
          }),
      captions.see_through, PinholeOf(camera, image.size()), PoseOf(camera), hidden,
      [&](const Eigen::Vector3d& p_map) { return !captions.clip || captions.clip->Keeps(p_map); });
  const Eigen::Vector3d eye = FromAfar(camera).position;
  std::vector<LabelRequest> requests;
  std::vector<std::string> names;
  for (std::size_t i = 0; i < objects.size(); ++i) {
    if (ShownName(objects[i]).find_first_not_of(' ') == std::string::npos) {
      continue;  // a blank name means no label
    }
    names.push_back(ReadableLabel(ShownName(objects[i])) + (IsReliable(objects[i]) ? "" : "?"));
    requests.push_back({seen.parts[i],
                        {text.Width(names.back(), size) + Pixels(0.4 * size), Pixels(1.2 * size)},
                        (objects[i].superquadric.T_map_object.translation - eye).norm(),
                        static_cast<int>(i)});
  }
  const std::vector<LabelPlace> places = PlaceLabels(requests, seen.number, taken);
  for (const LabelPlace& place : places) {  // below all names
    if (place.leader) {
      DrawLeader(image, place, size, style);
    }
  }
  for (std::size_t i = 0; i < places.size(); ++i) {
    const cv::Rect& area = places[i].area;
    if (!area.empty()) {
      text.Draw(image, names[i], {area.x + area.width / 2, area.y + area.height / 2}, size,
                ParseColor(style.text.color), TextPainter::Align::kCenter, ParseColor(style.background));
    }
  }
}

}  // namespace

PictureCaptions::PictureCaptions(const SceneStyle& style, const MapSnapshot& map, const SceneLayers& layers,
                                 const SceneFocus& focus, const LabelColors& label_colors,
                                 const ViewCamera& camera)
    : colors(label_colors),
      grid_cell(GridCell(focus)),
      picture_height(camera.IsOrthographic() ? camera.PictureHeight() : 0.0),
      clip(MakeClipPlane(style.clip, focus, camera)),
      covisibility(style.covisibility.show && !map.covisibility.empty()),
      true_path(style.ground_truth.show && !layers.true_path.empty()),
      truth(style.ground_truth.show ? layers.truth : nullptr),
      see_through(SolidsAreSeeThrough(style, layers)) {}

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
    areas.push_back(BarsLayout(picture, BarsOf(captions.truth.get()), style, text, scale).panel);
  }
  if (style.text.scale) {
    areas.push_back(AxesLayout(picture, captions, map.metric, style, text, scale).area);
  }
  std::erase_if(areas, [](const cv::Rect& area) { return area.empty(); });
  return areas;
}

void DrawTexts(cv::Mat& image, const MapSnapshot& map, const ViewCamera& camera,
               const PictureCaptions& captions, const SceneStyle& style, const TextPainter& text) {
  const std::vector<SnapshotObject> objects = NamedObjects(map, captions, style);
  const double scale = PictureScale(image.size());
  const bool panel_behind = captions.panel || image.channels() == 3;
  if (style.text.legend) {
    const auto entries = SceneLegend(objects, !map.keyframes.empty(), captions, style);
    DrawSceneLegend(image, entries, {image.size(), entries, style, text, scale}, panel_behind, style, text);
    const std::vector<ColorBar> bars = BarsOf(captions.truth.get());
    DrawColorBars(image, bars, {image.size(), bars, style, text, scale}, style, text);
  }
  if (style.text.scale) {
    DrawAxes(image, camera, {image.size(), captions, map.metric, style, text, scale}, panel_behind, style,
             text);
  }
  if (style.objects.labels && style.objects.show) {
    DrawLabels(image, objects, camera, captions, style, text, scale,
               CaptionAreas(image.size(), map, captions, style, text));
  }
}

}  // namespace sqslam
