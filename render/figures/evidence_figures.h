#pragma once

#include <array>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "render/figures/panel_figures.h"
#include "render/page/figure_options.h"
#include "slam/geometry/box2.h"
#include "slam/snapshot/snapshot.h"

namespace sqslam {

// Figures that show what objects were estimated from. Throw UsageError where the size leaves no room,
// std::runtime_error without OpenGL.

// The points that objects kept and those that outlier removal took away, over an image with the object's box
// and around the translucent superquadric.
struct OutliersFigure {
  enum class Fate { kKept, kIsolated, kRemovedBefore };  // isolated: by its score; before: without one
  struct Point {
    Eigen::Vector3d p_map = Eigen::Vector3d::Zero();
    double anomaly = 0.0;  // in [0, 1]; 0: no score
    Fate fate = Fate::kKept;
    std::optional<Eigen::Vector2d> pixel;  // on the image; empty: not in it
  };
  struct Object {
    std::string name;
    MapSnapshot map;  // its keyframes, from whose side it is seen, and the one object
    std::vector<Point> points;
    cv::Mat image;          // as recorded; empty: none
    Box2d box;              // the object's, pixels of the image
    int quarter_turns = 0;  // clockwise, that turn the image upright
  };
  std::vector<Object> objects;
  double threshold = 0.0;  // score above which points are removed
};
FigurePage DrawOutliers(const OutliersFigure& figure, const FigureOptions& options,
                        const FigureProgress& progress = {});

// Line segments of an object's image against the axes of its frame, moved to a corner of the box around it,
// before and after yaw was estimated.
struct YawFigure {
  struct Line {
    Eigen::Vector2d from = Eigen::Vector2d::Zero();  // pixels of the image
    Eigen::Vector2d to = Eigen::Vector2d::Zero();
    int axis = -1;  // 0, 1, 2 (x, y, z) that it is matched to; -1: none
  };
  struct View {
    Eigen::Vector2d corner = Eigen::Vector2d::Zero();  // pixels of the image
    std::array<Eigen::Vector2d, 3> ends{};             // of the axes
    std::vector<Line> lines;
    double mean_angle = 0.0;  // of the lines that tell the yaw to their axes, degrees
  };
  struct Object {
    std::string name;
    cv::Mat image;          // without distortion
    Box2d region;           // of the image that is shown at least
    int quarter_turns = 0;  // clockwise, that turn the image upright
    View before;
    View after;
    int yaw_lines = 0;  // matched lines that tell the yaw
    double yaw = 0.0;   // of the axes after, from those before, degrees
  };
  std::vector<Object> objects;
};
FigurePage DrawYaw(const YawFigure& figure, const FigureOptions& options);

}  // namespace sqslam
