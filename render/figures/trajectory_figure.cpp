#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <vector>

#include "render/figures/figure_input.h"
#include "render/page/chart.h"
#include "slam/evaluation/ground_truth.h"
#include "slam/evaluation/trajectory_error.h"
#include "slam/io/result_files.h"
#include "slam/io/trajectory.h"
#include "slam/snapshot/map_scale.h"
#include "slam/util/throw_if.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace fs = std::filesystem;
namespace {

constexpr double kTruthWidth = 2.6;  // points; the estimates are drawn over it
constexpr double kPathWidth = 1.1;
constexpr double kTrajectoryGap = 5.0;

struct PathBounds {
  Eigen::AlignedBox3d box;
  double first_time = std::numeric_limits<double>::infinity();
  double last_time = -first_time;

  void Add(const TrajectoryFigure::Path& path) {
    for (const auto& piece : path.pieces) {
      for (const TrajectoryFigure::Pose& pose : piece) {
        box.extend(pose.position);
        first_time = std::min(first_time, pose.time);
        last_time = std::max(last_time, pose.time);
      }
    }
  }
};

PathBounds BoundsOf(const TrajectoryFigure& figure) {
  PathBounds bounds;
  if (figure.truth) {
    bounds.Add(*figure.truth);
  }
  for (const TrajectoryFigure::Path& path : figure.paths) {
    bounds.Add(path);
  }
  for (const TrajectoryFigure::Footprint& object : figure.objects) {
    std::ranges::for_each(object.outline, [&bounds](const auto& p) { bounds.box.extend(p); });
  }
  ThrowIf<UsageError>(bounds.box.isEmpty(), "no camera path to draw, expected at least one pose");
  // Not smaller than coordinates so far from the origin can tell apart: the axes need ticks.
  const double size =
      std::max({bounds.box.sizes().maxCoeff(), 1e-6, 1e-9 * bounds.box.center().cwiseAbs().maxCoeff()});
  const Eigen::Vector3d least = Eigen::Vector3d::Constant(0.1 * size);  // also for a straight path
  const Eigen::Vector3d missing =
      0.5 * (least - bounds.box.sizes()).cwiseMax(0.0) + Eigen::Vector3d::Constant(0.05 * size);
  bounds.box = {bounds.box.min() - missing, bounds.box.max() + missing};
  return bounds;
}

FigureStroke TruthStroke(const FigureTheme& theme) {
  return {0.5 * theme.muted + 0.5 * theme.faint, kTruthWidth, {}};
}

std::vector<LegendEntry> PathLegend(const TrajectoryFigure& figure, const FigureTheme& theme) {
  std::vector<LegendEntry> entries;
  if (figure.truth) {
    entries.push_back(LegendEntry::Line(figure.truth->name, TruthStroke(theme)));
  }
  for (std::size_t i = 0; i < figure.paths.size(); ++i) {
    const SeriesLook look = LookOfSeries(i);
    entries.push_back(LegendEntry::Line(figure.paths[i].name, {look.color, kPathWidth, look.dash}));
  }
  entries.push_back(LegendEntry::OfMark("start", {Mark::Shape::kCircle, 5.0, theme.ink}));
  return entries;
}

// Draws a path; `place` maps a pose to the page.
void DrawPieces(FigurePage& page, const TrajectoryFigure::Pieces& pieces, const FigureStroke& stroke,
                const auto& place) {
  constexpr double kFinest = 0.1;  // points; finer steps are not visible and enlarge the file
  for (const auto& piece : pieces) {
    std::vector<Eigen::Vector2d> points;
    for (std::size_t i = 0; i < piece.size(); ++i) {
      const Eigen::Vector2d p = place(piece[i]);
      if (points.empty() || i + 1 == piece.size() || (p - points.back()).norm() > kFinest) {
        points.push_back(p);
      }
    }
    page.Polyline(std::move(points), stroke);
  }
}

void DrawPaths(FigurePage& page, const TrajectoryFigure& figure, const FigureTheme& theme,
               const auto& place) {
  if (figure.truth) {
    DrawPieces(page, figure.truth->pieces, TruthStroke(theme), place);
  }
  for (std::size_t i = 0; i < figure.paths.size(); ++i) {
    const SeriesLook look = LookOfSeries(i);
    DrawPieces(page, figure.paths[i].pieces, {look.color, kPathWidth, look.dash}, place);
  }
  for (const TrajectoryFigure::Path& path : figure.paths) {
    if (!path.pieces.empty() && !path.pieces.front().empty()) {
      const TrajectoryFigure::Pose& first = path.pieces.front().front();
      DrawMark(page, place(first), {Mark::Shape::kCircle, 5.0, theme.ink});
    }
  }
}

// Moves names, sorted from top to bottom, each down until it overlaps no earlier one.
void MoveNamesApart(std::vector<FigureText>& names, double size) {
  const double line = 1.15 * size;
  const std::vector<double> widths =
      ToVector(names, [size](const FigureText& name) { return TextWidth(name.text, size); });
  std::map<double, std::vector<std::size_t>> rows;  // placed names by row of the page; a row is a line high
  const auto row_of = [&](std::size_t i) { return std::floor(names[i].anchor.y() / line); };
  // Returns the first earlier name that it overlaps; `i` if there is none.
  const auto overlapped = [&](std::size_t i) {
    std::size_t first = i;
    const double row = row_of(i);
    for (auto near = rows.lower_bound(row - 1.0); near != rows.end() && near->first <= row + 1.0; ++near) {
      for (const std::size_t j : near->second) {
        const Eigen::Vector2d apart = (names[i].anchor - names[j].anchor).cwiseAbs();
        if (apart.x() < 0.5 * (widths[i] + widths[j]) && apart.y() < 0.99 * line) {
          first = std::min(first, j);
          break;
        }
      }
    }
    return first;
  };
  for (std::size_t i = 0; i < names.size(); ++i) {
    for (std::size_t j = overlapped(i); j != i; j = overlapped(i)) {
      names[i].anchor.y() = names[j].anchor.y() + line;
    }
    rows[row_of(i)].push_back(i);
  }
}

// Draws objects from above, and over all of them their names.
void DrawFootprints(FigurePage& page, const PlotArea& plot, const TrajectoryFigure& figure,
                    const FigureTheme& theme) {
  std::vector<FigureText> names;
  for (const TrajectoryFigure::Footprint& object : figure.objects) {
    FigurePath path{{}, true, object.color, 0.22, FigureStroke{object.color, 0.8, {}}};
    if (object.uncertain) {
      path.fill.reset();
      path.stroke->dash = {2.0, 2.0};
    }
    Eigen::Vector2d middle = Eigen::Vector2d::Zero();
    for (const Eigen::Vector3d& p : object.outline) {
      path.points.push_back(plot.At(p.x(), p.y()));
      middle += path.points.back() / static_cast<double>(object.outline.size());
    }
    page.elements.emplace_back(std::move(path));
    names.push_back({object.name, middle, theme.small, object.uncertain ? theme.muted : theme.ink,
                     TextAlign::kCenter, false, 0.0, theme.background});
  }
  std::ranges::stable_sort(
      names, [](const FigureText& a, const FigureText& b) { return a.anchor.y() < b.anchor.y(); });
  MoveNamesApart(names, theme.small);
  for (const FigureText& name : names) {
    page.Text(name);
  }
}

double HeightsBlock(const FigureTheme& theme) { return 60.0 + XAxisHeight(theme) + kTrajectoryGap; }

// Returns the height of everything above and below the x-y plot, points.
double AroundPlot(const TrajectoryFigure& figure, const FigureTheme& theme, double width) {
  return LegendHeight(PathLegend(figure, theme), width, theme) + kTrajectoryGap + XAxisHeight(theme) +
         (figure.heights ? HeightsBlock(theme) : 0.0);
}

// Gives both axes the same scale; the shorter range is widened to fill the area.
PlotArea EqualAxes(const FigureRect& area, const PathBounds& bounds) {
  const Eigen::Vector2d size = bounds.box.sizes().head<2>();
  const double scale = std::min(area.width / size.x(), area.height / size.y());
  const Eigen::Vector2d middle = 0.5 * (bounds.box.max() + bounds.box.min()).head<2>();
  const Eigen::Vector2d half = 0.5 * Eigen::Vector2d(area.width, area.height) / scale;
  PlotArea plot;
  plot.area = area;
  constexpr double kTickSpacing = 28.0;  // points, roughly; the same for both axes
  const double step = RoundAxis(0.0, kTickSpacing / scale, 1, false).step;
  plot.x = {middle.x() - half.x(), middle.x() + half.x(), step};
  plot.y = {middle.y() - half.y(), middle.y() + half.y(), step};
  return plot;
}

void DrawPathHeights(FigurePage& page, const FigureRect& area, const TrajectoryFigure& figure,
                     const PathBounds& bounds, const FigureTheme& theme) {
  PlotArea plot;
  plot.area = area;
  const double duration = bounds.last_time - bounds.first_time;
  plot.x = RoundAxis(-0.02 * duration, 1.02 * duration, std::max(2, int(area.width / 35.0)), false);
  plot.y = RoundAxis(bounds.box.min().z(), bounds.box.max().z(), std::max(2, int(area.height / 14.0)), false);
  DrawXAxis(page, plot, "time [s]", theme);
  DrawYAxis(page, plot, "z [" + figure.unit + "]", theme);
  DrawPaths(page, figure, theme, [&](const TrajectoryFigure::Pose& pose) {
    return plot.At(pose.time - bounds.first_time, pose.position.z());
  });
}

}  // namespace

