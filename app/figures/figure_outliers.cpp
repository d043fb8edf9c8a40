#include <fmt/format.h>

#include <algorithm>
#include <memory>

#include "app/figures/figure_common.h"
#include "app/figures/object_views.h"
#include "app/result/map_input.h"
#include "render/figures/evidence_figures.h"
#include "render/page/panels.h"
#include "render/page/write_figure.h"
#include "slam/io/image_resize.h"
#include "slam/util/error.h"

namespace sqslam::app {
namespace {

constexpr const char* kOutliersFooter = R"(
Each object's map points at the end of the run: discs were kept; crosses were removed by the extended isolation
forest, their score above objects.outliers.isolation_forest.threshold; rings were removed before it, without a
score: seen in too few of the object's boxes, projected outside of them, on the surface below or within a smaller
object, or another object's now. Colour is the anomaly score; grey discs have none (clouds too small for the forest). A point that several
objects took away counts for the one in whose boxes it was seen most.

Above each, a keyframe with the detector's box and the same points: by default that in which most removed points
lie beside the box. Without --object: the three objects with the most isolated points. The map must have been
recorded by a version that keeps this evidence (format 3 of map.sqmap); --no-images leaves the images out.

Examples:
  sqslam figure outliers out/desk --output outliers.pdf
  sqslam figure outliers out/desk --object 2 --object 7 --output outliers.png --dpi 600
  sqslam figure outliers out/desk --object 2 --frame 120 --camera-azimuth-angle 40 --output outliers.png
  sqslam figure outliers out/desk --no-images --set objects.opacity=0.2 --output outliers.svg
)";

struct OutliersArguments : FigureArguments {
  std::string result;
  std::vector<int> objects;
  std::optional<std::int64_t> frame;
  bool no_images = false;
};

using Figure = OutliersFigure;

std::vector<Figure::Point> PointsWithFate(const MapSnapshot& map, int id) {
  std::vector<Figure::Point> points;
  for (const SnapshotPoint& point : map.points) {
    const bool kept = point.object_id == id;
    if (!kept && point.rejected_by != id) {
      continue;
    }
    // The score of another object's point is that object's.
    const double anomaly = kept || point.object_id < 0 ? point.anomaly : 0.0;
    points.push_back({point.p_map.cast<double>(), anomaly,
                      kept            ? Figure::Fate::kKept
                      : anomaly > 0.0 ? Figure::Fate::kIsolated
                                      : Figure::Fate::kRemovedBefore,
                      std::nullopt});
  }
  return points;
}

// Up to three with the most isolated points, then the most kept ones.
std::vector<int> MostIsolated(const MapSnapshot& map) {
  struct Ranked {
    std::ptrdiff_t isolated;
    int kept;
    int id;
  };
  std::vector<Ranked> ranked;
  for (const SnapshotObject& object : map.objects) {
    const std::vector<Figure::Point> points = PointsWithFate(map, object.id);
    const auto isolated = std::count_if(points.begin(), points.end(), [](const Figure::Point& point) {
      return point.fate == Figure::Fate::kIsolated;
    });
    ranked.push_back({isolated, object.points, object.id});
  }
  std::stable_sort(ranked.begin(), ranked.end(), [](const Ranked& a, const Ranked& b) {
    return std::pair(a.isolated, a.kept) > std::pair(b.isolated, b.kept);
  });
  std::vector<int> ids;
  for (std::size_t i = 0; i < std::min<std::size_t>(3, ranked.size()); ++i) {
    ids.push_back(ranked[i].id);
  }
  std::sort(ids.begin(), ids.end());
  return ids;
}

std::vector<Figure::Point> Projected(std::vector<Figure::Point> points, const ObjectView& view,
                                     const Camera& camera) {
  const Rigid3d T_camera_map = view.T_map_camera.Inverse();
  for (Figure::Point& point : points) {
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

// The view in which most removed points lie near the box but not in it; no small box where there are large
// ones.
const ObjectView& BestView(const std::vector<ObjectView>& views, const std::vector<Figure::Point>& points,
                           const Camera& camera) {
  constexpr double kLarge = 0.4;  // of the largest box's area
  constexpr double kNear = 0.35;  // of the box: what the figure shows
  double largest = 0.0;
  for (const ObjectView& view : views) {
    largest = std::max(largest, view.box.Area());
  }
  const ObjectView* best = &views.front();
  std::ptrdiff_t most = -1;
  for (const ObjectView& view : views) {
    const std::vector<Figure::Point> projected = Projected(points, view, camera);
    const double margin = kNear * std::max(view.box.width, view.box.height);
    const auto outside = std::count_if(projected.begin(), projected.end(), [&](const Figure::Point& point) {
      return point.fate != Figure::Fate::kKept && point.pixel && !view.box.Contains(*point.pixel) &&
             view.box.Contains(*point.pixel, margin);
    });
    if (view.box.Area() >= kLarge * largest && outside > most) {
      best = &view;
      most = outside;
    }
  }
  return *best;
}

void AddImage(const ObjectView& view, const MapSnapshot& map, Figure::Object& object) {
  object.image = ReadImageInSize(view.image_path, {map.camera.width, map.camera.height});
  if (object.image.cols != map.camera.width || object.image.rows != map.camera.height) {
    throw InputError(fmt::format("{}: {}x{} pixels, expected an image of {}x{}", view.image_path,
                                 object.image.cols, object.image.rows, map.camera.width, map.camera.height));
  }
  object.points = Projected(std::move(object.points), view, map.camera);
  object.box = view.box;
  object.quarter_turns = UprightTurns(view, map);
}

Figure::Object ShownObject(const MapSnapshot& map, const SnapshotObject& object) {
  Figure::Object shown;
  shown.name = ReadableLabel(object.label);
  shown.points = PointsWithFate(map, object.id);
  shown.map.camera = map.camera;
  shown.map.gravity_known = map.gravity_known;
  shown.map.keyframes = map.keyframes;
  shown.map.objects = {object};
  return shown;
}

void Draw(const OutliersArguments& a) {
  const FigureOptions options = MakeFigureOptions(a, [](SceneStyle& style) {
    style.objects.opacity = 0.35;
    style.cameras.trajectory = false;
    style.cameras.keyframes = false;
    style.cameras.current = false;
    style.grid.show = false;
    style.light.shadow = 0.0;  // it would end at the edge of the panel
  });
  if (a.no_images && a.frame) {
    throw UsageError("--frame with --no-images: expected one of them");
  }
  const RecordingReader reader(MapFile(a.result));
  const MapSnapshotPtr map = LastMap(a.result).map;
  if (map->objects.empty()) {
    throw InputError(fmt::format("{}: holds no object, expected a map with objects", a.result));
  }
  if (std::none_of(map->points.begin(), map->points.end(), [](const SnapshotPoint& point) {
        return point.anomaly > 0.0F || point.rejected_by >= 0;
      })) {
    throw InputError(fmt::format(
        "{}: does not say what outlier removal did, expected a map recorded by this version (sqslam run)",
        a.result));
  }
  std::map<int, std::vector<ObjectView>> views;
  if (!a.no_images) {
    views = ObjectViews(reader, *map, a.frame.has_value());
  }
  Figure figure;
  figure.threshold = ConfigOf(reader).objects.outliers.isolation_forest.threshold;
  for (const int id : a.objects.empty() ? MostIsolated(*map) : a.objects) {
    Figure::Object shown = ShownObject(*map, ObjectById(*map, id, a.result));
    if (a.frame || !views[id].empty()) {
      const std::string what = fmt::format("{}: object {} ({})", a.result, id, shown.name);
      AddImage(BestView(ViewsOfFrame(views[id], a.frame, what), shown.points, map->camera), *map, shown);
    }
    figure.objects.push_back(std::move(shown));
  }
  FigureCounter counter(a.quiet);
  WriteFigure(DrawOutliers(figure, options, std::ref(counter)), a.output);
}

}  // namespace

void AddOutliersFigure(CLI::App& figure) {
  const auto a = std::make_shared<OutliersArguments>();
  CLI::App* command =
      AddFigure(figure, "outliers", "Points that objects kept and that outlier removal took away",
                kOutliersFooter, FigureKind::kPanels, *a);
  command->add_option("RESULT", a->result, "Result folder of sqslam run, or its map.sqmap")->required();
  command->add_option("--object", a->objects, "Id of an object (sqslam info RESULT), repeatable")
      ->expected(1)
      ->take_all();
  command->add_option("--frame", a->frame, "Keyframe whose image is shown");
  command->add_flag("--no-images", a->no_images, "Points around the solids only");
  AddViewOptions(*command, *a);
  command->callback([a] { Draw(*a); });
}

}  // namespace sqslam::app
