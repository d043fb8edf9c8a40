#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "render/camera/scene_framing.h"
#include "render/figures/panel_figures.h"
#include "render/page/panels.h"
#include "render/picture/picture.h"
#include "slam/util/error.h"

namespace sqslam {
namespace {

void AppendBox(const PosedSuperquadric& solid, std::vector<Eigen::Vector3d>& corners) {
  const Eigen::Vector3d& a = solid.shape.half_size;
  for (int i = 0; i < 8; ++i) {
    corners.push_back(solid.T_map_object * Eigen::Vector3d(i & 1 ? a.x() : -a.x(), i & 2 ? a.y() : -a.y(),
                                                           i & 4 ? a.z() : -a.z()));
  }
}

// The object's points and one of its solids.
MapSnapshot WithSolid(const CompareFigure::Object& object, const CompareFigure::Kind& kind,
                      const PosedSuperquadric& solid) {
  MapSnapshot map = object.map;
  map.support_height.reset();  // the grid lies below the object, wherever that stands
  map.T_map_camera.reset();
  SnapshotObject drawn;
  drawn.label = kind.name;
  drawn.superquadric = solid;
  map.objects = {drawn};
  return map;
}

// A three-quarter view from the keyframes' side that holds all solids, and the points unless they stray far.
ViewCamera EyeOn(const CompareFigure::Object& object, const CompareFigure::Kind& kind, double aspect) {
  std::vector<Eigen::Vector3d> outline;
  for (const PosedSuperquadric& solid : object.solids) {
    AppendBox(solid, outline);
  }
  const MapSnapshot map = WithSolid(object, kind, object.solids.front());
  const PosedSuperquadric& first = object.solids.front();
  const double reach = 1.5 * first.shape.half_size.norm();
  for (const SnapshotPoint& point : map.points) {
    const Eigen::Vector3d p = point.p_map.cast<double>();
    if ((p - first.T_map_object.translation).norm() < reach) {
      outline.push_back(p);
    }
  }
  return FitOutline(FrameScene(FindFocus(map), aspect), outline, aspect, 0.06);
}

// Objects stand side by side and their kinds below one another; a single object's kinds stand side by side.
struct CompareLayout {
  bool flat = false;  // a single object
  int columns = 0;
  int rows = 0;
  double left = 0.0;    // of the names of kinds, or of the object
  double top = 0.0;     // of the names of objects, or of kinds
  double note = 0.0;    // below each picture
  double cell = 0.0;    // width of a picture with the gap at its right
  double height = 0.0;  // of a picture
  double gap = 4.0;
};

CompareLayout LayOut(const CompareFigure& figure, const FigureTheme& theme, double width) {
  CompareLayout layout;
  layout.flat = figure.objects.size() == 1;
  const int objects = static_cast<int>(figure.objects.size());
  const int kinds = static_cast<int>(figure.kinds.size());
  layout.columns = layout.flat ? kinds : objects;
  layout.rows = layout.flat ? 1 : kinds;
  layout.left = 1.8 * theme.font;
  layout.top = 1.8 * theme.font;
  const bool notes = std::any_of(figure.objects.begin(), figure.objects.end(),
                                 [](const auto& object) { return !object.notes.empty(); });
  layout.note = notes ? 1.6 * theme.small : 0.0;
  layout.cell = (width - layout.left) / layout.columns;
  layout.height = 0.85 * (layout.cell - layout.gap);
  return layout;
}

double HeightOf(const CompareLayout& layout) {
  return layout.top + layout.rows * (layout.height + layout.note + layout.gap);
}

FigureRect CellOf(const CompareLayout& layout, const FigureRect& area, int object, int kind) {
  const int column = layout.flat ? kind : object;
  const int row = layout.flat ? 0 : kind;
  return {area.x + layout.left + column * layout.cell,
          area.y + layout.top + row * (layout.height + layout.note + layout.gap), layout.cell - layout.gap,
          layout.height};
}

// Columns are named above, rows at the left.
void DrawNames(FigureSheet& sheet, const CompareLayout& layout, const CompareFigure& figure) {
  const FigureTheme& theme = sheet.theme;
  const auto above = [&](const std::string& name, const FigureRect& cell) {
    const Eigen::Vector2d anchor(cell.Center().x(), sheet.area.y + 0.6 * theme.font);
    sheet.page.Text(
        NarrowText(PlainText(name, anchor, theme.font, theme.ink, TextAlign::kCenter), cell.width));
  };
  const auto beside = [&](const std::string& name, const FigureRect& cell) {
    const Eigen::Vector2d anchor(sheet.area.x + 0.6 * theme.font, cell.Center().y());
    FigureText text =
        NarrowText(PlainText(name, anchor, theme.font, theme.ink, TextAlign::kCenter), cell.height);
    text.angle = 90.0;
    sheet.page.Text(text);
  };
  for (std::size_t k = 0; k < figure.kinds.size(); ++k) {
    const FigureRect cell = CellOf(layout, sheet.area, 0, static_cast<int>(k));
    layout.flat ? above(figure.kinds[k].name, cell) : beside(figure.kinds[k].name, cell);
  }
  for (std::size_t i = 0; i < figure.objects.size(); ++i) {
    const FigureRect cell = CellOf(layout, sheet.area, static_cast<int>(i), 0);
    layout.flat ? beside(figure.objects[i].name, cell) : above(figure.objects[i].name, cell);
  }
}

}  // namespace

FigurePage DrawComparison(const CompareFigure& figure, const FigureOptions& options,
                          const FigureProgress& progress) {
  if (figure.objects.empty() || figure.kinds.empty()) {
    throw UsageError("nothing to compare, expected at least one object and one kind of solid");
  }
  const double own_width = figure.objects.size() <= 2 ? kColumnWidth : kTextWidth;
  FigureSheet sheet = MakeSheet(options, own_width, "Objects as different solids", [&](double width) {
    return HeightOf(LayOut(figure, FigureTheme(options), width));
  });
  CompareLayout layout = LayOut(figure, sheet.theme, sheet.area.width);
  layout.height += (sheet.area.height - HeightOf(layout)) / layout.rows;  // where the height was asked for
  if (layout.height < 8.0) {
    throw UsageError("the figure is too low for its pictures, expected a larger height");
  }
  std::map<std::string, Eigen::Vector3d> colors;
  for (const CompareFigure::Kind& kind : figure.kinds) {
    colors[kind.name] = kind.color;
  }
  PictureRenderer renderer(
      PanelOptions(options, sheet.page.dpi, layout.cell - layout.gap, layout.height, colors));
  const double aspect = (layout.cell - layout.gap) / layout.height;
  const int kinds = static_cast<int>(figure.kinds.size());
  if (progress) {
    progress(0, static_cast<int>(figure.objects.size()) * kinds);
  }
  for (int i = 0; i < static_cast<int>(figure.objects.size()); ++i) {
    const CompareFigure::Object& object = figure.objects[static_cast<std::size_t>(i)];
    const ViewCamera eye = options.camera.ApplyTo(EyeOn(object, figure.kinds.front(), aspect));
    for (int k = 0; k < kinds; ++k) {
      const auto at = static_cast<std::size_t>(k);
      const MapSnapshot map = WithSolid(object, figure.kinds[at], object.solids.at(at));
      k == 0 ? renderer.SetMap(map) : renderer.SetMapKeepingFrame(map);
      const FigureRect cell = CellOf(layout, sheet.area, i, k);
      PlacePanel(sheet.page, renderer.Render(eye), cell);
      if (!object.notes.empty()) {
        const Eigen::Vector2d anchor(cell.Center().x(), cell.Bottom() + 0.8 * sheet.theme.small);
        sheet.page.Text(NarrowText(
            PlainText(object.notes.at(at), anchor, sheet.theme.small, sheet.theme.muted, TextAlign::kCenter),
            cell.width));
      }
      if (progress) {
        progress(i * kinds + k + 1, static_cast<int>(figure.objects.size()) * kinds);
      }
    }
  }
  DrawNames(sheet, layout, figure);
  return std::move(sheet.page);
}

}  // namespace sqslam