FigurePage DrawTrajectories(const TrajectoryFigure& figure, const FigureOptions& options) {
  const PathBounds bounds = BoundsOf(figure);
  FigureSheet sheet =
      MakeSheet(options, kColumnWidth, "Camera path", [&](double width, const FigureTheme& theme) {
        const Eigen::Vector2d size = bounds.box.sizes().head<2>();
        const double plot_width = width - 3.5 * theme.font;
        return AroundPlot(figure, theme, width) + plot_width * std::clamp(size.y() / size.x(), 0.35, 1.1);
      });
  const FigureTheme& theme = sheet.theme;
  const FigureRect& area = sheet.area;
  const double around = AroundPlot(figure, theme, area.width);
  const double plot_height = area.height - around;
  if (plot_height < 20.0) {
    throw UsageError("the figure is too low for its plot, expected a larger height");
  }
  const std::vector<LegendEntry> entries = PathLegend(figure, theme);
  const double legend = LegendHeight(entries, area.width, theme);
  DrawLegend(sheet.page, entries, {area.x, area.y, area.width, legend}, theme);
  // The axis and the width of its tick labels depend on each other: the width of a first axis is used.
  FigureRect above{area.x, area.y + legend + kTrajectoryGap, area.width - 6.0, plot_height};
  const double left = YAxisWidth(EqualAxes(above, bounds).y, theme) + 2.0;
  above.x += left;
  above.width -= left;
  const PlotArea plot = EqualAxes(above, bounds);
  DrawXAxis(sheet.page, plot, "x [" + figure.unit + "]", theme);
  DrawYAxis(sheet.page, plot, "y [" + figure.unit + "]", theme);
  DrawPaths(sheet.page, figure, theme, [&plot](const TrajectoryFigure::Pose& pose) {
    return plot.At(pose.position.x(), pose.position.y());
  });
  DrawFootprints(sheet.page, plot, figure, theme);
  if (figure.heights) {
    const double top = above.Bottom() + XAxisHeight(theme) + 1.6 * kTrajectoryGap;
    DrawPathHeights(sheet.page, {above.x, top, above.width, area.Bottom() - XAxisHeight(theme) - top}, figure,
                    bounds, theme);
  }
  return std::move(sheet.page);
}

