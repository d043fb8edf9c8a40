#include "render/figures/map_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "render/figures/figure_names.h"
#include "render/picture/picture_overlay.h"
#include "render/scene/object_look.h"
#include "render/solids/scene_order.h"
#include "slam/geometry/silhouette.h"
#include "slam/util/markup.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace {

// A page with the view that it shows.
struct MapPage {
  FigureSheet sheet;
  SceneStyle style;
  ViewCamera view;
  cv::Size pixels;  // of the embedded picture, which fills the page
  bool dense = false;
  LabelColors colors;

  Eigen::Vector2d OnPage(const Eigen::Vector2d& pixel) const { return pixel * 72.0 / sheet.page.dpi; }
  bool IsSolid(const SnapshotObject& object) const {
    return style.objects.uncertain == UncertainObjects::kSolid || IsReliable(object);
  }
};

// Returns the embedded picture: everything but objects, path and texts.
cv::Mat DrawRaster(const MapSnapshot& framed, const MapSnapshot& map, PictureOptions options,
                   const MapPage& page) {
  options.width = page.pixels.width;
  options.height = page.pixels.height;
  SceneStyle& style = options.style;
  style.objects.show = style.objects.labels = style.text.legend = style.text.scale = false;
  style.cameras.trajectory = false;
  PictureRenderer renderer(options);
  renderer.SetMap(framed);
  renderer.SetMapKeepingFrame(map);
  return renderer.Render(page.view);
}

void DrawPath(MapPage& page, const MapSnapshot& map) {
  constexpr double kWidth = 1.0;  // points
  std::vector<Eigen::Vector2d> points;
  const auto end_piece = [&] {
    if (points.size() > 1) {
      page.sheet.page.Polyline(points, {ParseColor(page.style.cameras.color), kWidth, {}});
    }
    points.clear();
  };
  for (const SnapshotKeyframe& keyframe : map.keyframes) {
    const SeenPoint seen = Project(page.view, page.pixels, keyframe.T_map_camera.translation);
    if (seen.depth <= 0.0) {
      end_piece();
      continue;
    }
    points.push_back(page.OnPage({seen.pixel.x, seen.pixel.y}));
  }
  end_piece();
}

// Draws the silhouettes as the style asks for them, farthest first.
void DrawSolids(MapPage& page, const std::vector<SnapshotObject>& objects) {
  constexpr double kOutline = 0.6, kGlassOutline = 1.0;  // points
  const SceneStyle::Objects& style = page.style.objects;
  const Eigen::Vector3d paper = ParseColor(page.style.background);
  std::vector<PosedSuperquadric> solids;
  std::vector<const SnapshotObject*> owners;  // of the solids
  for (const SnapshotObject& object : objects) {
    for (const PosedSuperquadric& solid : DrawnSolids(object, style)) {
      solids.push_back(solid);
      owners.push_back(&object);
    }
  }
  const SolidOrder order(solids);
  for (const std::size_t i : order.BackToFront(FromAfar(page.view).position)) {
    const SnapshotObject& object = *owners[i];
    const Eigen::Vector3d color = page.colors(object.label);
    FigurePath path{{}, true, std::nullopt};
    for (const Eigen::Vector2d& pixel :
         Silhouette(solids[i], PinholeOf(page.view, page.pixels), PoseOf(page.view))) {
      path.points.push_back(page.OnPage(pixel + Eigen::Vector2d::Constant(0.5)));
    }
    const Eigen::Vector3d line = ReadableOn(paper, color, page.style.points.min_contrast);
    if (!page.IsSolid(object)) {
      path.stroke = FigureStroke{0.5 * (line + paper), kOutline, {2.0, 2.0}};
    } else if (const ObjectLook look = LookOf(object, style, page.dense); look == ObjectLook::kSolid) {
      path.fill = color;
      path.fill_opacity = style.opacity;
      path.stroke = FigureStroke{0.5 * color, kOutline, {}};
    } else {
      path.fill = look == ObjectLook::kGlass ? std::optional(color) : std::nullopt;
      path.fill_opacity = style.glass;
      path.stroke = FigureStroke{line, kGlassOutline, {}};
    }
    if (path.points.size() > 2) {
      page.sheet.page.elements.emplace_back(std::move(path));
    }
  }
}

