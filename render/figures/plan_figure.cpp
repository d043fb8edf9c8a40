#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "render/camera/scene_framing.h"
#include "render/figures/figure_input.h"
#include "render/page/chart.h"
#include "render/scene/class_colors.h"
#include "render/scene/cloud_layer.h"
#include "slam/io/result_files.h"
#include "slam/scene/wall_lines.h"
#include "slam/util/markup.h"
#include "slam/util/throw_if.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace {

constexpr double kWallWidth = 2.2;    // points
constexpr double kCameraWidth = 0.7;  // points
constexpr double kTick = 2.5;         // half length of the marks at the ends of a dimension, points

Eigen::AlignedBox2d ExtentOf(const std::vector<WallLine>& walls) {
  Eigen::AlignedBox2d extent;
  for (const WallLine& wall : walls) {
    extent.extend(wall.from);
    extent.extend(wall.to);
  }
  return extent;
}

// Returns the extent of everything on the plan, with a margin.
Eigen::AlignedBox2d ExtentOf(const PlanFigure& figure) {
  Eigen::AlignedBox2d extent = ExtentOf(figure.walls);
  for (const TrajectoryFigure::Footprint& object : figure.objects) {
    for (const Eigen::Vector3d& p : object.outline) {
      extent.extend(Eigen::Vector2d(p.head<2>()));
    }
  }
  for (const Eigen::Vector2d& p : figure.path) {
    extent.extend(p);
  }
  ThrowIf<UsageError>(extent.isEmpty(), "no plan to draw, expected an object or a camera path");
  const Eigen::Vector2d margin = Eigen::Vector2d::Constant(std::max(0.03 * extent.sizes().maxCoeff(), 1e-6));
  return {extent.min() - margin, extent.max() + margin};
}

std::string PlanLength(double length, bool metric) {
  return metric          ? fmt::format("{:.2f} m", length)
         : length == 1.0 ? "1 map unit"
                         : fmt::format("{:.3g} map units", length);
}

// Draws a line between marks, with its length in the middle, or to the right of its direction if it is short.
void DrawDimension(FigureSheet& sheet, const Eigen::Vector2d& from, const Eigen::Vector2d& to,
                   const std::string& text) {
  auto& [page, area, theme] = sheet;
  const Eigen::Vector2d along = (to - from).normalized();
  const Eigen::Vector2d across(-along.y(), along.x());
  const FigureStroke stroke{theme.ink, 0.6, {}};
  Eigen::Vector2d middle = 0.5 * (from + to);
  const double gap = 0.5 * TextWidth(text, theme.small) + 2.0;
  if ((to - from).norm() > 2.0 * gap) {
    page.Line(from, middle - gap * along, stroke);
    page.Line(middle + gap * along, to, stroke);
  } else {
    page.Line(from, to, stroke);
    middle += 0.9 * theme.small * across;
  }
  page.Line(from - kTick * across, from + kTick * across, stroke);
  page.Line(to - kTick * across, to + kTick * across, stroke);
  FigureText label{text, middle, theme.small, theme.ink, TextAlign::kCenter};
  label.angle = std::abs(along.x()) > 0.5 ? 0.0 : 90.0;
  page.Text(label);
}

// Draws width and depth of the room, below and to the left of the plan.
void DrawRoomSize(FigureSheet& sheet, const PlotArea& plot, const PlanFigure& figure) {
  const Eigen::AlignedBox2d room = ExtentOf(figure.walls);
  const Eigen::Vector2d size = room.sizes();
  const double y = plot.area.Bottom() + 0.9 * sheet.theme.font, x = plot.area.x - 0.9 * sheet.theme.font;
  DrawDimension(sheet, {plot.X(room.min().x()), y}, {plot.X(room.max().x()), y},
                PlanLength(size.x(), figure.metric));
  DrawDimension(sheet, {x, plot.Y(room.max().y())}, {x, plot.Y(room.min().y())},
                PlanLength(size.y(), figure.metric));
}

