#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

#include "render/figures/figure_input.h"
#include "render/page/chart.h"
#include "render/picture/picture.h"
#include "render/picture/picture_overlay.h"
#include "render/scene/color_scale.h"
#include "slam/snapshot/snapshot.h"
#include "slam/util/largest.h"
#include "slam/util/throw_if.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace {

using PointFate = OutliersFigure::Fate;
using FatedPoint = OutliersFigure::Point;

constexpr double kLegendHeight = 1.7;  // of the font size
constexpr double kNoteHeight = 1.3;
constexpr const char* kWithoutScore =
    "without score: taken away before the isolation forest, for being seen in too few of the object's boxes, "
    "beside them, or on another thing";

int CountOf(const OutliersFigure::Object& object, PointFate fate) {
  return static_cast<int>(std::ranges::count(object.points, fate, &FatedPoint::fate));
}

int CountOf(const OutliersFigure& figure, PointFate fate) {
  int count = 0;
  for (const OutliersFigure::Object& object : figure.objects) {
    count += CountOf(object, fate);
  }
  return count;
}

// Returns one axis for the scores of all objects.
ChartAxis ScoreAxis(const OutliersFigure& figure) {
  double low = figure.threshold > 0.0 ? figure.threshold : 1.0;
  double high = figure.threshold;
  for (const OutliersFigure::Object& object : figure.objects) {
    for (const FatedPoint& point : object.points) {
      if (point.anomaly > 0.0) {
        low = std::min(low, point.anomaly);
        high = std::max(high, point.anomaly);
      }
    }
  }
  return RoundAxis(std::min(low, high), std::max(low, high), 4, true);
}

// Draws a point as a disc, cross or ring according to its fate, in the colour of its score.
void DrawPoint(FigureSheet& sheet, const ChartAxis& axis, const Eigen::Vector2d& center,
               const FatedPoint& point, double size) {
  auto& [page, area, theme] = sheet;
  const Eigen::Vector3d color =
      point.anomaly > 0.0 ? Viridis((point.anomaly - axis.low) / (axis.high - axis.low)) : theme.muted;
  switch (point.fate) {
    case PointFate::kKept:
      page.Polygon(center, 20, 0.5 * size, color, FigureStroke{theme.ink, 0.1 * size, {}});
      break;
    case PointFate::kIsolated:
      page.Cross(center, 1.15 * size, {theme.ink, 0.52 * size, {}});
      page.Cross(center, 1.1 * size, {color, 0.3 * size, {}});
      break;
    case PointFate::kRemovedBefore:  // a dark ring on a light one is visible on any image
      page.Polygon(center, 20, 0.45 * size, {}, FigureStroke{theme.background, 0.4 * size, {}});
      page.Polygon(center, 20, 0.45 * size, {}, FigureStroke{theme.ink, 0.17 * size, {}});
      break;
  }
}

// Returns the size of marks in points; smaller if there are many.
double MarkSize(const OutliersFigure::Object& object, double usual) {
  constexpr double kUsualCount = 150.0;
  const double share =
      std::sqrt(kUsualCount / static_cast<double>(std::max<std::size_t>(1, object.points.size())));
  return std::min(4.0, usual) * std::clamp(share, 0.5, 1.0);
}

// Returns the note on points removed without a score; empty if there are none.
std::vector<std::string> NoteLines(const OutliersFigure& figure, const FigureTheme& theme, double width) {
  return CountOf(figure, PointFate::kRemovedBefore) > 0 ? WrappedText(kWithoutScore, theme.small, width)
                                                        : std::vector<std::string>();
}

PanelGrid LayOutOutliers(const OutliersFigure& figure, const FigureTheme& theme, double width) {
  PanelGrid grid = PanelGrid::Of(static_cast<int>(figure.objects.size()), 1, width);
  const bool images = std::ranges::any_of(figure.objects, [](const auto& o) { return !o.image.empty(); });
  grid.image = images ? 0.75 * grid.width : 0.0;
  grid.height = 0.85 * grid.width;
  grid.texts = 1.7 * theme.font + 1.6 * theme.small;
  const auto notes = static_cast<double>(NoteLines(figure, theme, width).size());
  grid.below = (kLegendHeight + 3.0 + kNoteHeight * notes) * theme.small;
  return grid;
}

