#include <fmt/format.h>

#include <algorithm>

#include "render/figures/figure_input.h"
#include "slam/snapshot/snapshot.h"
#include "slam/util/largest.h"
#include "slam/util/throw_if.h"

// Input of the outliers figure: the fate of each point, and the image that shows it best.
namespace sqslam {
namespace {

struct OutliersOptions {
  bool no_images = false;
  void VisitFields(auto&& visit) { visit("--no-images", "Points around the solids only", no_images); }
};

std::vector<OutliersFigure::Point> PointsWithFate(const MapSnapshot& map, int id) {
  std::vector<OutliersFigure::Point> points;
  for (const SnapshotPoint& point : map.points) {
    const bool kept = point.object_id == id;
    if (!kept && point.rejected_by != id) {
      continue;
    }
    // The score of a point that now belongs to another object refers to that object.
    const double anomaly = kept || point.object_id < 0 ? point.anomaly : 0.0;
    points.push_back({point.p_map.cast<double>(), anomaly,
                      kept            ? OutliersFigure::Fate::kKept
                      : anomaly > 0.0 ? OutliersFigure::Fate::kIsolated
                                      : OutliersFigure::Fate::kRemovedBefore,
                      std::nullopt});
  }
  return points;
}

// Selects up to three objects with the most isolated points; ties go to more kept points. Only reliable
// objects and objects with an image count, if there are any.
std::vector<int> MostTelling(const MapSnapshot& map, const std::map<int, std::vector<ObjectView>>& views) {
  struct Ranked {
    std::ptrdiff_t isolated;
    const SnapshotObject* object;
  };
  std::vector<Ranked> ranked;
  for (const SnapshotObject& object : map.objects) {
    const std::vector<OutliersFigure::Point> points = PointsWithFate(map, object.id);
    const auto isolated = std::ranges::count_if(points, [](const OutliersFigure::Point& point) {
      return point.fate == OutliersFigure::Fate::kIsolated;
    });
    ranked.push_back({isolated, &object});
  }
  const auto prefer = [&ranked](const auto& good) {
    if (std::ranges::any_of(ranked, [&](const Ranked& r) { return good(*r.object); })) {
      std::erase_if(ranked, [&](const Ranked& r) { return !good(*r.object); });
    }
  };
  prefer(IsReliable);
  prefer([&views](const SnapshotObject& object) { return views.contains(object.id); });
  std::ranges::stable_sort(ranked, [](const Ranked& a, const Ranked& b) {
    return std::pair(a.isolated, a.object->points) > std::pair(b.isolated, b.object->points);
  });
  std::vector<int> ids;
  for (std::size_t i = 0; i < std::min<std::size_t>(3, ranked.size()); ++i) {
    ids.push_back(ranked[i].object->id);
  }
  std::ranges::sort(ids);
  return ids;
}

std::vector<OutliersFigure::Point> ProjectedPoints(std::vector<OutliersFigure::Point> points,
                                                   const ObjectView& view, const Camera& camera) {
  const Rigid3d T_camera_map = view.T_map_camera.Inverse();
  for (OutliersFigure::Point& point : points) {
    const Eigen::Vector3d p = T_camera_map * point.p_map;
    if (p.z() <= 0.0) {
      continue;
    }
    const Eigen::Vector2d pixel = camera.ProjectDistorted(p);
    if (pixel.x() >= 0.0 && pixel.y() >= 0.0 && pixel.x() < camera.width && pixel.y() < camera.height) {
      point.pixel = pixel;
    }
  }
  return points;
}

// Returns the view in which most removed points lie near the box but outside it, ignoring views with much
// smaller boxes than the largest.
const ObjectView& ClearestView(const std::vector<ObjectView>& views,
                               const std::vector<OutliersFigure::Point>& points, const Camera& camera) {
  constexpr double kLarge = 0.4;  // of the largest box's area
  constexpr double kNear = 0.35;  // of the box; the margin that the figure shows
  const double largest = Largest(views, 0.0, [](const ObjectView& view) { return view.box.Area(); });
  const ObjectView* best = &views.front();
  std::ptrdiff_t most = -1;
  for (const ObjectView& view : views) {
    const std::vector<OutliersFigure::Point> projected = ProjectedPoints(points, view, camera);
    const double margin = kNear * std::max(view.box.width, view.box.height);
    const auto outside = std::ranges::count_if(projected, [&](const OutliersFigure::Point& point) {
      return point.fate != OutliersFigure::Fate::kKept && point.pixel && !view.box.Contains(*point.pixel) &&
             view.box.Contains(*point.pixel, margin);
    });
    if (view.box.Area() >= kLarge * largest && outside > most) {
      best = &view;
      most = outside;
    }
  }
  return *best;
}

OutliersFigure::Object ObjectWithFates(const MapSnapshot& map, const SnapshotObject& object) {
  OutliersFigure::Object shown;
  shown.name = ReadableLabel(object.label);
  shown.points = PointsWithFate(map, object.id);
  shown.map.camera = map.camera;
  shown.map.gravity_known = map.gravity_known;
  shown.map.keyframes = map.keyframes;
  shown.map.objects = {object};
  return shown;
}

FigurePage DrawOutliersOf(const FigureRequest& request, const OutliersOptions& options) {
  ThrowIf<UsageError>(options.no_images && !request.frames.empty(),
                      "--frame with --no-images: expected one of them");
  const std::string& result = request.results.front();
  const RecordedMap recorded = OpenObjectMap(result);
  const MapSnapshot& map = *recorded.last;
  if (std::ranges::none_of(map.points, [](const SnapshotPoint& point) {
        return point.anomaly > 0.0F || point.rejected_by >= 0;
      })) {
    throw InputError(
        "{}: does not say what outlier removal did, expected a map recorded by this version (sqslam run)",
        result);
  }
  std::map<int, std::vector<ObjectView>> views;
  if (!options.no_images) {
    views = ObjectViews(recorded, !request.frames.empty());
  }
  OutliersFigure figure;
  figure.threshold = ConfigOf(*recorded.reader).objects.outliers.isolation_forest.threshold;
  for (const int id : request.objects.empty() ? MostTelling(map, views) : request.objects) {
    OutliersFigure::Object shown = ObjectWithFates(map, ObjectById(map, id, result));
    if (!request.frames.empty() || !views[id].empty()) {
      const std::string what = fmt::format("{}: object {} ({})", result, id, shown.name);
      const ObjectView view = ClearestView(ViewsOfFrame(views[id], request, what), shown.points, map.camera);
      shown.image = ImageOf(view, recorded);
      shown.points = ProjectedPoints(std::move(shown.points), view, map.camera);
      shown.box = view.box;
      shown.quarter_turns = UprightTurns(view, map);
    }
    figure.objects.push_back(std::move(shown));
  }
  return DrawOutliers(figure, request.page, request.progress);
}

}  // namespace

FigureEntry OutliersEntry() {
  return {.name = "outliers",
          .help = "An object's inlier and outlier points",
          .details = R"(
Each object's map points at the end of the run: discs were kept; crosses were removed by the extended isolation
forest, their score above objects.outliers.isolation_forest.threshold; rings were removed before it, without a
score: seen in too few of the object's boxes, projected outside of them, on the surface below or within a smaller
object, or another object's now. Colour is the anomaly score; grey discs have none (clouds too small for the forest). A point that several
objects took away counts for the one in whose boxes it was seen most.

Above each, a keyframe with the detector's box and the same points: by default that in which most removed points
lie beside the box. Without --object: of the objects that are reliable and have an image, the three with the most
isolated points. The map must have been
recorded by a version that keeps this evidence (format 3 of map.sqmap); --no-images leaves the images out.

Examples:
  sqslam figure outliers out/desk -o outliers.pdf
  sqslam figure outliers out/desk --object 2 --object 7 -o outliers.png --dpi 600
  sqslam figure outliers out/desk --object 2 --frame 120 --camera-azimuth-angle 40 -o outliers.png
  sqslam figure outliers out/desk --no-images --set objects.opacity=0.2 -o outliers.svg
)",
          .results_help = kMapOfARun,
          .objects = true,
          .frames_help = kKeyframeShown,
          .pictures = true,
          .view = true,
          .adapt_style =
              [](SceneStyle& style) {
                style.objects.opacity = 0.35;
                style.cameras.trajectory = style.cameras.keyframes = style.cameras.current = false;
                style.grid.show = false;
                style.light.shadow = 0.0;  // it would be cut off at the panel's edge
              },
          .make = FigureEntry::Maker(DrawOutliersOf)};
}

}  // namespace sqslam
