#include "slam/tracking/frame_refinement.h"

#include "slam/estimation/pose_optimization.h"

namespace sqslam {

std::vector<FrameMatch> MatchesOf(const TrackedFrame& frame, const ScaleLevels& levels) {
  std::vector<FrameMatch> matches;
  for (std::size_t i = 0; i < frame.points.size(); ++i) {
    if (frame.points[i] != kNoPoint) {
      const Keypoint& keypoint = frame.features->keypoints[i];
      matches.push_back({frame.points[i], keypoint.pixel.cast<float>(),
                         static_cast<float>(levels.Variance(keypoint.octave))});
    }
  }
  return matches;
}

Rigid3d RefineFrame(const Map& map, const Camera& camera, const std::vector<FrameMatch>& matches,
                    int min_inliers, const Rigid3d& T_camera_map) {
  std::vector<PointObservation> observations;
  for (const FrameMatch& match : matches) {
    if (const PointId point = map.Resolve(match.point); point != kNoPoint) {
      observations.push_back({map.Point(point).p_map, match.pixel.cast<double>(), match.variance, true});
    }
  }
  Rigid3d refined = T_camera_map;
  const bool enough = static_cast<int>(observations.size()) >= min_inliers &&
                      OptimizePose(camera, observations, refined) >= min_inliers;
  return enough ? refined : T_camera_map;
}

}  // namespace sqslam