void DrawPlanScale(FigureSheet& sheet, const PlotArea& plot, const PlanFigure& figure) {
  auto& [page, area, theme] = sheet;
  const double units = plot.x.high - plot.x.low;
  const double bar = RoundLength(0.3 * units);
  const double y = area.Bottom() - 0.6 * theme.small;
  const Eigen::Vector2d from(plot.area.x, y), to(plot.area.x + bar / units * plot.area.width, y);
  const FigureStroke stroke{theme.ink, 1.2, {}};
  page.Line(from, to, stroke);
  for (const Eigen::Vector2d& end : {from, to}) {
    page.Line(end - Eigen::Vector2d(0.0, kTick), end + Eigen::Vector2d(0.0, kTick), stroke);
  }
  page.Text(figure.metric ? fmt::format("{:g} m", bar) : PlanLength(bar, false),
            to + Eigen::Vector2d(5.0, 0.0), theme.small, theme.ink);
}

// Returns the room beside the plan for its dimensions, points.
double DimensionRoom(const PlanFigure& figure, const FigureTheme& theme) {
  return figure.walls.empty() ? 0.0 : 2.0 * theme.font;
}

using PlanKey = std::vector<std::string>;  // "1 toaster": names of the objects that have a number in the plan

double KeyLine(const FigureTheme& theme) { return 1.3 * theme.small; }

// Returns the lines of the key below the plan.
std::vector<std::string> KeyLines(const PlanKey& key, double width, const FigureTheme& theme) {
  std::vector<std::string> lines;
  for (const std::string& entry : key) {
    const std::string longer = lines.empty() ? "" : lines.back() + ",  " + entry;
    if (!longer.empty() && TextWidth(longer, theme.small) <= width) {
      lines.back() = longer;
    } else {
      lines.push_back(entry);
    }
  }
  return lines;
}

// Returns the largest area with the plan's scale on both axes, `below` points above the lower edge.
PlotArea PlaceOnPage(const FigureSheet& sheet, const PlanFigure& figure, const Eigen::AlignedBox2d& extent,
                     double below) {
  const double left = DimensionRoom(figure, sheet.theme);
  const FigureRect room{sheet.area.x + left, sheet.area.y, sheet.area.width - left,
                        sheet.area.height - below};
  ThrowIf<UsageError>(room.width < 20.0 || room.height < 20.0,
                      "the figure is too small for its plan, expected a larger width and height");
  return {room.Fitted(extent.sizes().x(), extent.sizes().y()),
          {extent.min().x(), extent.max().x(), 1.0},
          {extent.min().y(), extent.max().y(), 1.0}};
}

struct DrawnPlan {
  FigurePage page;
  std::vector<std::size_t> far;  // objects whose names are far from them
};

DrawnPlan DrawPlanWithKey(const PlanFigure& figure, const PlanKey& key, const FigureOptions& options) {
  const Eigen::AlignedBox2d extent = ExtentOf(figure);
  FigureSheet sheet =
      MakeSheet(options, kColumnWidth, "Floor plan", [&](double width, const FigureTheme& theme) {
        const double left = DimensionRoom(figure, theme);
        const double high = extent.sizes().y() / extent.sizes().x();
        return left + 2.0 * theme.font + (width - left) * std::clamp(high, 0.2, 1.5) +
               KeyLine(theme) * static_cast<double>(KeyLines(key, width, theme).size());
      });
  const std::vector<std::string> lines = KeyLines(key, sheet.area.width, sheet.theme);
  const double key_height = KeyLine(sheet.theme) * static_cast<double>(lines.size());
  sheet.area.height -= key_height;
  const PlotArea plot =
      PlaceOnPage(sheet, figure, extent, DimensionRoom(figure, sheet.theme) + 2.0 * sheet.theme.font);
  for (const WallLine& wall : figure.walls) {
    sheet.page.Line(plot.At(wall.from.x(), wall.from.y()), plot.At(wall.to.x(), wall.to.y()),
                    {sheet.theme.ink, kWallWidth, {}});
  }
  sheet.page.Polyline(ToVector(figure.path, [&](const Eigen::Vector2d& p) { return plot.At(p.x(), p.y()); }),
                      {sheet.theme.muted, kCameraWidth, {3.0, 1.5}});
  const double left = sheet.area.x + DimensionRoom(figure, sheet.theme);
  const std::vector<std::size_t> far = DrawFootprints(
      sheet, plot, {left, sheet.area.y, sheet.area.Right() - left, plot.area.Bottom() - sheet.area.y},
      figure.objects);
  if (!figure.walls.empty()) {
    DrawRoomSize(sheet, plot, figure);
  }
  DrawPlanScale(sheet, plot, figure);
  for (std::size_t i = 0; i < lines.size(); ++i) {
    sheet.page.Text(lines[i],
                    {left, sheet.area.Bottom() + (static_cast<double>(i) + 0.6) * KeyLine(sheet.theme)},
                    sheet.theme.small, sheet.theme.ink);
  }
  return {std::move(sheet.page), far};
}

}  // namespace