TrajectoryFigure::Pieces PiecesOf(const Trajectory& trajectory, const Sim3d& S_figure_map) {
  TrajectoryFigure::Pieces pieces;
  for (const Trajectory& piece : SplitAtGaps(trajectory)) {
    pieces.emplace_back();
    for (const TimedPose& pose : piece) {
      pieces.back().push_back({pose.timestamp, S_figure_map * pose.T_map_camera.translation});
    }
  }
  return pieces;
}

namespace {

struct PathOptions {
  std::string ground_truth;
  double max_time_difference = 0.02;
  bool heights = false;
  void VisitFields(auto&& visit) {
    visit("--ground-truth DIR", "Sequence folder with poses, as for sqslam eval", ground_truth);
    visit("--heights", "Height over time below", heights);
    visit("--max-time-difference S", "Between a pose and the true one, seconds", max_time_difference, 0.0,
          10.0);
  }
};

std::string LengthText(double metres) {
  return metres < 0.01  ? fmt::format("{:.1f} mm", 1000.0 * metres)
         : metres < 1.0 ? fmt::format("{:.1f} cm", 100.0 * metres)
                        : fmt::format("{:.3g} m", metres);
}

Trajectory ReadPath(const std::string& result) {
  const fs::path file = ResultFile(result, "trajectory.txt");
  FinishRescaling(file.parent_path() / "map.sqmap");
  Trajectory trajectory = ReadTrajectory(file);
  ThrowIf<InputError>(trajectory.empty(), "{}: holds no pose, expected a camera path", result);
  return trajectory;
}

TrajectoryError AlignPath(const std::string& name, const Trajectory& path, const Trajectory& reference,
                          double max_time_difference) {
  const auto error = ComputeTrajectoryError(path, reference, max_time_difference);
  ThrowIf<InputError>(
      !error,
      "{}: cannot be aligned, expected at least three poses within {} s of the reference, not on one line",
      name, max_time_difference);
  return *error;
}

TrajectoryFigure AgainstTruth(const FigureRequest& request, const PathOptions& options,
                              const std::vector<std::string>& names) {
  const Trajectory truth = ReadTruePoses(options.ground_truth);
  TrajectoryFigure figure;
  Sim3d S_figure_world;
  for (std::size_t i = 0; i < request.results.size(); ++i) {
    const Trajectory path = ReadPath(request.results[i]);
    const TrajectoryError error = AlignPath(request.results[i], path, truth, options.max_time_difference);
    if (i == 0) {  // aligned to the map, as only its z axis is known to point up
      S_figure_world.rotation = error.S_world_map.rotation.conjugate();
      S_figure_world.translation = -(S_figure_world.rotation * truth.front().T_map_camera.translation);
      figure.truth = {"ground truth", PiecesOf(truth, S_figure_world)};
    }
    figure.paths.push_back({fmt::format("{} (ATE {})", names[i], LengthText(error.rmse)),
                            PiecesOf(path, S_figure_world * error.S_world_map)});
  }
  return figure;
}

TrajectoryFigure WithoutTruth(const FigureRequest& request, const PathOptions& options,
                              const std::vector<std::string>& names) {
  TrajectoryFigure figure;
  const fs::path recording =
      ResultFile(request.results.front(), "trajectory.txt").parent_path() / "map.sqmap";
  figure.unit = fs::exists(recording) && ReadMapScale(recording) ? "m" : "map units";
  const Trajectory first = ReadPath(request.results.front());
  for (std::size_t i = 0; i < request.results.size(); ++i) {
    const Trajectory path = ReadPath(request.results[i]);
    const Sim3d S_first_map =
        i == 0 ? Sim3d()
               : AlignPath(request.results[i], path, first, options.max_time_difference).S_world_map;
    figure.paths.push_back({names[i], PiecesOf(path, S_first_map)});
  }
  return figure;
}

FigurePage DrawTrajectoriesOf(const FigureRequest& request, const PathOptions& options) {
  const std::vector<std::string> names = ResultNames(request);
  TrajectoryFigure figure = options.ground_truth.empty() ? WithoutTruth(request, options, names)
                                                         : AgainstTruth(request, options, names);
  figure.heights = options.heights;
  return DrawTrajectories(figure, request.page);
}

}  // namespace

FigureEntry TrajectoryEntry() {
  return {.name = "trajectory",
          .help = "Camera paths from above, against the true one",
          .details = R"(
Camera paths (trajectory.txt) seen from above, both axes at one scale. With --ground-truth each path is laid over
the true one by the best similarity (scale, rotation, translation); the legend says what error is left (ATE,
RMSE over all tracked frames), and lengths are metres. Up is up in the first result's map. Without it the first
path is drawn in its map's units (metres after sqslam scale) and further ones are laid over it. Paths break where tracking was lost.

Examples:
  sqslam figure trajectory out/desk --ground-truth data/desk -o path.pdf
  sqslam figure trajectory out/a out/b --name "full" --name "no loops" --ground-truth data/desk -o path.svg
  sqslam figure trajectory out/desk --ground-truth data/desk --heights -o path.png --width-mm 120
)",
          .results_help = "Result folders of sqslam run, or their trajectory.txt",
          .several = true,
          .names_help = kNameInLegend,
          .make = FigureEntry::Maker(DrawTrajectoriesOf)};
}

}  // namespace sqslam
