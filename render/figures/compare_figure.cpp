#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "render/camera/scene_framing.h"
#include "render/figures/figure_input.h"
#include "render/figures/figures.h"
#include "render/picture/picture.h"
#include "render/picture/picture_text.h"
#include "slam/fitting/fixed_shape_fit.h"
#include "slam/fitting/surface_measures.h"
#include "slam/util/error.h"
#include "slam/util/statistics.h"

namespace sqslam {
namespace {

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
ViewCamera EyeOnCompared(const CompareFigure::Object& object, const CompareFigure::Kind& kind,
                         double aspect) {
  std::vector<Eigen::Vector3d> outline;
  for (const PosedSuperquadric& solid : object.solids) {
    const std::array<Eigen::Vector3d, 8> corners = BoxCorners(solid);
    outline.insert(outline.end(), corners.begin(), corners.end());
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

CompareLayout LayOutComparison(const CompareFigure& figure, const FigureTheme& theme, double width) {
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

double ComparisonHeight(const CompareLayout& layout) {
  return layout.top + layout.rows * (layout.height + layout.note + layout.gap);
}

FigureRect ComparisonCell(const CompareLayout& layout, const FigureRect& area, int object, int kind) {
  const int column = layout.flat ? kind : object;
  const int row = layout.flat ? 0 : kind;
  return {area.x + layout.left + column * layout.cell,
          area.y + layout.top + row * (layout.height + layout.note + layout.gap), layout.cell - layout.gap,
          layout.height};
}

// Columns are named above, rows at the left.
void DrawComparedNames(FigureSheet& sheet, const CompareLayout& layout, const CompareFigure& figure) {
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
    const FigureRect cell = ComparisonCell(layout, sheet.area, 0, static_cast<int>(k));
    layout.flat ? above(figure.kinds[k].name, cell) : beside(figure.kinds[k].name, cell);
  }
  for (std::size_t i = 0; i < figure.objects.size(); ++i) {
    const FigureRect cell = ComparisonCell(layout, sheet.area, static_cast<int>(i), 0);
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
    return ComparisonHeight(LayOutComparison(figure, FigureTheme(options), width));
  });
  CompareLayout layout = LayOutComparison(figure, sheet.theme, sheet.area.width);
  layout.height +=
      (sheet.area.height - ComparisonHeight(layout)) / layout.rows;  // where the height was asked for
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
  Tell(progress, 0, static_cast<int>(figure.objects.size()) * kinds);
  for (int i = 0; i < static_cast<int>(figure.objects.size()); ++i) {
    const CompareFigure::Object& object = figure.objects[static_cast<std::size_t>(i)];
    const ViewCamera eye = options.camera.ApplyTo(EyeOnCompared(object, figure.kinds.front(), aspect));
    for (int k = 0; k < kinds; ++k) {
      const auto at = static_cast<std::size_t>(k);
      const MapSnapshot map = WithSolid(object, figure.kinds[at], object.solids.at(at));
      k == 0 ? renderer.SetMap(map) : renderer.SetMapKeepingFrame(map);
      const FigureRect cell = ComparisonCell(layout, sheet.area, i, k);
      PlacePanel(sheet.page, renderer.Render(eye), cell);
      if (!object.notes.empty()) {
        const Eigen::Vector2d anchor(cell.Center().x(), cell.Bottom() + 0.8 * sheet.theme.small);
        sheet.page.Text(NarrowText(
            PlainText(object.notes.at(at), anchor, sheet.theme.small, sheet.theme.muted, TextAlign::kCenter),
            cell.width));
      }
      Tell(progress, i * kinds + k + 1, static_cast<int>(figure.objects.size()) * kinds);
    }
  }
  DrawComparedNames(sheet, layout, figure);
  return std::move(sheet.page);
}

namespace {

struct CompareOptions {
  std::vector<std::string> kinds;
  std::string sizes = "same";
  bool values = false;
  template <typename Visitor>
  void VisitFields(Visitor&& visit) {
    visit("--as SHAPE", "Only superquadric, ellipsoid or cuboid; may be repeated", kinds);
    visit("--sizes NAME", "same as the map's object, or fitted to its points", sizes, {"same", "fitted"});
    visit("--values", "Distance of the points below each solid", values);
  }
};

struct ComparedSolid {
  const char* name;
  const char* shown;
  const char* color;
  std::optional<double> exponent;  // instead of the object's own
};
constexpr ComparedSolid kComparedSolids[] = {{"superquadric", "Superquadric", "#009e73", std::nullopt},
                                             {"ellipsoid", "Ellipsoid", "#0072b2", 1.0},
                                             {"cuboid", "Cuboid", "#e69f00", kMinShapeExponent}};

std::vector<ComparedSolid> ChosenSolids(const std::vector<std::string>& names) {
  std::vector<ComparedSolid> chosen;
  for (const ComparedSolid& solid : kComparedSolids) {
    if (names.empty() || std::find(names.begin(), names.end(), solid.name) != names.end()) {
      chosen.push_back(solid);
    }
  }
  for (const std::string& name : names) {
    if (std::none_of(std::begin(kComparedSolids), std::end(kComparedSolids),
                     [&name](const ComparedSolid& solid) { return name == solid.name; })) {
      throw UsageError(fmt::format("--as {}: expected superquadric, ellipsoid or cuboid", name));
    }
  }
  return chosen;
}

std::vector<Eigen::Vector3d> OwnPoints(const MapSnapshot& map, int id) {
  std::vector<Eigen::Vector3d> points;
  for (const SnapshotPoint& point : map.points) {
    if (point.object_id == id) {
      points.push_back(point.p_map.cast<double>());
    }
  }
  return points;
}

// Up to four objects of different classes and exponents: that with the most points, then always the one whose
// exponents are farthest from all taken before, among those with a fair number of points.
std::vector<int> MostDifferent(const MapSnapshot& map) {
  const auto exponents = [](const SnapshotObject& object) {
    return Eigen::Vector2d(object.superquadric.shape.e1, object.superquadric.shape.e2);
  };
  std::vector<const SnapshotObject*> ranked;
  for (const SnapshotObject& object : map.objects) {
    ranked.push_back(&object);
  }
  std::stable_sort(ranked.begin(), ranked.end(),
                   [](const auto* a, const auto* b) { return a->points > b->points; });
  constexpr int kFairPoints = 15;
  std::vector<const SnapshotObject*> taken = {ranked.front()};
  while (taken.size() < 4) {
    const SnapshotObject* next = nullptr;
    double farthest = -1.0;
    for (const SnapshotObject* object : ranked) {
      double distance = std::numeric_limits<double>::infinity();
      for (const SnapshotObject* other : taken) {
        const double apart = (exponents(*object) - exponents(*other)).norm();
        distance = std::min(distance, other->label == object->label ? -1.0 : apart);
      }
      if (object->points >= kFairPoints && distance > farthest) {
        next = object;
        farthest = distance;
      }
    }
    if (next == nullptr) {
      break;
    }
    taken.push_back(next);
  }
  std::vector<int> ids;
  for (const SnapshotObject* object : taken) {
    ids.push_back(object->id);
  }
  std::sort(ids.begin(), ids.end());
  return ids;
}

PosedSuperquadric As(const ComparedSolid& kind, const PosedSuperquadric& object,
                     const std::vector<Eigen::Vector3d>& points, bool fitted) {
  PosedSuperquadric solid = object;
  solid.shape.e1 = kind.exponent.value_or(object.shape.e1);
  solid.shape.e2 = kind.exponent.value_or(object.shape.e2);
  return fitted ? FitPlaceAndSize(points, solid) : solid;
}

std::string DistanceNote(const PosedSuperquadric& solid, const std::vector<Eigen::Vector3d>& points,
                         double mean_half_size) {
  if (points.empty()) {
    return "no points";
  }
  const SurfaceDistance distance(solid.shape);
  const Rigid3d T_object_map = solid.T_map_object.Inverse();
  std::vector<double> distances;
  for (const Eigen::Vector3d& p : points) {
    distances.push_back(std::abs(distance(T_object_map * p)));
  }
  const double median = UpperMedian(std::move(distances));
  return fmt::format("median {:.2g} ({:.0f} %)", median, 100.0 * median / mean_half_size);
}

CompareFigure::Object Compared(const MapSnapshot& map, const SnapshotObject& object,
                               const std::vector<ComparedSolid>& solids, const Eigen::Vector3d& ink,
                               const CompareOptions& options) {
  const std::vector<Eigen::Vector3d> points = OwnPoints(map, object.id);
  CompareFigure::Object compared;
  compared.name = ReadableLabel(object.label);
  compared.map = map;
  std::erase_if(compared.map.points,
                [&](const SnapshotPoint& point) { return point.object_id != object.id; });
  for (SnapshotPoint& point : compared.map.points) {  // dots of their own colours get lost on the solids
    for (int c = 0; c < 3; ++c) {
      point.rgb[static_cast<std::size_t>(c)] = static_cast<std::uint8_t>(std::lround(255.0 * ink[c]));
    }
  }
  for (const ComparedSolid& solid : solids) {
    compared.solids.push_back(As(solid, object.superquadric, points, options.sizes == "fitted"));
    if (options.values) {
      compared.notes.push_back(
          DistanceNote(compared.solids.back(), points, object.superquadric.shape.half_size.mean()));
    }
  }
  return compared;
}

FigurePage DrawComparisonOf(const FigureRequest& request, const CompareOptions& options) {
  const std::string& result = request.results.front();
  const MapSnapshotPtr map = OpenObjectMap(result).last;
  const std::vector<ComparedSolid> solids = ChosenSolids(options.kinds);
  CompareFigure figure;
  for (const ComparedSolid& solid : solids) {
    figure.kinds.push_back({solid.shown, ParseColor(solid.color)});
  }
  const Eigen::Vector3d ink = ParseColor(request.page.style.text.color);
  for (const int id : request.objects.empty() ? MostDifferent(*map) : request.objects) {
    figure.objects.push_back(Compared(*map, ObjectById(*map, id, result), solids, ink, options));
  }
  return DrawComparison(figure, request.page, request.progress);
}

}  // namespace

FigureEntry CompareEntry() {
  return {.name = "compare",
          .help = "Objects as superquadric, ellipsoid and cuboid",
          .details = R"(
Each object over its map points as a superquadric, an ellipsoid (a quadric: both exponents 1) and a cuboid (both
exponents 0.1), seen from the same place. Without --object: the object with the most points and up to three of
other classes whose exponents differ most.

--sizes same gives all three the place and size of the map's object, as --representation does in a run; it shows
what the exponents alone are worth. --sizes fitted moves and scales each of the three, in the object's
orientation, until its surface is as near as possible to the object's points (robust least squares of the
distances; sides that no point shows keep the object's), so that each shape is at its best. --values writes the
median distance of the points to each surface below it, in map units and as a share of the object's mean half
size.

Examples:
  sqslam figure compare out/desk -o compare.pdf
  sqslam figure compare out/desk --object 2 --object 10 --sizes fitted --values -o compare.png
  sqslam figure compare out/desk --object 1 --camera-azimuth-angle 40 --set objects.opacity=0.9 -o box.png
)",
          .results_help = kMapOfARun,
          .objects = true,
          .pictures = true,
          .view = true,
          .adapt_style =
              [](SceneStyle& style) {
                style.objects.opacity = 0.6;  // points inside shine through
                style.cameras.trajectory = false;
                style.cameras.keyframes = false;
                style.cameras.current = false;
                style.points.object_size = 10.0;
                style.grid.show = false;
              },
          .make = FigureEntry::Maker(DrawComparisonOf)};
}

}  // namespace sqslam