void DrawImagePanel(FigureSheet& sheet, const OutliersFigure::Object& object, const FigureRect& panel,
                    const ChartAxis& axis) {
  if (object.image.empty()) {
    DrawNoImage(sheet, panel);
    return;
  }
  const Box2d& box = object.box;
  const double margin = kBoxMargin * std::max(box.width, box.height);
  const ImageCrop crop(object.image,
                       {box.x - margin, box.y - margin, box.width + 2.0 * margin, box.height + 2.0 * margin},
                       object.quarter_turns, panel);
  crop.Draw(sheet.page);
  const Eigen::Vector2d from(box.x, box.y), to(box.x + box.width, box.y + box.height);
  for (const FigureStroke& stroke :
       {FigureStroke{{0.0, 0.0, 0.0}, 1.8, {}}, FigureStroke{{1.0, 1.0, 1.0}, 0.9, {}}}) {
    crop.DrawLine(sheet.page, from, {to.x(), from.y()}, stroke);
    crop.DrawLine(sheet.page, {to.x(), from.y()}, to, stroke);
    crop.DrawLine(sheet.page, to, {from.x(), to.y()}, stroke);
    crop.DrawLine(sheet.page, {from.x(), to.y()}, from, stroke);
  }
  const double size = MarkSize(object, 0.027 * panel.width);
  for (const PointFate fate : {PointFate::kRemovedBefore, PointFate::kKept, PointFate::kIsolated}) {
    for (const FatedPoint& point : object.points) {
      if (point.fate == fate && point.pixel && crop.Contains(*point.pixel)) {
        DrawPoint(sheet, axis, crop.ToPage(*point.pixel), point, size);
      }
    }
  }
}

// Draws the points around the solid and returns the number of points outside the picture.
int DrawPointsAround(FigureSheet& sheet, const OutliersFigure::Object& object, const ViewCamera& eye,
                     cv::Size pixels, const FigureRect& panel, const ChartAxis& axis) {
  struct Seen {
    const FatedPoint* point;
    Eigen::Vector2d at;
    double depth;
  };
  const double size = MarkSize(object, 0.032 * panel.width);
  std::vector<Seen> seen;
  for (const FatedPoint& point : object.points) {
    const SeenPoint projected = Project(eye, pixels, point.p_map);
    const Eigen::Vector2d at(panel.x + projected.pixel.x / pixels.width * panel.width,
                             panel.y + projected.pixel.y / pixels.height * panel.height);
    if (projected.depth > 0.0 &&
        panel.Contains({at.x() - 0.6 * size, at.y() - 0.6 * size, 1.2 * size, 1.2 * size})) {
      seen.push_back({&point, at, projected.depth});
    }
  }
  // Far points come first within a fate.
  std::ranges::stable_sort(seen, std::less(),
                           [](const Seen& s) { return std::pair(s.point->fate, -s.depth); });
  for (const Seen& s : seen) {
    DrawPoint(sheet, axis, s.at, *s.point, size);
  }
  return static_cast<int>(object.points.size() - seen.size());
}

void DrawOutlierTexts(FigureSheet& sheet, const OutliersFigure::Object& object, int beyond,
                      const FigureRect& panel) {
  auto& [page, area, theme] = sheet;
  const Eigen::Vector2d name(panel.Center().x(), panel.Bottom() + 0.9 * theme.font);
  page.Label(object.name, name, theme.font, theme.ink, panel.width);
  std::string counts =
      fmt::format("{} kept, {} isolated, {} without score", CountOf(object, PointFate::kKept),
                  CountOf(object, PointFate::kIsolated), CountOf(object, PointFate::kRemovedBefore));
  if (beyond > 0) {
    counts += fmt::format("; {} not in view", beyond);
  }
  const Eigen::Vector2d below = name + Eigen::Vector2d(0.0, 0.6 * theme.font + 0.8 * theme.small);
  page.Label(counts, below, theme.small, theme.muted, panel.width);
}

