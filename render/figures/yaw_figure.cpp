#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <opencv2/imgproc.hpp>
#include <tuple>

#include "render/figures/figure_input.h"
#include "render/page/chart.h"
#include "render/picture/photo.h"
#include "render/picture/picture_text.h"
#include "slam/geometry/angles.h"
#include "slam/objects/box_lines.h"
#include "slam/objects/landmark_geometry.h"
#include "slam/objects/yaw.h"
#include "slam/snapshot/snapshot.h"
#include "slam/util/throw_if.h"

namespace sqslam {
namespace {

struct AxisLook {
  const char* letter;
  Eigen::Vector3d color;
};
// From the palette of Okabe and Ito; the lightness differs, for greyscale prints.
const std::array<AxisLook, 3> kYawAxes = {
    AxisLook{"x", ParseColor("#d55e00")}, {"y", ParseColor("#00a878")}, {"z", ParseColor("#4aa8ff")}};
const Eigen::Vector3d kAxisHalo = Eigen::Vector3d::Ones();
const Eigen::Vector3d kLineRim = Eigen::Vector3d::Zero();
const Eigen::Vector3d kUnmatched = Eigen::Vector3d::Constant(0.72);

std::vector<LegendEntry> YawLegend() {
  std::vector<LegendEntry> entries = {LegendEntry::Line("unmatched line", {kUnmatched, 0.7, {}})};
  for (const auto& [letter, color] : kYawAxes) {
    entries.push_back(LegendEntry::Line(fmt::format("along {}", letter), {color, 1.6, {}}));
  }
  return entries;
}

PanelGrid LayOutYaw(const YawFigure& figure, const FigureTheme& theme, double width) {
  PanelGrid grid = PanelGrid::Of(2, static_cast<int>(figure.objects.size()), width, 1.8 * theme.font);
  grid.top = 1.8 * theme.font;
  // The mean aspect ratio of the regions, so that little else is shown.
  double aspect = 0.0;
  for (const YawFigure::Object& object : figure.objects) {
    const double own = object.region.width / std::max(object.region.height, 1.0);
    aspect += (object.quarter_turns % 2 == 0 ? own : 1.0 / own) / static_cast<double>(figure.objects.size());
  }
  grid.height = grid.width / std::clamp(aspect, 0.75, 2.0);
  grid.texts = 1.7 * theme.small;
  grid.below = 0.4 * grid.gap + LegendHeight(YawLegend(), width, theme);
  return grid;
}

void DrawMatchedLines(FigurePage& page, const ImageCrop& crop, const std::vector<YawFigure::Line>& lines) {
  for (const bool matched : {false, true}) {
    for (const YawFigure::Line& line : lines) {
      if ((line.axis >= 0) == matched) {
        const Eigen::Vector3d color =
            matched ? kYawAxes[static_cast<std::size_t>(line.axis)].color : kUnmatched;
        crop.DrawLine(page, line.from, line.to, {kLineRim, matched ? 1.5 : 0.9, {}});
        crop.DrawLine(page, line.from, line.to, {color, matched ? 1.0 : 0.45, {}});
      }
    }
  }
}

// Draws the axes as edges that meet in the corner, with letters beyond their ends. Without arrowheads: lines
// are undirected, and the corner is chosen for its visibility, not by the axes' signs.
void DrawObjectAxes(FigurePage& page, const ImageCrop& crop, const YawFigure::View& view, double font) {
  const Eigen::Vector2d from = crop.ToPage(view.corner);
  const FigureRect& area = crop.Area();
  for (std::size_t i = 0; i < 3; ++i) {
    const auto& [letter, color] = kYawAxes[i];
    const Eigen::Vector2d& end = view.ends[i];
    const Eigen::Vector2d along = crop.ToPage(end) - from;
    crop.DrawLine(page, view.corner, end, {kAxisHalo, 3.4, {}});
    crop.DrawLine(page, view.corner, end, {color, 2.0, {3.0, 1.4}});
    if (crop.Contains(end) && along.norm() >= 1.0) {
      const Eigen::Vector2d at = from + along + 0.7 * font * along.normalized();
      page.Text({letter,
                 {std::clamp(at.x(), area.x + 0.5 * font, area.Right() - 0.5 * font),
                  std::clamp(at.y(), area.y + 0.6 * font, area.Bottom() - 0.6 * font)},
                 font,
                 color,
                 TextAlign::kCenter,
                 true,
                 0.0,
                 kAxisHalo});
    }
  }
}

// Draws the axes and lines of one view; `note` follows the mean angle.
void DrawYawPanel(PanelSheet& sheet, int row, int column, const YawFigure::Object& object,
                  const YawFigure::View& view, const std::string& note) {
  auto& [page, area, theme] = static_cast<FigureSheet&>(sheet);
  const FigureRect panel = sheet.PanelAt(row, column);
  const ImageCrop crop(object.image, object.region, object.quarter_turns, panel);
  crop.Draw(page);
  DrawMatchedLines(page, crop, object.lines);
  DrawObjectAxes(page, crop, view, theme.font);
  page.Label(object.yaw_lines == 0 ? "no line tells the yaw"
                                   : fmt::format("mean angle {:.1f}°, {}", view.mean_angle, note),
             {panel.Center().x(), panel.Bottom() + 0.95 * theme.small}, theme.small, theme.ink, panel.width);
}

}  // namespace

FigurePage DrawYaw(const YawFigure& figure, const FigureOptions& options) {
  ThrowIf<UsageError>(figure.objects.empty(), "no objects, expected at least one");
  for (const YawFigure::Object& object : figure.objects) {
    ThrowIf<UsageError>(object.image.empty(), "{}: no image, expected that of a frame", object.name);
  }
  PanelSheet sheet =
      MakePanelSheet(options, kColumnWidth, "Yaw from line segments",
                     [&](double width, const FigureTheme& theme) { return LayOutYaw(figure, theme, width); });
  for (int row = 0; row < sheet.grid.rows; ++row) {
    const YawFigure::Object& object = figure.objects[static_cast<std::size_t>(row)];
    sheet.NameRow(row, object.name);
    DrawYawPanel(sheet, row, 0, object, object.before,
                 fmt::format("{} line{}", object.yaw_lines, object.yaw_lines == 1 ? "" : "s"));
    DrawYawPanel(sheet, row, 1, object, object.after,
                 fmt::format("yaw {}{:.1f}°", object.yaw < -0.05 ? "\u2212" : "", std::abs(object.yaw)));
  }
  sheet.NameColumn(0, "(a) map's axes");
  sheet.NameColumn(1, "(b) optimised");
  const double legend = LegendHeight(YawLegend(), sheet.area.width, sheet.theme);
  DrawLegend(sheet, YawLegend(), {sheet.area.x, sheet.area.Bottom() - legend, sheet.area.width, legend});
  return std::move(sheet.page);
}

namespace {

struct YawContext {
  const RecordedMap& recorded;
  MapSnapshotPtr map;
  YawOptions options;
};

// Returns true if the box belongs to an object that supports others; the yaw estimator ignores its lines.
bool IsTooLarge(const ObjectView& view, const YawContext& context) {
  const Camera& camera = context.map->camera;
  return view.box.Area() > context.options.max_box_share * camera.width * camera.height;
}

// Selects the views with the largest boxes, preferring boxes that the yaw estimator uses, then boxes that are
// not cut off by the image border.
std::vector<ObjectView> LargestViews(std::vector<ObjectView> views, const YawContext& context) {
  constexpr std::size_t kCount = 6;
  constexpr double kBorder = 3.0;  // px
  const Camera& camera = context.map->camera;
  std::ranges::stable_sort(views, std::greater(), [&](const ObjectView& view) {
    const Box2d& box = view.box;
    const bool is_cut = box.x < kBorder || box.y < kBorder || box.x + box.width > camera.width - kBorder ||
                        box.y + box.height > camera.height - kBorder;
    return std::tuple(!IsTooLarge(view, context), !is_cut, box.Area());
  });
  views.resize(std::min(views.size(), kCount));
  return views;
}

// Projects the bounding box's three edges at a corner; empty if part of them is behind the camera.
std::optional<YawFigure::View> AxesAt(const PosedSuperquadric& solid, const Eigen::Vector3d& corner_signs,
                                      const Rigid3d& T_map_camera, const Camera& camera) {
  const Rigid3d T_camera_object = T_map_camera.Inverse() * solid.T_map_object;
  const Eigen::Vector3d corner = corner_signs.cwiseProduct(solid.shape.half_size);
  std::array<Eigen::Vector2d, 4> pixels;  // of the corner and the ends
  for (int i = 0; i < 4; ++i) {
    Eigen::Vector3d end = corner;
    if (i > 0) {
      end[i - 1] = -end[i - 1];
    }
    const Eigen::Vector3d p = T_camera_object * end;
    if (p.z() <= 0.0) {
      return std::nullopt;
    }
    pixels[static_cast<std::size_t>(i)] = camera.Project(p);
  }
  return YawFigure::View{pixels[0], {pixels[1], pixels[2], pixels[3]}, 0.0};
}

// Returns the part of the image that may be shown around an object's box; longer axes are cut off.
Box2d Around(const Box2d& box, const Camera& camera) {
  constexpr double kReach = 0.4;
  return ClipToImage({box.x - kReach * box.width, box.y - kReach * box.height,
                      (1.0 + 2.0 * kReach) * box.width, (1.0 + 2.0 * kReach) * box.height},
                     camera);
}

// Places the axes before and after at the lower corner that shows most of them, so that z points up; ties go
// to the nearest to the camera. Returns false if part of the object is behind the camera.
bool PlaceAxes(const PosedSuperquadric& start, const PosedSuperquadric& solid, const ObjectView& view,
               const Box2d& visible, const Camera& camera, YawFigure::Object& object) {
  const Eigen::Vector3d eye = solid.T_map_object.Inverse() * view.T_map_camera.translation;
  std::pair<int, double> best(-1, 0.0);  // visible ends, minus distance
  for (int i = 0; i < 4; ++i) {
    const Eigen::Vector3d signs(i & 1 ? 1.0 : -1.0, i & 2 ? 1.0 : -1.0, -1.0);
    const auto before = AxesAt(start, signs, view.T_map_camera, camera);
    const auto after = AxesAt(solid, signs, view.T_map_camera, camera);
    if (!before || !after) {
      return false;
    }
    int shown = 0;
    for (const YawFigure::View& axes : {*before, *after}) {
      shown += visible.Contains(axes.corner) ? 3 : 0;
      for (const Eigen::Vector2d& end : axes.ends) {
        shown += visible.Contains(end) ? 1 : 0;
      }
    }
    const std::pair<int, double> rank(shown, -(signs.cwiseProduct(solid.shape.half_size) - eye).norm());
    if (rank > best) {
      best = rank;
      object.before = *before;
      object.after = *after;
    }
  }
  return true;
}

// Returns the part of the image that the figure shows: box and axes with a margin.
Box2d RegionOf(const Box2d& box, const Box2d& visible, const YawFigure::Object& object,
               const Camera& camera) {
  const auto bounds = [](const Box2d& b) {
    return Eigen::AlignedBox2d(Eigen::Vector2d(b.x, b.y), Eigen::Vector2d(b.x + b.width, b.y + b.height));
  };
  Eigen::AlignedBox2d shown = bounds(box);
  for (const YawFigure::View* view : {&object.before, &object.after}) {
    shown.extend(view->corner);
    for (const Eigen::Vector2d& end : view->ends) {
      shown.extend(end);
    }
  }
  shown.clamp(bounds(visible));
  const double margin = 0.1 * std::max(box.width, box.height);
  return ClipToImage({shown.min().x() - margin, shown.min().y() - margin, shown.sizes().x() + 2.0 * margin,
                      shown.sizes().y() + 2.0 * margin},
                     camera);
}

// Matches lines to the estimated axes, and computes the mean angles of the lines that constrain yaw.
void MatchLines(const YawContext& context, const ObjectView& view, const std::vector<LineSegment>& lines,
                const PosedSuperquadric& start, const PosedSuperquadric& solid, YawFigure::Object& shown) {
  const Camera& camera = context.map->camera;
  const Eigen::Matrix3d R_start = start.T_map_object.RotationMatrix();
  const Eigen::Matrix3d R_end = solid.T_map_object.RotationMatrix();
  for (const LineSegment& line : lines) {
    const AxisOfLine nearest = NearestAxis(line, view.T_map_camera, camera, R_end);
    const int axis = nearest.angle < context.options.match_angle_deg * kRadiansPerDegree ? nearest.axis : -1;
    shown.lines.push_back({line.a, line.b, axis});
    if (axis == 0 || axis == 1) {
      ++shown.yaw_lines;
      shown.after.mean_angle += nearest.angle / kRadiansPerDegree;
      shown.before.mean_angle +=
          AngleToDirection(line, view.T_map_camera, camera, R_start.col(axis)) / kRadiansPerDegree;
    }
  }
  shown.before.mean_angle /= std::max(1, shown.yaw_lines);
  shown.after.mean_angle /= std::max(1, shown.yaw_lines);
}

// Compares lines with axes in one view; empty if the object reaches behind the camera.
std::optional<YawFigure::Object> MeasureYaw(const YawContext& context, const SnapshotObject& object,
                                            const ObjectView& view) {
  const Camera& camera = context.map->camera;
  const double yaw = WrapQuarter(object.yaw);
  const PosedSuperquadric& solid = object.superquadric;
  PosedSuperquadric start = solid;
  start.T_map_object.rotation =
      Eigen::AngleAxisd(-yaw, Eigen::Vector3d::UnitZ()) * solid.T_map_object.rotation;
  const Box2d box = UndistortBox(view.box, camera);
  const Box2d visible = Around(box, camera);
  YawFigure::Object shown;
  if (!PlaceAxes(start, solid, view, visible, camera, shown)) {
    return std::nullopt;
  }
  shown.name = ReadableLabel(ShownName(object));
  shown.yaw = yaw / kRadiansPerDegree;
  shown.quarter_turns = UprightTurns(view, *context.map);
  const cv::Mat image = ImageOf(view, context.recorded);
  cv::Mat gray;
  cv::cvtColor(image, gray, cv::COLOR_BGR2GRAY);
  MatchLines(context, view,
             LinesInBox(ExtractLines(gray, camera, {view.box}, context.options), box, context.options), start,
             solid, shown);
  shown.image = Undistorted(image, camera);
  shown.region = RegionOf(box, visible, shown, camera);
  return shown;
}

std::optional<YawFigure::Object> BestMeasured(const YawContext& context, const SnapshotObject& object,
                                              const std::vector<ObjectView>& views) {
  std::optional<YawFigure::Object> best;
  for (const ObjectView& view : LargestViews(views, context)) {
    std::optional<YawFigure::Object> measured = MeasureYaw(context, object, view);
    if (measured && (!best || measured->yaw_lines > best->yaw_lines)) {
      best = std::move(measured);
    }
  }
  return best;
}

// Returns the object with the most matched lines, preferring objects turned from the map's axes.
YawFigure::Object ClearestYaw(const YawContext& context, const std::map<int, std::vector<ObjectView>>& views,
                              const FigureRequest& request) {
  constexpr double kMinTurn = 3.0;  // degrees
  std::optional<YawFigure::Object> best;
  const auto rank = [](const YawFigure::Object& object) {
    return std::pair(std::abs(object.yaw) >= kMinTurn && object.yaw_lines > 2, object.yaw_lines);
  };
  int measured_objects = 0;
  for (const SnapshotObject& object : context.map->objects) {
    request.page.Tell(measured_objects++, static_cast<int>(context.map->objects.size()));
    const auto found = views.find(object.id);
    std::vector<ObjectView> usable = found == views.end() ? std::vector<ObjectView>() : found->second;
    std::erase_if(usable, [&](const ObjectView& view) { return IsTooLarge(view, context); });
    std::optional<YawFigure::Object> measured = BestMeasured(context, object, usable);
    if (measured && (!best || rank(*measured) > rank(*best))) {
      best = std::move(measured);
    }
  }
  ThrowIf<InputError>(!best,
                      "{}: no object with the image of a keyframe, expected a map made from images that are "
                      "still there, with objects",
                      request.results.front());
  return *best;
}

FigurePage DrawYawOf(const FigureRequest& request) {
  ThrowIf<UsageError>(request.objects.empty() && !request.frames.empty(),
                      "--frame without --object: expected the object to show in that frame");
  const std::string& result = request.results.front();
  const RecordedMap recorded = OpenMap(request, result);
  const YawContext context{recorded, recorded.last, ConfigOf(*recorded.reader).objects.yaw};
  const auto views = ObjectViews(recorded, !request.frames.empty());
  YawFigure figure;
  for (const int id : request.objects) {
    const SnapshotObject& object = ObjectById(*context.map, id, result);
    const std::string what = fmt::format("{}: object {} ({})", result, id, object.label);
    std::optional<YawFigure::Object> measured =
        BestMeasured(context, object, ViewsOfFrame(views, id, request, what));
    ThrowIf<InputError>(!measured, "{}: reaches behind the camera, expected another frame or object", what);
    figure.objects.push_back(std::move(*measured));
  }
  if (request.objects.empty()) {
    figure.objects.push_back(ClearestYaw(context, views, request));
  }
  return DrawYaw(figure, request.page);
}

}  // namespace

FigureEntry YawEntry() {
  return {.name = "yaw",
          .help = "Line segments of an object against its axes, before and after",
          .details = R"(
Line segments that the yaw estimator's detector (EDLines) finds in an object's box, and the axes of the object's
frame along the edges of its bounding box, from a lower corner near the camera: (a) along the map's axes (the quarter
turn nearest to the object's, as yaw counts modulo 90 degrees), (b) as estimated. A line is matched to its nearest
axis in (b) if the angle is below objects.yaw.match_angle_deg. The mean is over the lines matched to x or y, the
same ones in (a) and (b): the angle between a line and the image of its axis at the line's midpoint. Lines along z
do not constrain yaw. The image is undistorted and turned upright by quarter turns.

Only keyframes of the finished map are used; by default, of those with the largest boxes, the one with the most
matched lines. Without --object: the object with the most matched lines, preferring objects turned from the map's
axes.

Examples:
  sqslam figure yaw out/desk -o yaw.pdf
  sqslam figure yaw out/desk --object 2 --object 7 -o yaw.png --dpi 600
  sqslam figure yaw out/desk --object 2 --frame 120 -o yaw.svg --width-mm 120
)",
          .results_help = kMapHelp,
          .maps = true,
          .objects = true,
          .frames_help = kKeyframeHelp,
          .draw = DrawYawOf};
}

}  // namespace sqslam
