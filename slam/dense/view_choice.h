#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "slam/dense/cost_volume.h"
#include "slam/dense/dense_options.h"
#include "slam/geometry/camera.h"
#include "slam/geometry/rigid3.h"

namespace sqslam {

// A frame of the sequence whose pose is known.
struct PosedFrame {
  std::int64_t index = 0;
  Rigid3d T_map_camera;
};

// The map points that fall into the image, all but those that are cut off at both ends of the depths; every
// so many of them, so that no more than `most` are left.
std::vector<Eigen::Vector3d> PointsInView(const std::vector<Eigen::Vector3d>& points, const Camera& camera,
                                          const Rigid3d& T_map_camera, std::size_t most);

// Depths between which the keyframe's surfaces lie, by the map points in view; empty where these are too few.
std::optional<DepthRange> RangeOf(const std::vector<Eigen::Vector3d>& in_view, const Rigid3d& T_map_camera,
                                  const ViewOptions& options);

// A frame's view of the map points that a keyframe sees.
struct Parallax {
  double overlap = 0.0;  // share of the points that it sees too
  double angle = 0.0;    // degrees, median between the rays to them
};
Parallax ParallaxOf(const std::vector<Eigen::Vector3d>& in_view, const Camera& camera,
                    const Rigid3d& keyframe, const Rigid3d& frame);

// Frames that show what the keyframe does: for each of the angles (degrees between the rays) two at most, on
// opposite sides of the keyframe if there are such. Positions in `frames`.
std::vector<std::size_t> ChooseViews(const PosedFrame& keyframe, const std::vector<PosedFrame>& frames,
                                     const std::vector<Eigen::Vector3d>& in_view, const Camera& camera,
                                     const std::vector<double>& angles, const ViewOptions& options);

// The keyframes, `count` at most, that see most of what the keyframe sees, from another place but not from
// too far aside. Positions in `keyframes`.
std::vector<std::size_t> ChooseNeighbours(std::size_t keyframe, const std::vector<PosedFrame>& keyframes,
                                          const std::vector<Eigen::Vector3d>& in_view, const Camera& camera,
                                          int count);

}  // namespace sqslam
