#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <string_view>

#include "render/figures/figure_input.h"
#include "render/picture/picture.h"
#include "slam/fitting/fixed_shape_fit.h"
#include "slam/fitting/surface_measures.h"
#include "slam/geometry/nearest_solid.h"
#include "slam/snapshot/snapshot.h"
#include "slam/util/statistics.h"
#include "slam/util/throw_if.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace {

// Returns a map of the object's points and one of its solids.
MapSnapshot WithSolid(const CompareFigure::Object& object, const CompareFigure::Kind& kind,
                      const PosedSuperquadric& solid) {
  MapSnapshot map = object.map;
  map.support_height.reset();  // so that the grid lies just below the object
  map.T_map_camera.reset();
  SnapshotObject drawn;
  drawn.label = kind.name;
  drawn.superquadric = solid;
  map.objects = {drawn};
  return map;
}

// One column per object, one row per kind of solid; for a single object, one column per kind.
PanelGrid LayOutComparison(const CompareFigure& figure, const FigureTheme& theme, double width) {
  const int objects = static_cast<int>(figure.objects.size());
  const int kinds = static_cast<int>(figure.kinds.size());
  PanelGrid grid{objects == 1 ? kinds : objects, objects == 1 ? 1 : kinds, 4.0};
  grid.left = grid.top = 1.8 * theme.font;
  grid.width = (width - grid.left) / grid.columns - grid.gap;
  grid.height = 0.85 * grid.width;
  const bool notes =
      std::ranges::any_of(figure.objects, [](const auto& object) { return !object.notes.empty(); });
  grid.texts = notes ? 1.6 * theme.small : 0.0;
  grid.below = grid.gap;
  return grid;
}

}  // namespace

FigurePage DrawComparison(const CompareFigure& figure, const FigureOptions& options) {
  ThrowIf<UsageError>(figure.objects.empty() || figure.kinds.empty(),
                      "nothing to compare, expected at least one object and one kind of solid");
  PanelSheet sheet = MakePanelSheet(
      options, figure.objects.size() <= 2 ? kColumnWidth : kTextWidth, "Objects as different solids",
      [&](double width, const FigureTheme& theme) { return LayOutComparison(figure, theme, width); });
  const PanelGrid& grid = sheet.grid;
  const FigureTheme& theme = sheet.theme;
  PictureOptions panels = PanelOptions(options, sheet);
  for (const CompareFigure::Kind& kind : figure.kinds) {
    panels.style.objects.colors[kind.name] = FormatColor(kind.color);
  }
  PictureRenderer renderer(panels);
  const bool one_row = figure.objects.size() == 1;
  const int kinds = static_cast<int>(figure.kinds.size());
  const int total = static_cast<int>(figure.objects.size()) * kinds;
  options.Tell(0, total);
  ViewCamera eye;  // on the object
  for (int i = 0; i < total; ++i) {
    const CompareFigure::Object& object = figure.objects[static_cast<std::size_t>(i / kinds)];
    const auto kind = static_cast<std::size_t>(i % kinds);
    const MapSnapshot map = WithSolid(object, figure.kinds[kind], object.solids.at(kind));
    if (kind == 0) {
      renderer.SetMap(map);
      eye =
          options.camera.ApplyTo(EyeOn(map, object.solids, PositionsOf(map), 1.5, grid.width / grid.height));
    } else {
      renderer.SetMapKeepingFrame(map);
    }
    const FigureRect cell = one_row ? sheet.PanelAt(0, i) : sheet.PanelAt(i % kinds, i / kinds);
    PlacePanel(sheet.page, renderer.Render(eye), cell);
    if (!object.notes.empty()) {
      sheet.page.Label(object.notes.at(kind), {cell.Center().x(), cell.Bottom() + 0.8 * theme.small},
                       theme.small, theme.muted, cell.width);
    }
    options.Tell(i + 1, total);
  }
  for (int k = 0; k < kinds; ++k) {
    const std::string& name = figure.kinds[static_cast<std::size_t>(k)].name;
    one_row ? sheet.NameColumn(k, name) : sheet.NameRow(k, name);
  }
  for (int i = 0; i < total / kinds; ++i) {
    const std::string& name = figure.objects[static_cast<std::size_t>(i)].name;
    one_row ? sheet.NameRow(i, name) : sheet.NameColumn(i, name);
  }
  return std::move(sheet.page);
}

