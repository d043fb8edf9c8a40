#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "render/figures/figure_input.h"
#include "render/figures/figure_names.h"
#include "render/page/chart.h"
#include "slam/evaluation/ground_truth.h"
#include "slam/evaluation/trajectory_error.h"
#include "slam/io/result_files.h"
#include "slam/io/trajectory.h"
#include "slam/snapshot/map_scale.h"
#include "slam/snapshot/recording.h"
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

void DrawStart(FigureSheet& sheet, const Eigen::Vector2d& center) {
  sheet.page.Polygon(center, 32, 2.5, sheet.theme.ink);
}

FigureStroke PathStroke(std::size_t index) {
  const SeriesLook look = LookOfSeries(index);
  return {look.color, kPathWidth, look.dash};
}

std::vector<LegendEntry> PathLegend(const TrajectoryFigure& figure, const FigureTheme& theme) {
  std::vector<LegendEntry> entries;
  if (figure.truth) {
    entries.push_back(LegendEntry::Line(figure.truth->name, TruthStroke(theme)));
  }
  for (std::size_t i = 0; i < figure.paths.size(); ++i) {
    entries.push_back(LegendEntry::Line(figure.paths[i].name, PathStroke(i)));
  }
  entries.push_back(LegendEntry::Mark("start", DrawStart));
  return entries;
}

// Draws a path; `place` maps a pose to the page.
void DrawPieces(FigurePage& page, const TrajectoryFigure::Pieces& pieces, const FigureStroke& stroke,
                const auto& place) {
  constexpr double kMinStep = 0.1;  // points; finer steps are not visible and enlarge the file
  for (const auto& piece : pieces) {
    std::vector<Eigen::Vector2d> points;
    for (std::size_t i = 0; i < piece.size(); ++i) {
      const Eigen::Vector2d p = place(piece[i]);
      if (points.empty() || i + 1 == piece.size() || (p - points.back()).norm() > kMinStep) {
        points.push_back(p);
      }
    }
    page.Polyline(std::move(points), stroke);
  }
}

void DrawPaths(FigureSheet& sheet, const TrajectoryFigure& figure, const auto& place) {
  if (figure.truth) {
    DrawPieces(sheet.page, figure.truth->pieces, TruthStroke(sheet.theme), place);
  }
  for (std::size_t i = 0; i < figure.paths.size(); ++i) {
    DrawPieces(sheet.page, figure.paths[i].pieces, PathStroke(i), place);
  }
  for (const TrajectoryFigure::Path& path : figure.paths) {
    if (!path.pieces.empty() && !path.pieces.front().empty()) {
      DrawStart(sheet, place(path.pieces.front().front()));
    }
  }
}

}  // namespace

namespace {

// Returns the outlines in a picture of a part of a page, and for each of its pixels the smallest object
// there.
cv::Mat1i NumberImage(const std::vector<std::vector<Eigen::Vector2d>>& outlines, const FigureRect& room) {
  constexpr double kScale = FigureNames::kPixelsPerPoint;
  std::vector<std::pair<double, std::size_t>> order;  // by area
  std::vector<std::vector<cv::Point>> polygons;
  for (const std::vector<Eigen::Vector2d>& outline : outlines) {
    polygons.push_back(ToVector(outline, [&room](const Eigen::Vector2d& p) {
      return cv::Point(cvRound(kScale * (p.x() - room.x)), cvRound(kScale * (p.y() - room.y)));
    }));
    if (!outline.empty()) {
      order.emplace_back(cv::contourArea(polygons.back()), polygons.size() - 1);
    }
  }
  std::ranges::stable_sort(order, std::greater(), [](const auto& entry) { return entry.first; });
  cv::Mat1i number(cvRound(kScale * room.height), cvRound(kScale * room.width), -1);
  for (const auto& [polygon_area, i] : order) {
    cv::fillPoly(number, std::vector{polygons[i]}, cv::Scalar(static_cast<double>(i)));
  }
  return number;
}

}  // namespace

