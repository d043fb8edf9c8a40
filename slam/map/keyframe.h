#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "slam/features/frame_features.h"
#include "slam/map/scaled_pose.h"
#include "slam/recognition/bag_of_words.h"

namespace sqslam {

using BagOfWordsPtr = std::shared_ptr<const BagOfWords>;

// A frame that the map keeps, and its place in the covisibility graph and the spanning tree (ORB-SLAM,
// Mur-Artal et al. 2015, III-C).
struct Keyframe {
  KeyframeId id = kNoKeyframe;
  std::int64_t frame_index = 0;
  double timestamp = 0.0;  // seconds
  Rigid3d T_camera_map;
  double scale = 1.0;  // see ScaledPose
  FrameFeaturesPtr features;
  BagOfWordsPtr words;                     // null where places are not recognised
  std::vector<PointId> points;             // one per keypoint, kNoPoint where none
  std::map<KeyframeId, int> covisibility;  // shared map points, for keyframes that share enough
  KeyframeId parent = kNoKeyframe;         // the most covisible older keyframe

  ScaledPose Pose() const { return {T_camera_map, scale}; }
  Eigen::Vector3d Center() const { return T_camera_map.Inverse().translation; }

  // The `count` most covisible keyframes, best first.
  std::vector<KeyframeId> BestCovisible(int count) const;
};

}  // namespace sqslam
