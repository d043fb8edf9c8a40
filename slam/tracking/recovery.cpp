// Tracker's way back after a short loss: keyframes that look like the image, descriptors, P3P.

#include <Eigen/LU>
#include <algorithm>
#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>

#include "slam/features/matching.h"
#include "slam/tracking/tracker.h"

namespace sqslam {
namespace {

// The keyframes whose blurred thumbnails are nearest to the image's, and always the one tracked last.
std::vector<KeyframeId> SimilarKeyframes(const TrackingView& view, const cv::Mat& thumbnail, KeyframeId last,
                                         int count) {
  std::vector<std::pair<double, KeyframeId>> ranked;
  for (const auto& [id, keyframe] : view.keyframes) {
    ranked.emplace_back(cv::norm(thumbnail, keyframe.features->thumbnail, cv::NORM_L2SQR), id);
  }
  std::sort(ranked.begin(), ranked.end());
  std::vector<KeyframeId> similar;
  if (view.keyframes.contains(last)) {
    similar.push_back(last);
  }
  for (const auto& [distance, id] : ranked) {
    if (static_cast<int>(similar.size()) < count && id != last) {
      similar.push_back(id);
    }
  }
  return similar;
}

}  // namespace

bool Tracker::Recover(TrackingReport& report) {
  constexpr int kTriedKeyframes = 4;
  constexpr double kWideSearch = 3.0;
  const KeyframeId last = last_ ? last_->anchor.reference : kNoKeyframe;
  for (const KeyframeId id : SimilarKeyframes(*view_, current_.features->thumbnail, last, kTriedKeyframes)) {
    report.visible.clear();
    report.found.clear();
    if (RecoverFrom(view_->keyframes.at(id)) && TrackLocalMap(kWideSearch, options_.min_inliers, report) &&
        TrackLocalMap(1.0, options_.min_recovery_inliers, report)) {
      return true;
    }
    current_.anchor = {};
  }
  return false;
}

bool Tracker::RecoverFrom(const ViewKeyframe& keyframe) {
  constexpr int kMinMatches = 15;
  constexpr int kMinInliers = 10;
  constexpr int kRansacIterations = 300;
  constexpr float kRansacError = 4.0F;  // px
  std::vector<bool> use(keyframe.points.size());
  std::transform(keyframe.points.begin(), keyframe.points.end(), use.begin(),
                 [](PointId p) { return p != kNoPoint; });
  const auto matches = MatchAll(*keyframe.features, *current_.features, use, {}, kStrictDistance, 0.75);
  if (static_cast<int>(matches.size()) < kMinMatches) {
    return false;
  }
  std::vector<cv::Point3d> points;
  std::vector<cv::Point2d> pixels;
  for (const auto& [i, j] : matches) {
    const Eigen::Vector3d& p = view_->Point(keyframe.points[static_cast<std::size_t>(i)]).p_map;
    const Eigen::Vector2d& pixel = current_.features->keypoints[static_cast<std::size_t>(j)].pixel;
    points.emplace_back(p.x(), p.y(), p.z());
    pixels.emplace_back(pixel.x(), pixel.y());
  }
  const cv::Matx33d K(camera_.fx, 0.0, camera_.cx, 0.0, camera_.fy, camera_.cy, 0.0, 0.0, 1.0);
  cv::Mat rotation_vector;
  cv::Mat translation;
  std::vector<int> inliers;
  if (!cv::solvePnPRansac(points, pixels, K, cv::noArray(), rotation_vector, translation, false,
                          kRansacIterations, kRansacError, 0.99, inliers, cv::SOLVEPNP_AP3P) ||
      static_cast<int>(inliers.size()) < kMinInliers) {
    return false;
  }
  cv::Mat rotation;
  cv::Rodrigues(rotation_vector, rotation);
  Eigen::Matrix3d R;
  Eigen::Vector3d t;
  cv::cv2eigen(rotation, R);
  cv::cv2eigen(translation, t);
  current_.T_camera_map = {Eigen::Quaterniond(R).normalized(), t};
  std::fill(current_.points.begin(), current_.points.end(), kNoPoint);
  for (const int inlier : inliers) {
    const auto& [i, j] = matches[static_cast<std::size_t>(inlier)];
    current_.points[static_cast<std::size_t>(j)] = keyframe.points[static_cast<std::size_t>(i)];
  }
  current_.anchor = {keyframe.id, {}};
  return OptimizeCurrentPose() >= kMinInliers;
}

}  // namespace sqslam