std::vector<std::size_t> DrawFootprints(FigureSheet& sheet, const PlotArea& plot, const FigureRect& room,
                                        const std::vector<TrajectoryFigure::Footprint>& objects) {
  auto& [page, area, theme] = sheet;
  std::vector<std::vector<Eigen::Vector2d>> outlines;
  for (const TrajectoryFigure::Footprint& object : objects) {
    FigurePath path{{}, true, object.color, 0.22, FigureStroke{object.color, 0.8, {}}};
    if (object.uncertain) {
      path.fill.reset();
      path.stroke->dash = {2.0, 2.0};
    }
    path.points =
        ToVector(object.outline, [&plot](const Eigen::Vector3d& p) { return plot.At(p.x(), p.y()); });
    outlines.push_back(path.points);
    page.elements.emplace_back(std::move(path));
  }
  const cv::Mat1i number = NumberImage(outlines, room);
  FigureNames writer(sheet, room, number.size(), theme.small);
  std::vector<std::string> names;
  std::vector<Eigen::Vector3d> inks;
  std::vector<LabelRequest> requests;
  for (std::size_t i = 0; i < objects.size(); ++i) {
    names.push_back(objects[i].name);
    inks.push_back(objects[i].uncertain ? theme.muted : theme.ink);
    const VisiblePart part = VisiblePartOf(number == static_cast<int>(i));
    const cv::Size size = writer.SizeOf(names.back());
    // Numbers lie on their objects, and are placed before names.
    const bool is_number = names.back().find_first_not_of("0123456789") == std::string::npos;
    requests.push_back(
        {part, size, is_number ? 0.0 : static_cast<double>(part.bounds.area()), static_cast<int>(i)});
    // Within a large object; on a small one a name would hide it.
    if (is_number || (part.bounds.width > size.width && part.bounds.height > size.height)) {
      requests.back().first = cv::Rect(part.anchor - cv::Point(size / 2), size);
    }
  }
  return writer.Draw(names, inks, requests, number);
}

namespace {

double HeightsBlock(const FigureTheme& theme) { return 60.0 + XAxisHeight(theme) + kTrajectoryGap; }

// Returns the height of everything below the x-y plot, points.
double BelowPlot(const TrajectoryFigure& figure, const FigureTheme& theme) {
  return XAxisHeight(theme) + (figure.heights ? HeightsBlock(theme) : 0.0);
}

// Gives both axes the same scale; the shorter range is widened to fill the area.
PlotArea EqualAxes(const FigureRect& area, const PathBounds& bounds) {
  const Eigen::Vector2d size = bounds.box.sizes().head<2>();
  const double scale = std::min(area.width / size.x(), area.height / size.y());
  const Eigen::Vector2d middle = 0.5 * (bounds.box.max() + bounds.box.min()).head<2>();
  const Eigen::Vector2d half = 0.5 * Eigen::Vector2d(area.width, area.height) / scale;
  constexpr double kTickSpacing = 28.0;  // points, roughly; the same for both axes
  const double step = RoundAxis(0.0, 2.0 * kTickSpacing / scale, 2, false).step;
  return {area,
          {middle.x() - half.x(), middle.x() + half.x(), step},
          {middle.y() - half.y(), middle.y() + half.y(), step}};
}

void DrawPathHeights(FigureSheet& sheet, const FigureRect& area, const TrajectoryFigure& figure,
                     const PathBounds& bounds) {
  const double duration = bounds.last_time - bounds.first_time;
  const PlotArea plot{
      area, RoundAxis(-0.02 * duration, 1.02 * duration, std::max(2, int(area.width / 35.0)), false),
      RoundAxis(bounds.box.min().z(), bounds.box.max().z(), std::max(2, int(area.height / 14.0)), false)};
  DrawXAxis(sheet, plot, "time [s]");
  DrawYAxis(sheet, plot, "z [" + figure.unit + "]");
  DrawPaths(sheet, figure, [&](const TrajectoryFigure::Pose& pose) {
    return plot.At(pose.time - bounds.first_time, pose.position.z());
  });
}

}  // namespace