FigurePage DrawPlan(const PlanFigure& figure, const FigureOptions& options) {
  DrawnPlan plan = DrawPlanWithKey(figure, {}, options);
  if (plan.far.empty()) {
    return std::move(plan.page);
  }
  PlanFigure numbered = figure;
  PlanKey key;
  std::ranges::sort(plan.far, {}, [&](std::size_t i) {  // from left to right
    return figure.objects[i].outline.empty() ? 0.0 : figure.objects[i].outline.front().x();
  });
  for (const std::size_t i : plan.far) {
    numbered.objects[i].name = std::to_string(key.size() + 1);
    key.push_back(fmt::format("{} {}", numbered.objects[i].name, figure.objects[i].name));
  }
  return DrawPlanWithKey(numbered, key, options).page;
}

namespace {

// The outline of a solid in a plan: the support points of horizontal normals.
struct PlanOutline {
  const PosedSuperquadric& solid;
  Eigen::Vector3d right, top;
  double tolerance;
  std::vector<Eigen::Vector3d> points{};

  static Eigen::Vector2d Normal(double angle) { return {std::cos(angle), std::sin(angle)}; }
  Eigen::Vector2d PointAt(double angle) const {
    const Eigen::Vector2d n = Normal(angle);
    const Eigen::Vector3d p = SupportPoint(solid, n.x() * right + n.y() * top);
    return {p.dot(right), p.dot(top)};
  }

  // Adds the points between two of them, and the second. Between them the outline lies in the triangle of the
  // chord and the two tangents, whose height is compared with the tolerance.
  void Add(double first_angle, const Eigen::Vector2d& first, double second_angle,
           const Eigen::Vector2d& second) {
    constexpr double kMinTurn = 1e-5;  // radians, at a corner
    const Eigen::Vector2d chord = second - first;
    const double turn = second_angle - first_angle;
    const double height = std::abs(Normal(first_angle).dot(chord) * Normal(second_angle).dot(chord)) /
                          std::max(chord.norm() * std::sin(turn), 1e-300);
    if (turn > 0.5 || (height > tolerance && turn > kMinTurn)) {
      const double middle = 0.5 * (first_angle + second_angle);
      const Eigen::Vector2d between = PointAt(middle);
      Add(first_angle, first, middle, between);
      Add(middle, between, second_angle, second);
    } else if (chord.norm() > tolerance) {
      points.emplace_back(second.x(), second.y(), 0.0);
    }
  }
};

}  // namespace

std::vector<Eigen::Vector3d> OutlineFromAbove(const PosedSuperquadric& solid, const Eigen::Vector3d& right,
                                              const Eigen::Vector3d& top) {
  PlanOutline outline{solid, right, top, 2e-4 * solid.shape.half_size.maxCoeff()};
  constexpr double kTurn = 2.0 * std::numbers::pi;
  for (int i = 0; i < 4; ++i) {
    const double from = i * kTurn / 4, to = (i + 1) * kTurn / 4;
    outline.Add(from, outline.PointAt(from), to, outline.PointAt(to));
  }
  return std::move(outline.points);
}

