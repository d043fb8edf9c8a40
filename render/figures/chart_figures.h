#pragma once

#include <Eigen/Core>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "render/page/figure_options.h"

namespace sqslam {

// Figures that are charts: lines and texts only. Throw UsageError where the size leaves no room.

// Camera paths seen from above, x to the right and y up, at one scale for both.
struct TrajectoryFigure {
  struct Pose {
    double time = 0.0;  // seconds
    Eigen::Vector3d position = Eigen::Vector3d::Zero();
  };
  using Pieces = std::vector<std::vector<Pose>>;  // between losses of tracking
  struct Path {
    std::string name;
    Pieces pieces;
  };
  std::optional<Path> truth;
  std::vector<Path> paths;
  std::string unit = "m";
  bool heights = false;  // z over time below
};
FigurePage DrawTrajectories(const TrajectoryFigure& figure, const FigureOptions& options);

// Times of stages as bars of their means, with medians and 95th percentiles. A stage's name is
// "group" or "group.stage"; each group has an axis of its own.
struct TimingFigure {
  struct Times {
    double mean = 0.0;  // milliseconds
    double median = 0.0;
    double p95 = 0.0;
  };
  struct Series {
    std::string name;
    std::map<std::string, Times> stages;
  };
  std::vector<Series> series;
  std::vector<std::string> stages;  // in this order within a group
};
FigurePage DrawTiming(const TimingFigure& figure, const FigureOptions& options);

// 3D IoU object by object, and the means over them, objects that a series has not found counting 0.
struct IouFigure {
  struct Series {
    std::string name;
    std::vector<std::optional<double>> values;  // one an object, in [0, 1]; empty: not found
  };
  std::vector<std::string> objects;
  std::vector<Series> series;
};
FigurePage DrawIou(const IouFigure& figure, const FigureOptions& options);

}  // namespace sqslam
