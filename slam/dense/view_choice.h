#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "slam/dense/dense_options.h"
#include "slam/geometry/camera.h"
#include "slam/geometry/rigid3.h"

namespace sqslam {

// Range of depths to search, map units.
struct DepthRange {
  double nearest = 0.0;
  double farthest = 0.0;
};

inline constexpr double kMinViewAngle =
    0.8;  // degrees; views with less parallax carry no information on depth

// A frame of the sequence whose pose is known.
struct PosedFrame {
  std::int64_t index = 0;
  Rigid3d T_map_camera;
};

// Returns the map points in the image, nearest first, without the extreme depths at both ends; thinned out
// evenly to at most `most`.
std::vector<Eigen::Vector3d> PointsInView(const std::vector<Eigen::Vector3d>& points, const Camera& camera,
                                          const Rigid3d& T_map_camera, std::size_t most);

// Returns the depth range of the keyframe's map points in view, or nothing if they are too few.
std::optional<DepthRange> RangeOf(const std::vector<Eigen::Vector3d>& in_view, const Rigid3d& T_map_camera);

// View of a frame on the map points that a keyframe sees.
struct Parallax {
  double overlap = 0.0;  // share of the points that the frame sees
  double angle = 0.0;    // degrees, median parallax angle
};
Parallax ParallaxOf(const std::vector<Eigen::Vector3d>& in_view, const Camera& camera,
                    const Rigid3d& keyframe, const Rigid3d& frame);

// Chooses frames that see the keyframe's map points: for each of the parallax angles (degrees) at most two,
// on opposite sides of the keyframe if possible. Returns positions in `frames`.
std::vector<std::size_t> ChooseViews(const PosedFrame& keyframe, const std::vector<PosedFrame>& frames,
                                     const std::vector<Eigen::Vector3d>& in_view, const Camera& camera,
                                     const std::vector<double>& angles, const ViewOptions& options);

// Chooses at most `count` keyframes that see most of the keyframe's map points, preferably without a large
// parallax. Returns positions in `keyframes`.
std::vector<std::size_t> ChooseNeighbours(std::size_t keyframe, const std::vector<PosedFrame>& keyframes,
                                          const std::vector<Eigen::Vector3d>& in_view, const Camera& camera,
                                          int count);

}  // namespace sqslam