FigurePage DrawTrajectories(const TrajectoryFigure& figure, const FigureOptions& options) {
  const PathBounds bounds = BoundsOf(figure);
  FigureSheet sheet = MakeChartSheet(
      options, kColumnWidth, "Camera path", PathLegend(figure, FigureTheme(options)), kTrajectoryGap,
      [&](double width, const FigureTheme& theme) {
        const Eigen::Vector2d size = bounds.box.sizes().head<2>();
        const double plot_width = width - 3.5 * theme.font;
        return BelowPlot(figure, theme) + plot_width * std::clamp(size.y() / size.x(), 0.35, 1.1);
      });
  // The axis and the width of its tick labels depend on each other: the width of a first axis is used.
  FigureRect area{sheet.area.x, sheet.area.y, sheet.area.width - 6.0,
                  sheet.area.height - BelowPlot(figure, sheet.theme)};
  ThrowIf<UsageError>(area.height < 20.0, "the figure is too low for its plot, expected a larger height");
  const double left = YAxisWidth(EqualAxes(area, bounds).y, sheet.theme) + 2.0;
  area.x += left;
  area.width -= left;
  const PlotArea plot = EqualAxes(area, bounds);
  DrawXAxis(sheet, plot, "x [" + figure.unit + "]");
  DrawYAxis(sheet, plot, "y [" + figure.unit + "]");
  DrawPaths(sheet, figure, [&plot](const TrajectoryFigure::Pose& pose) {
    return plot.At(pose.position.x(), pose.position.y());
  });
  DrawFootprints(sheet, plot, plot.area, figure.objects);
  if (figure.heights) {
    const double axis = XAxisHeight(sheet.theme);
    const double top = area.Bottom() + axis + 1.6 * kTrajectoryGap;
    DrawPathHeights(sheet, {area.x, top, area.width, sheet.area.Bottom() - axis - top}, figure, bounds);
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

// Returns the paths on the true one, aligned to the first map, as only its z axis is known to point up.
TrajectoryFigure AgainstTruth(const FigureRequest& request, const PathOptions& options,
                              const std::vector<std::string>& names) {
  const Trajectory truth = ReadTruePoses(options.ground_truth);
  TrajectoryFigure figure;
  Sim3d S_figure_world;
  for (std::size_t i = 0; i < request.results.size(); ++i) {
    const Trajectory path = ReadPath(request.results[i]);
    const TrajectoryError error = AlignPath(request.results[i], path, truth, options.max_time_difference);
    if (i == 0) {
      S_figure_world.rotation = error.S_world_map.rotation.conjugate();
      S_figure_world.translation = -(S_figure_world.rotation * truth.front().T_map_camera.translation);
      figure.truth = {"ground truth", PiecesOf(truth, S_figure_world)};
    }
    figure.paths.push_back({fmt::format("{} (ATE {})", names[i], LengthText(error.rmse)),
                            PiecesOf(path, S_figure_world * error.S_world_map)});
  }
  return figure;
}

// Returns the sequence that a result was mapped from; empty: not known.
std::string SequenceOf(const std::string& result) {
  const fs::path recording = ResultFile(result, "trajectory.txt").parent_path() / "map.sqmap";
  return fs::exists(recording) ? RecordingReader(recording).Info().sequence_path : "";
}

// Returns the paths on the first one.
TrajectoryFigure WithoutTruth(const FigureRequest& request, const PathOptions& options,
                              const std::vector<std::string>& names) {
  TrajectoryFigure figure;
  const fs::path recording =
      ResultFile(request.results.front(), "trajectory.txt").parent_path() / "map.sqmap";
  figure.unit = fs::exists(recording) && ReadMapScale(recording) ? "m" : "map units";
  Trajectory first;
  for (std::size_t i = 0; i < request.results.size(); ++i) {
    const Trajectory path = ReadPath(request.results[i]);
    if (i == 0) {
      first = path;
      figure.paths.push_back({names[i], PiecesOf(path, {})});
      continue;
    }
    const TrajectoryError apart = AlignPath(request.results[i], path, first, options.max_time_difference);
    const bool related = SequenceOf(request.results[i]) == SequenceOf(request.results.front());
    figure.paths.push_back(
        {fmt::format("{} (aligned{}, {:.2g} {} RMSE)", names[i], related ? "" : ", another sequence",
                     apart.rmse < 1e-9 ? 0.0 : apart.rmse, figure.unit),
         PiecesOf(path, apart.S_world_map)});
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
  return FigureEntry{.name = "trajectory",
                     .help = "Camera paths from above, against the true one",
                     .details = R"(
Camera paths (trajectory.txt) seen from above, both axes at one scale. With --ground-truth each path is aligned to
the true one by the best similarity (scale, rotation, translation). The legend gives the remaining error (ATE,
RMSE over all tracked frames); lengths are metres. Up is up in the first result's map. Without --ground-truth the
first path is drawn in its map's units (metres after sqslam scale), and the others are aligned to it by their times;
the legend gives the remaining difference and says which are of another sequence. Paths break where tracking was
lost.

Examples:
  sqslam figure trajectory out/desk --ground-truth data/desk -o path.pdf
  sqslam figure trajectory out/a out/b --name "full" --name "no loops" --ground-truth data/desk -o path.svg
  sqslam figure trajectory out/desk --ground-truth data/desk --heights -o path.png --width-mm 120
)",
                     .results_help = "Result folders of sqslam run, or their trajectory.txt",
                     .several = true}
      .DrawnBy(DrawTrajectoriesOf);
}

}  // namespace sqslam