namespace {

struct CompareOptions {
  std::vector<std::string> kinds;
  std::string sizes = "nearest";
  bool values = false;
  void VisitFields(auto&& visit) {
    visit("--as SHAPE", "Only superquadric, ellipsoid or cuboid; may be repeated", kinds);
    visit("--sizes NAME", "nearest to the map's object, or fitted to its points", sizes,
          OptionWords{"nearest", "fitted"});
    visit("--values", "Distance of the points below each solid", values);
  }
};

struct ComparedSolid {
  std::string_view name;
  const char* shown;
  const char* color;
  SolidKind kind;  // determines the exponents
};
constexpr ComparedSolid kComparedSolids[] = {
    {"superquadric", "Superquadric", "#009e73", SolidKind::kSuperquadric},
    {"ellipsoid", "Ellipsoid", "#0072b2", SolidKind::kEllipsoid},
    {"cuboid", "Cuboid", "#e69f00", SolidKind::kCuboid}};

std::vector<ComparedSolid> ChosenSolids(const std::vector<std::string>& names) {
  for (const std::string& name : names) {
    ThrowIf<UsageError>(
        std::ranges::find(kComparedSolids, name, &ComparedSolid::name) == std::end(kComparedSolids),
        "--as {}: expected superquadric, ellipsoid or cuboid", name);
  }
  std::vector<ComparedSolid> chosen;
  std::ranges::copy_if(kComparedSolids, std::back_inserter(chosen), [&](const ComparedSolid& solid) {
    return names.empty() || std::ranges::find(names, solid.name) != names.end();
  });
  return chosen;
}

// Selects up to four objects of different classes, only reliable ones if there are any: first the one with
// the most points, then repeatedly, among those with enough points, the one whose exponents are farthest from
// all selected before.
std::vector<int> MostDifferent(const MapSnapshot& map) {
  const auto exponents = [](const SnapshotObject& object) {
    return Eigen::Vector2d(object.superquadric.shape.e1, object.superquadric.shape.e2);
  };
  std::vector<const SnapshotObject*> ranked = ReliableObjects(map);
  std::ranges::stable_sort(ranked, [](const auto* a, const auto* b) { return a->points > b->points; });
  constexpr int kMinPoints = 15;
  std::vector<const SnapshotObject*> taken = {ranked.front()};
  while (taken.size() < 4) {
    const SnapshotObject* next = nullptr;
    double farthest = -1.0;
    for (const SnapshotObject* object : ranked) {
      double distance = std::numeric_limits<double>::infinity();
      for (const SnapshotObject* other : taken) {
        const bool same_class = other->label == object->label;
        distance = std::min(distance, same_class ? -1.0 : (exponents(*object) - exponents(*other)).norm());
      }
      if (object->points >= kMinPoints && distance > farthest) {
        next = object;
        farthest = distance;
      }
    }
    if (next == nullptr) {
      break;
    }
    taken.push_back(next);
  }
  std::vector<int> ids = ToVector(taken, &SnapshotObject::id);
  std::ranges::sort(ids);
  return ids;
}

PosedSuperquadric As(const ComparedSolid& kind, const PosedSuperquadric& object,
                     const std::vector<Eigen::Vector3d>& points, const std::string& sizes) {
  const PosedSuperquadric nearest = NearestOfKind(kind.kind, object);
  return sizes == "fitted" ? FitPlaceAndSize(points, nearest) : nearest;
}

std::string DistanceNote(const PosedSuperquadric& solid, const std::vector<Eigen::Vector3d>& points,
                         double mean_half_size) {
  if (points.empty()) {
    return "no points";
  }
  const SurfaceDistance distance(solid.shape);
  const Rigid3d T_object_map = solid.T_map_object.Inverse();
  std::vector<double> distances =
      ToVector(points, [&](const Eigen::Vector3d& p) { return std::abs(distance(T_object_map * p)); });
  const double median = UpperMedian(std::move(distances));
  return fmt::format("median {:.2g} ({:.0f} %)", median, 100.0 * median / mean_half_size);
}

CompareFigure::Object Compared(const MapSnapshot& map, const SnapshotObject& object,
                               const std::vector<ComparedSolid>& solids, const Eigen::Vector3d& ink,
                               const CompareOptions& options) {
  CompareFigure::Object compared;
  compared.name = ReadableLabel(ShownName(object));
  compared.map = map;
  std::erase_if(compared.map.points,
                [&](const SnapshotPoint& point) { return point.object_id != object.id; });
  const std::vector<Eigen::Vector3d> points = PositionsOf(compared.map);
  for (SnapshotPoint& point : compared.map.points) {  // own colours are hard to see on solids
    for (int c = 0; c < 3; ++c) {
      point.rgb[static_cast<std::size_t>(c)] = static_cast<std::uint8_t>(std::lround(255.0 * ink[c]));
    }
  }
  for (const ComparedSolid& solid : solids) {
    compared.solids.push_back(As(solid, object.superquadric, points, options.sizes));
    if (options.values) {
      compared.notes.push_back(
          DistanceNote(compared.solids.back(), points, object.superquadric.shape.half_size.mean()));
    }
  }
  return compared;
}

FigurePage DrawComparisonOf(const FigureRequest& request, const CompareOptions& options) {
  const std::string& result = request.results.front();
  const MapSnapshotPtr map = OpenObjectMap(request, result).last;
  const std::vector<ComparedSolid> solids = ChosenSolids(options.kinds);
  CompareFigure figure;
  for (const ComparedSolid& solid : solids) {
    figure.kinds.push_back({solid.shown, ParseColor(solid.color)});
  }
  const Eigen::Vector3d ink = ParseColor(request.page.style.text.color);
  for (const int id : request.objects.empty() ? MostDifferent(*map) : request.objects) {
    figure.objects.push_back(Compared(*map, ObjectById(*map, id, result), solids, ink, options));
  }
  return DrawComparison(figure, request.page);
}

}  // namespace

