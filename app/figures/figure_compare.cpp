#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include "app/figures/figure_common.h"
#include "app/figures/object_views.h"
#include "render/figures/panel_figures.h"
#include "render/page/panels.h"
#include "render/page/write_figure.h"
#include "slam/fitting/fixed_shape_fit.h"
#include "slam/fitting/surface_distance.h"
#include "slam/util/error.h"
#include "slam/util/statistics.h"

namespace sqslam::app {
namespace {

constexpr const char* kCompareFooter = R"(
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
  sqslam figure compare out/desk --output compare.pdf
  sqslam figure compare out/desk --object 2 --object 10 --sizes fitted --values --output compare.png
  sqslam figure compare out/desk --object 1 --camera-azimuth-angle 40 --set objects.opacity=0.9 --output box.png
)";

struct CompareArguments : FigureArguments {
  std::string result;
  std::vector<int> objects;
  std::vector<std::string> kinds;
  std::string sizes = "same";
  bool values = false;
};

struct Kind {
  const char* name;
  const char* shown;
  const char* color;
};
constexpr Kind kKinds[] = {{"superquadric", "Superquadric", "#009e73"},
                           {"ellipsoid", "Ellipsoid", "#0072b2"},
                           {"cuboid", "Cuboid", "#e69f00"}};

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

PosedSuperquadric As(const Kind& kind, const PosedSuperquadric& object,
                     const std::vector<Eigen::Vector3d>& points, bool fitted) {
  PosedSuperquadric solid = object;
  if (kind.name != std::string("superquadric")) {
    const double exponent = kind.name == std::string("ellipsoid") ? 1.0 : kMinShapeExponent;
    solid.shape.e1 = exponent;
    solid.shape.e2 = exponent;
  }
  return fitted ? FitPlaceAndSize(points, solid) : solid;
}

std::string Note(const PosedSuperquadric& solid, const std::vector<Eigen::Vector3d>& points,
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
                               const std::vector<Kind>& kinds, const Eigen::Vector3d& ink,
                               const CompareArguments& a) {
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
  for (const Kind& kind : kinds) {
    compared.solids.push_back(As(kind, object.superquadric, points, a.sizes == "fitted"));
    if (a.values) {
      compared.notes.push_back(
          Note(compared.solids.back(), points, object.superquadric.shape.half_size.mean()));
    }
  }
  return compared;
}

void Draw(const CompareArguments& a) {
  const FigureOptions options = MakeFigureOptions(a, [](SceneStyle& style) {
    style.objects.opacity = 0.6;  // points inside shine through
    style.cameras.trajectory = false;
    style.cameras.keyframes = false;
    style.cameras.current = false;
    style.points.object_size = 10.0;
    style.grid.show = false;
  });
  const MapSnapshotPtr map = LastMap(a.result).map;
  if (map->objects.empty()) {
    throw InputError(fmt::format("{}: holds no object, expected a map with objects", a.result));
  }
  std::vector<Kind> kinds;
  CompareFigure figure;
  for (const Kind& kind : kKinds) {
    if (a.kinds.empty() || std::find(a.kinds.begin(), a.kinds.end(), kind.name) != a.kinds.end()) {
      kinds.push_back(kind);
      figure.kinds.push_back({kind.shown, ParseColor(kind.color)});
    }
  }
  for (const int id : a.objects.empty() ? MostDifferent(*map) : a.objects) {
    figure.objects.push_back(
        Compared(*map, ObjectById(*map, id, a.result), kinds, ParseColor(options.style.text.color), a));
  }
  FigureCounter counter(a.quiet);
  WriteFigure(DrawComparison(figure, options, std::ref(counter)), a.output);
}

}  // namespace

void AddCompareFigure(CLI::App& figure) {
  const auto a = std::make_shared<CompareArguments>();
  CLI::App* command = AddFigure(figure, "compare", "Objects as superquadric, ellipsoid and cuboid",
                                kCompareFooter, FigureKind::kPanels, *a);
  command->add_option("RESULT", a->result, "Result folder of sqslam run, or its map.sqmap")->required();
  command->add_option("--object", a->objects, "Id of an object (sqslam info RESULT), repeatable")
      ->expected(1)
      ->take_all();
  command->add_option("--as", a->kinds, "Only superquadric, ellipsoid or cuboid, repeatable")
      ->check(CLI::IsMember({"superquadric", "ellipsoid", "cuboid"}))
      ->expected(1)
      ->take_all();
  command->add_option("--sizes", a->sizes, "same as the map's object, or fitted to its points")
      ->check(CLI::IsMember({"same", "fitted"}))
      ->capture_default_str();
  command->add_flag("--values", a->values, "Distance of the points below each solid");
  AddViewOptions(*command, *a);
  command->callback([a] { Draw(*a); });
}

}  // namespace sqslam::app
