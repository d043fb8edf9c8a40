#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "slam/features/frame_features.h"
#include "slam/map/ids.h"

namespace sqslam {

struct Observation {
  KeyframeId keyframe = kNoKeyframe;
  int keypoint = 0;
};

struct MapPoint {
  PointId id = kNoPoint;
  Eigen::Vector3d p_map = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  // mean direction from which it was seen, unit length
  double min_distance = 0.0;                         // camera distances at which it can be matched, map units
  double max_distance = 0.0;
  double level_zero_distance = 0.0;  // at which the finest pyramid level shows it as it was first seen
  Descriptor descriptor{};           // the observed one nearest to all others
  std::array<std::uint8_t, 3> rgb{};
  std::vector<Observation> observations;
  KeyframeId first_keyframe = kNoKeyframe;
  int visible = 1;  // frames in which it was predicted to be in the image
  int found = 1;    // frames in which it was matched

  double FoundRatio() const { return static_cast<double>(found) / visible; }
};

}  // namespace sqslam