FigureEntry CompareEntry() {
  return FigureEntry{.name = "compare",
                     .help = "Objects as superquadric, ellipsoid and cuboid",
                     .details = R"(
Each object over its map points as a superquadric, an ellipsoid (both exponents 1) and a cuboid (both exponents
0.1), seen from the same place. Without --object: the reliable object with the most points, and up to three of
other classes whose exponents differ most.

--sizes nearest gives each solid the size that shares the most space with the map's object, as --representation
does in a run. --sizes fitted moves and scales
each solid, in the object's orientation, to the object's points (robust least squares of the distances; sides
without points keep those of the nearest). --values writes the median distance of the points to each surface
below it, in map units and as a share of the object's mean half size.

Examples:
  sqslam figure compare out/desk -o compare.pdf
  sqslam figure compare out/desk --object 2 --object 10 --sizes fitted --values -o compare.png
  sqslam figure compare out/desk --object 1 --camera-azimuth-angle 40 --set objects.opacity=0.9 -o box.png
)",
                     .results_help = kMapHelp,
                     .maps = true,
                     .objects = true,
                     .pictures = true,
                     .view = true,
                     .adapt_style =
                         [](SceneStyle& style) {
                           style.objects.opacity = 0.6;  // points inside stay visible
                           style.cameras.trajectory = style.cameras.keyframes = style.cameras.current = false;
                           style.points.object_size = 10.0;
                           style.grid.show = false;
                         }}
      .DrawnBy(DrawComparisonOf);
}

}  // namespace sqslam