// Draws one line that names the marks, with totals over all objects; smaller on narrow pages.
void DrawMarkLegend(FigureSheet& sheet, const OutliersFigure& figure, const ChartAxis& axis, double middle) {
  auto& [page, area, theme] = sheet;
  const auto named = [&figure](const char* name, PointFate fate, double anomaly) {
    return std::pair(fmt::format("{} ({})", name, CountOf(figure, fate)),
                     FatedPoint{Eigen::Vector3d::Zero(), anomaly, fate, {}});
  };
  const double kept = 0.3 * figure.threshold + 0.7 * axis.low;
  const std::array samples = {
      named("kept", PointFate::kKept, kept),
      named("isolated, removed", PointFate::kIsolated, 0.5 * (figure.threshold + axis.high)),
      named("removed without score", PointFate::kRemovedBefore, kept)};
  const double sign = 1.5 * theme.small;
  const double gap = 1.6 * theme.small;
  double width = -gap;
  for (const auto& [text, point] : samples) {
    width += sign + TextWidth(text, theme.small) + gap;
  }
  const double shrink = std::min(1.0, area.width / width);
  double x = area.Center().x() - 0.5 * shrink * width;
  for (const auto& [text, point] : samples) {
    DrawPoint(sheet, axis, {x + 0.45 * shrink * sign, middle}, point, 0.6 * theme.small * shrink);
    x += shrink * sign;
    page.Text(text, {x, middle}, 0.995 * shrink * theme.small, theme.ink);
    x += shrink * (TextWidth(text, theme.small) + gap);
  }
}

// Draws the colours of the scores, with numbers below and a line at the threshold; smaller on narrow pages.
void DrawScoreBar(FigureSheet& sheet, const OutliersFigure& figure, const ChartAxis& axis, double top) {
  constexpr int kSteps = 96;
  constexpr double kMinLength = 0.35;  // of the bar, share of the area's width
  const std::string meaning = "anomaly score";
  const std::string limit = fmt::format("removed above {:g}", figure.threshold);
  FigureSheet bar{{}, sheet.area, sheet.theme};
  auto& [page, area, theme] = bar;
  const double texts = TextWidth(meaning, theme.small) + TextWidth(limit, theme.small) + 1.3 * theme.small;
  theme.small *= std::min(1.0, (1.0 - kMinLength) * area.width / texts);
  const double gap = 0.6 * theme.small;
  const double left_room = TextWidth(meaning, theme.small);
  const double right_room = TextWidth(limit, theme.small);
  const double length = std::min(22.0 * theme.small, area.width - left_room - right_room - 2.0 * gap);
  const double left = area.x + 0.5 * (area.width - left_room - length - right_room - 2.0 * gap);
  const FigureRect strip{left + left_room + gap, top + 0.4 * theme.small, length, 0.9 * theme.small};
  // Each step extends below the next one, to avoid seams.
  for (int i = 0; i < kSteps; ++i) {
    const double x = strip.x + strip.width * i / kSteps;
    page.Rect({x, strip.y, std::min(2.0 * strip.width / kSteps, strip.Right() - x), strip.height},
              Viridis((i + 0.5) / kSteps));
  }
  const PlotArea plot{strip, axis, {}};
  DrawXAxis(bar, plot, "", false);
  page.Text(meaning, {strip.x - gap, strip.Center().y()}, theme.small, theme.ink, TextAlign::kRight);
  if (figure.threshold > axis.low && figure.threshold < axis.high) {
    const double x = plot.X(figure.threshold);
    page.Line({x, strip.y - 0.25 * theme.small}, {x, strip.Bottom()}, {theme.ink, 1.0, {}});
    page.Text(limit, {strip.Right() + gap, strip.Center().y()}, theme.small, theme.ink);
  }
  std::ranges::move(page.elements, std::back_inserter(sheet.page.elements));
}