// Draws classes and their numbers in the top-right corner. Returns the place that they take.
FigureRect DrawClasses(MapPage& page, const std::vector<SnapshotObject>& objects) {
  std::map<std::string, int> counts;
  for (const SnapshotObject& object : objects) {
    counts[object.label] += page.IsSolid(object) ? 1 : 0;
  }
  std::erase_if(counts, [](const auto& entry) { return entry.second == 0; });
  const FigureTheme& theme = page.sheet.theme;
  const double right = page.sheet.page.width - theme.font;
  double widest = 0.0;
  for (const auto& [label, count] : counts) {
    widest = std::max(widest, TextWidth(ReadableLabel(label), theme.font));
  }
  const double left = right - widest - 3.5 * theme.font, line = 1.5 * theme.font;
  double y = 1.5 * theme.font;
  const FigureRect panel{left - 0.5 * theme.font, y - line / 2, right - left + theme.font,
                         line * static_cast<double>(counts.size())};
  if (!counts.empty()) {
    page.sheet.page.Rect(panel, theme.background);
  }
  for (const auto& [label, count] : counts) {
    const double side = 0.8 * theme.font;
    page.sheet.page.Rect({left, y - 0.5 * side, side, side}, page.colors(label));
    page.sheet.page.Text(ReadableLabel(label), {left + 1.5 * theme.font, y}, theme.font, theme.ink);
    page.sheet.page.Text(std::to_string(count), {right, y}, theme.font, theme.muted, TextAlign::kRight);
    y += line;
  }
  return panel;
}

// Draws the map's axes in the bottom-left corner, with the size of a grid cell or a scale bar beside them.
void DrawScale(MapPage& page, const SceneFocus& focus, bool metric) {
  FigurePage& out = page.sheet.page;
  const FigureTheme& theme = page.sheet.theme;
  const ViewAxes axes = AxesOf(page.view);
  const double length = 2.0 * theme.font;
  const Eigen::Vector2d origin(2.0 * length, out.height - 1.5 * length);
  constexpr std::array<std::pair<const char*, const char*>, 3> kAxes = {
      {{"x", "#c0392b"}, {"y", "#2e8b57"}, {"z", "#2f6db5"}}};
  for (int i = 0; i < 3; ++i) {
    const auto& [name, color] = kAxes[static_cast<std::size_t>(i)];
    const Eigen::Vector2d direction(axes.right[i], -axes.up[i]);
    out.Line(origin, origin + length * direction, {ParseColor(color), 1.0, {}});
    out.Text(name, origin + (length + 0.7 * theme.font) * direction, theme.small, ParseColor(color),
             TextAlign::kCenter);
  }
  const auto text = [metric](double value) {
    return metric ? fmt::format("{:.4g} m", value) : fmt::format("{:.4g} map units", value);
  };
  Eigen::Vector2d at(origin.x() + 2.0 * length, out.height - theme.font);
  if (page.style.grid.show) {
    out.Text("grid " + text(GridCell(focus)), at, theme.small, theme.ink);
    at.y() -= 1.5 * theme.font;
  }
  if (page.view.IsOrthographic()) {
    const double unit = out.height / page.view.PictureHeight();  // points
    const double bar = RoundLength(0.25 * out.width / unit);
    out.Line(at, at + Eigen::Vector2d(bar * unit, 0.0), {theme.ink, 1.2, {}});
    out.Text(text(bar), at + Eigen::Vector2d(bar * unit + theme.font, 0.0), theme.small, theme.ink);
  }
}

}  // namespace

FigurePage DrawMapPage(const MapSnapshot& framed, const MapSnapshot& map, const PictureOptions& options) {
  FigureOptions figure;
  figure.style = options.style;
  figure.transparent = options.transparent;
  MapPage page{
      {{}, {}, FigureTheme(figure)}, options.style, {}, {}, false, LabelColors(options.style.objects.colors)};
  FigurePage& out = page.sheet.page;
  out.width = kTextWidth;
  out.height = kTextWidth * options.height / options.width;
  out.title = "Object map";
  out.background = options.transparent ? std::nullopt : std::optional(ParseColor(options.style.background));
  page.pixels = {cvRound(out.width * out.dpi / 72.0), cvRound(out.height * out.dpi / 72.0)};
  page.sheet.area = {0.0, 0.0, out.width, out.height};
  page.dense = options.style.dense_cloud.show && (options.layers.dense_cloud || options.layers.dense_mesh);
  SceneFocus focus;
  {
    PictureRenderer whole(options);  // frames objects and path too
    whole.SetMap(framed);
    page.view = whole.DefaultCamera();
    focus = whole.Focus();
  }
  PlacePanel(out, DrawRaster(framed, map, options, page), page.sheet.area);
  if (options.style.cameras.trajectory) {
    DrawPath(page, map);
  }
  std::vector<SnapshotObject> objects =
      options.style.objects.show ? map.objects : std::vector<SnapshotObject>();
  std::erase_if(objects, [&](const SnapshotObject& object) {
    return options.style.objects.uncertain == UncertainObjects::kHide && !IsReliable(object);
  });
  DrawSolids(page, objects);
  const FigureRect legend = options.style.text.legend ? DrawClasses(page, objects) : FigureRect();
  if (options.style.objects.labels) {
    DrawObjectNames(page.sheet, objects, options.style, SolidsAreSeeThrough(options.style, options.layers),
                    page.view, page.pixels, page.sheet.area, legend);
  }
  if (options.style.text.scale) {
    DrawScale(page, focus, map.metric);
  }
  return std::move(page.sheet.page);
}

}  // namespace sqslam
