#include <fmt/format.h>

#include <algorithm>
#include <memory>

#include "app/figures/figure_common.h"
#include "render/figures/chart_figures.h"
#include "render/page/write_figure.h"
#include "slam/evaluation/ground_truth_poses.h"
#include "slam/evaluation/trajectory_error.h"
#include "slam/io/sequence.h"
#include "slam/io/trajectory.h"
#include "slam/util/error.h"
#include "slam/util/statistics.h"

namespace sqslam::app {
namespace fs = std::filesystem;
namespace {

constexpr const char* kTrajectoryFooter = R"(
Camera paths (trajectory.txt) seen from above, both axes at one scale. With --ground-truth each path is laid over
the true one by the best similarity (scale, rotation, translation); the legend says what error is left (ATE,
RMSE over all tracked frames), and lengths are metres. Up is up in the first result's map. Without it the first
path is drawn in its map's units and further ones are laid over it. Paths break where tracking was lost.

Examples:
  sqslam figure trajectory out/desk --ground-truth data/desk --output path.pdf
  sqslam figure trajectory out/a out/b --name "full" --name "no loops" --ground-truth data/desk --output path.svg
  sqslam figure trajectory out/desk --ground-truth data/desk --heights --output path.png --width-mm 120
)";

struct TrajectoryArguments : FigureArguments {
  std::vector<std::string> results;
  std::vector<std::string> names;
  std::string ground_truth;
  double max_time_difference = 0.02;
  bool heights = false;
};

Trajectory TrajectoryOf(const fs::path& result) {
  return ReadTrajectory(fs::is_directory(result) ? result / "trajectory.txt" : result);
}

// Splits where several frames are missing.
TrajectoryFigure::Pieces PiecesOf(const Trajectory& trajectory, const Sim3d& S_figure_map) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < trajectory.size(); ++i) {
    steps.push_back(trajectory[i].timestamp - trajectory[i - 1].timestamp);
  }
  const double usual = steps.empty() ? 0.0 : UpperMedian(steps);
  TrajectoryFigure::Pieces pieces;
  for (std::size_t i = 0; i < trajectory.size(); ++i) {
    if (i == 0 || steps[i - 1] > 5.0 * usual + 1e-9) {
      pieces.emplace_back();
    }
    pieces.back().push_back({trajectory[i].timestamp, S_figure_map * trajectory[i].T_map_camera.translation});
  }
  return pieces;
}

std::string LengthText(double metres) {
  return metres < 0.01  ? fmt::format("{:.1f} mm", 1000.0 * metres)
         : metres < 1.0 ? fmt::format("{:.1f} cm", 100.0 * metres)
                        : fmt::format("{:.3g} m", metres);
}

Trajectory Readable(const fs::path& result) {
  Trajectory trajectory = TrajectoryOf(result);
  if (trajectory.empty()) {
    throw InputError(fmt::format("{}: holds no pose, expected a camera path", result.string()));
  }
  return trajectory;
}

TrajectoryError Align(const std::string& name, const Trajectory& path, const Trajectory& reference,
                      double max_time_difference) {
  const auto error = ComputeTrajectoryError(path, reference, max_time_difference);
  if (!error) {
    throw InputError(fmt::format(
        "{}: cannot be aligned, expected at least three poses within {} s of the reference, not on one line",
        name, max_time_difference));
  }
  return *error;
}

TrajectoryFigure AgainstTruth(const TrajectoryArguments& a, const std::vector<std::string>& names) {
  SequenceRequest request;
  request.path = a.ground_truth;
  const Trajectory truth = ReadGroundTruthPoses(OpenSequence(request));
  TrajectoryFigure figure;
  Sim3d S_figure_world;
  for (std::size_t i = 0; i < a.results.size(); ++i) {
    const Trajectory path = Readable(a.results[i]);
    const TrajectoryError error = Align(a.results[i], path, truth, a.max_time_difference);
    if (i == 0) {  // the world's axes may point anywhere; the map's z is up
      S_figure_world.rotation = error.S_world_map.rotation.conjugate();
      S_figure_world.translation = -(S_figure_world.rotation * truth.front().T_map_camera.translation);
      figure.truth = {"ground truth", PiecesOf(truth, S_figure_world)};
    }
    figure.paths.push_back({fmt::format("{} (ATE {})", names[i], LengthText(error.rmse)),
                            PiecesOf(path, S_figure_world * error.S_world_map)});
  }
  return figure;
}

TrajectoryFigure WithoutTruth(const TrajectoryArguments& a, const std::vector<std::string>& names) {
  TrajectoryFigure figure;
  figure.unit = "map units";
  const Trajectory first = Readable(a.results.front());
  for (std::size_t i = 0; i < a.results.size(); ++i) {
    const Trajectory path = Readable(a.results[i]);
    const Sim3d S_first_map =
        i == 0 ? Sim3d() : Align(a.results[i], path, first, a.max_time_difference).S_world_map;
    figure.paths.push_back({names[i], PiecesOf(path, S_first_map)});
  }
  return figure;
}

void Draw(const TrajectoryArguments& a) {
  const FigureOptions options = MakeFigureOptions(a);
  const std::vector<std::string> names = NamesOf(a.results, a.names);
  TrajectoryFigure figure = a.ground_truth.empty() ? WithoutTruth(a, names) : AgainstTruth(a, names);
  figure.heights = a.heights;
  WriteFigure(DrawTrajectories(figure, options), a.output);
}

}  // namespace

void AddTrajectoryFigure(CLI::App& figure) {
  const auto a = std::make_shared<TrajectoryArguments>();
  CLI::App* command = AddFigure(figure, "trajectory", "Camera paths from above, against the true one",
                                kTrajectoryFooter, FigureKind::kChart, *a);
  command->add_option("RESULT", a->results, "Result folders of sqslam run, or their trajectory.txt")
      ->required();
  command->add_option("--ground-truth", a->ground_truth, "Sequence folder with poses, as for sqslam eval");
  command->add_option("--name", a->names, "Name of a result in the legend, repeatable, in their order")
      ->expected(1)
      ->take_all();
  command->add_flag("--heights", a->heights, "Height over time below");
  command
      ->add_option("--max-time-difference", a->max_time_difference,
                   "Between a pose and the true one, seconds")
      ->check(CLI::Range(0.0, 10.0))
      ->capture_default_str();
  command->callback([a] { Draw(*a); });
}

}  // namespace sqslam::app