void DrawBelowOutliers(PanelSheet& sheet, const OutliersFigure& figure, const ChartAxis& axis) {
  const double small = sheet.theme.small;
  const FigureRect below = sheet.Below();
  double y = below.y + 0.5 * kLegendHeight * small;
  DrawMarkLegend(sheet, figure, axis, y);
  y += 0.5 * (kLegendHeight - kNoteHeight) * small;
  for (const std::string& line : NoteLines(figure, sheet.theme, below.width)) {
    y += kNoteHeight * small;
    sheet.page.Text(line, {below.Center().x(), y}, small, sheet.theme.muted, TextAlign::kCenter);
  }
  DrawScoreBar(sheet, figure, axis, below.Bottom() - 3.0 * small);
}

}  // namespace

FigurePage DrawOutliers(const OutliersFigure& figure, const FigureOptions& options) {
  ThrowIf<UsageError>(figure.objects.empty(), "no objects, expected at least one");
  for (const OutliersFigure::Object& object : figure.objects) {
    ThrowIf<UsageError>(object.map.objects.size() != 1, "{}: {} solids, expected one", object.name,
                        object.map.objects.size());
  }
  PanelSheet sheet = MakePanelSheet(
      options, figure.objects.size() == 1 ? kColumnWidth : kTextWidth, "Outlier removal",
      [&](double width, const FigureTheme& theme) { return LayOutOutliers(figure, theme, width); });
  const PanelGrid& grid = sheet.grid;
  PictureOptions panels = PanelOptions(options, sheet);
  for (const OutliersFigure::Object& object : figure.objects) {  // grey, as colours encode the scores
    panels.style.objects.colors[object.map.objects.front().label] = "#9ea8b8";
  }
  PictureRenderer renderer(panels);
  const ChartAxis axis = ScoreAxis(figure);
  for (int i = 0; i < grid.columns; ++i) {
    options.Tell(i, grid.columns);
    const OutliersFigure::Object& object = figure.objects[static_cast<std::size_t>(i)];
    if (grid.image > 0.0) {
      DrawImagePanel(sheet, object, sheet.ImageAt(0, i), axis);
    }
    constexpr double kPointReach = 2.2;  // half diagonals of the object; farther points are not framed
    const FigureRect panel = sheet.PanelAt(0, i);
    renderer.SetMap(object.map);
    const ViewCamera eye = options.camera.ApplyTo(EyeOn(object.map, {object.map.objects.front().superquadric},
                                                        ToVector(object.points, &FatedPoint::p_map),
                                                        kPointReach, panel.width / panel.height));
    const cv::Mat picture = renderer.Render(eye);
    PlacePanel(sheet.page, picture, panel);
    DrawOutlierTexts(sheet, object, DrawPointsAround(sheet, object, eye, picture.size(), panel, axis), panel);
  }
  options.Tell(grid.columns, grid.columns);
  DrawBelowOutliers(sheet, figure, axis);
  return std::move(sheet.page);
}

namespace {

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
  shown.name = ReadableLabel(ShownName(object));
  shown.points = PointsWithFate(map, object.id);
  shown.map.camera = map.camera;
  shown.map.gravity_known = map.gravity_known;
  shown.map.keyframes = map.keyframes;
  shown.map.objects = {object};
  return shown;
}

FigurePage DrawOutliersOf(const FigureRequest& request, const OutliersOptions& options) {
  ThrowIf<UsageError>(options.no_images && !request.frames.empty(),
                      "--frame and --no-images: expected one of them");
  const std::string& result = request.results.front();
  const RecordedMap recorded = OpenObjectMap(request, result);
  const MapSnapshot& map = *recorded.last;
  std::map<int, std::vector<ObjectView>> views;
  if (!options.no_images) {
    views = ObjectViews(recorded, !request.frames.empty());
  }
  OutliersFigure figure;
  figure.threshold = ConfigOf(*recorded.reader).objects.outliers.isolation_forest.threshold;
  for (const int id : request.objects.empty() ? MostTelling(map, views) : request.objects) {
    OutliersFigure::Object shown = ObjectWithFates(map, ObjectById(map, id, result));
    if (!request.frames.empty() || views.contains(id)) {
      const std::string what = fmt::format("{}: object {} ({})", result, id, shown.name);
      const ObjectView view = ClearestView(ViewsOfFrame(views, id, request, what), shown.points, map.camera);
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
                     .maps = true,
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