namespace {

// Returns the objects in the plan, lower ones first.
std::vector<TrajectoryFigure::Footprint> FootprintsOf(const MapSnapshot& map, const ViewAxes& axes,
                                                      const SceneStyle::Objects& style) {
  std::vector<SnapshotObject> objects = map.objects;
  std::ranges::stable_sort(objects, {}, [&axes](const SnapshotObject& object) {
    const PosedSuperquadric& solid = object.superquadric;
    return solid.T_map_object.translation.dot(axes.back) + SupportExtent(solid, axes.back);
  });
  const LabelColors colors(style.colors);
  std::vector<TrajectoryFigure::Footprint> footprints;
  for (const SnapshotObject& object : objects) {
    const bool uncertain = style.uncertain != UncertainObjects::kSolid && !IsReliable(object);
    if (!uncertain || style.uncertain == UncertainObjects::kOutline) {
      footprints.push_back({ReadableLabel(ShownName(object)), colors(object.label),
                            OutlineFromAbove(object.superquadric, axes.right, axes.up), uncertain});
    }
  }
  return footprints;
}

bool IsOnAnObject(const MapSnapshot& map, const Eigen::Vector3d& p_map) {
  constexpr double kMargin = 1.1;  // times the object's size
  return std::ranges::any_of(map.objects, [&](const SnapshotObject& object) {
    const PosedSuperquadric& solid = object.superquadric;
    return IsReliable(object) && solid.shape.RadialScale(solid.T_map_object.Inverse() * p_map) < kMargin;
  });
}

}  // namespace

PlanFigure MakePlan(const MapSnapshot& map, const CloudLayerPtr& cloud, const SceneStyle& style) {
  constexpr std::size_t kDirectionPoints = 4000, kWallPoints = 200000;
  SceneFocus focus = FindFocus(map);
  const auto sample = [&cloud](std::size_t count) {
    return cloud ? EvenSample(*cloud, count) : std::vector<Eigen::Vector3d>();
  };
  focus.main_direction = MainDirectionOf(map, sample(kDirectionPoints), focus);
  const ViewAxes axes = AxesOf(PresetView("top", focus, 2.0, 30.0, Projection::kOrthographic));
  const auto in_plan = [&axes](const Eigen::Vector3d& p) {
    return Eigen::Vector3d(p.dot(axes.right), p.dot(axes.up), p.dot(axes.back));
  };
  PlanFigure figure;
  figure.metric = map.metric;
  figure.objects = FootprintsOf(map, axes, style.objects);
  figure.path = ToVector(map.keyframes, [&](const SnapshotKeyframe& keyframe) -> Eigen::Vector2d {
    return in_plan(keyframe.T_map_camera.translation).head<2>();
  });
  std::vector<Eigen::Vector3d> surroundings = sample(kWallPoints);
  std::erase_if(surroundings, [&map](const Eigen::Vector3d& p) { return IsOnAnObject(map, p); });
  figure.walls = FindWallLines(ToVector(surroundings, in_plan));
  return figure;
}

namespace {

struct PlanOptions {
  void VisitFields(auto&&) {}
};

FigurePage DrawPlanOf(const FigureRequest& request, const PlanOptions&) {
  const std::string& result = request.results.front();
  const SceneStyle& style = request.page.style;
  const CloudLayerPtr cloud =
      style.dense_cloud.show ? ReadCloudLayer(ResultFile(result, "map.sqmap")) : nullptr;
  return DrawPlan(MakePlan(*OpenMap(request, result).last, cloud, style), request.page);
}

}  // namespace

FigureEntry PlanEntry() {
  return FigureEntry{
      .name = "plan",
      .help = "Floor plan: objects and walls from above, with a scale",
      .details = R"(
Objects are drawn as their exact outlines from above, uncertain ones dashed; the dashed grey line is the camera
path. Where names do not fit beside their objects, numbers stand for them, with a key below the plan. After sqslam densify, walls are drawn where the dense cloud is vertical over at least half of the scene's
height; of a tall cupboard and the wall behind it, the wall. Width and depth are those that the walls span. The plan
is turned until the longest wall, or the path, runs across the page. Lengths are metres after sqslam scale,
otherwise map units. --set dense_cloud.show=false omits the walls.

Examples:
  sqslam figure plan out/kitchen -o plan.pdf
  sqslam figure plan out/kitchen --edits auto --width-mm 183 -o plan.svg
)",
      .results_help = kMapHelp,
      .maps = true,
  }
      .DrawnBy(DrawPlanOf);
}

}  // namespace sqslam
