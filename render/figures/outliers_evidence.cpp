#include <fmt/format.h>

#include <algorithm>
#include <functional>

#include "render/figures/figure_input.h"
#include "slam/snapshot/snapshot.h"
#include "slam/util/largest.h"
#include "slam/util/throw_if.h"
#include "slam/util/to_vector.h"

// Input of the outliers figure: the fate of each point, and the image that shows it best.
namespace sqslam {
namespace {

using PointFate = OutliersFigure::Fate;
using FatedPoint = OutliersFigure::Point;

struct OutliersOptions {
  bool no_images = false;
  void VisitFields(auto&& visit) { visit("--no-images", "Points around the solids only", no_images); }
};

std::vector<FatedPoint> PointsWithFate(const MapSnapshot& map, int id) {
  std::vector<FatedPoint> points;
  for (const SnapshotPoint& point : map.points) {
    const bool kept = point.object_id == id;
    if (!kept && point.rejected_by != id) {
      continue;
    }
    // The score of a point that now belongs to another object refers to that object.
    const double anomaly = kept || point.object_id < 0 ? point.anomaly : 0.0;
    points.push_back({point.p_map.cast<double>(), anomaly,
                      kept            ? PointFate::kKept
                      : anomaly > 0.0 ? PointFate::kIsolated
                                      : PointFate::kRemovedBefore,
                      std::nullopt});
  }
  return points;
}

// Selects up to three objects with the most isolated points; ties go to more kept points. Only reliable
// objects and objects with an image count, if there are any.
std::vector<int> MostTelling(const MapSnapshot& map, const std::map<int, std::vector<ObjectView>>& views) {
  std::vector<const SnapshotObject*> ranked = ReliableObjects(map);
  const auto has_image = [&views](const SnapshotObject* object) { return views.contains(object->id); };
  if (std::ranges::any_of(ranked, has_image)) {
    std::erase_if(ranked, std::not_fn(has_image));
  }
  std::ranges::stable_sort(ranked, std::greater(), [&map](const SnapshotObject* object) {
    const auto isolated =
        std::ranges::count(PointsWithFate(map, object->id), PointFate::kIsolated, &FatedPoint::fate);
    return std::pair(isolated, object->points);
  });
  ranked.resize(std::min<std::size_t>(3, ranked.size()));
  std::vector<int> ids = ToVector(ranked, &SnapshotObject::id);
  std::ranges::sort(ids);
  return ids;
}

// Sets the pixels of the points that the view shows.
void ProjectPoints(const ObjectView& view, const Camera& camera, std::vector<FatedPoint>& points) {
  const Rigid3d T_camera_map = view.T_map_camera.Inverse();
  const Box2d image{0.0, 0.0, camera.width - 1e-9, camera.height - 1e-9};
  for (FatedPoint& point : points) {
    const Eigen::Vector3d p = T_camera_map * point.p_map;
    point.pixel.reset();
    if (p.z() > 0.0 && image.Contains(camera.ProjectDistorted(p))) {
      point.pixel = camera.ProjectDistorted(p);
    }
  }
}

// Returns the view in which most removed points lie near the box but outside it, ignoring views with much
// smaller boxes than the largest.
const ObjectView& ClearestView(const std::vector<ObjectView>& views, std::vector<FatedPoint> points,
                               const Camera& camera) {
  constexpr double kMinAreaShare = 0.4;  // of the largest box
  const double largest = Largest(views, 0.0, [](const ObjectView& view) { return view.box.Area(); });
  return *std::ranges::max_element(views, {}, [&](const ObjectView& view) {
    ProjectPoints(view, camera, points);
    const double margin = kBoxMargin * std::max(view.box.width, view.box.height);
    const auto outside = std::ranges::count_if(points, [&](const FatedPoint& point) {
      return point.fate != PointFate::kKept && point.pixel && !view.box.Contains(*point.pixel) &&
             view.box.Contains(*point.pixel, margin);
    });
    return view.box.Area() >= kMinAreaShare * largest ? outside : -1;
  });
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
      ProjectPoints(view, map.camera, shown.points);
      shown.box = view.box;
      shown.quarter_turns = UprightTurns(view, map);
    }
    figure.objects.push_back(std::move(shown));
  }
  return DrawOutliers(figure, request.page);
}

}  // namespace

FigureEntry OutliersEntry() {
  return FigureEntry{.name = "outliers",
                     .help = "An object's inlier and outlier points",
                     .details = R"(
Each object's map points at the end of the run. Discs were kept. Crosses were removed by the extended isolation
forest: their score is above objects.outliers.isolation_forest.threshold. Rings were removed before it, without a
score: seen in too few of the object's boxes, projected outside of them, on the surface below, within a smaller
object, or now part of another object. Colour is the anomaly score; grey discs have none, as their cloud is too
small for the forest. A point that several objects removed counts for the one in whose boxes it was seen most.

Above each, a keyframe with the detector's box and the same points: by default the one in which most removed
points lie beside the box. Without --object: of the reliable objects with an image, the three with the most
isolated points. --no-images leaves the images out.

Examples:
  sqslam figure outliers out/desk -o outliers.pdf
  sqslam figure outliers out/desk --object 2 --object 7 -o outliers.png --dpi 600
  sqslam figure outliers out/desk --object 2 --frame 120 --camera-azimuth-angle 40 -o outliers.png
  sqslam figure outliers out/desk --no-images --set objects.opacity=0.2 -o outliers.svg
)",
                     .results_help = kMapHelp,
                     .objects = true,
                     .frames_help = kKeyframeHelp,
                     .pictures = true,
                     .view = true,
                     .adapt_style =
                         [](SceneStyle& style) {
                           style.objects.opacity = 0.35;
                           style.cameras.trajectory = style.cameras.keyframes = style.cameras.current = false;
                           style.grid.show = false;
                           style.light.shadow = 0.0;  // it would be cut off at the panel's edge
                         }}
      .DrawnBy(DrawOutliersOf);
}

}  // namespace sqslam
