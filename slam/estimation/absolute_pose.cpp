#include "slam/estimation/absolute_pose.h"

#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>

namespace sqslam {

std::optional<Rigid3d> LocateByP3P(const Camera& camera, const std::vector<Eigen::Vector3d>& points,
                                   const std::vector<Eigen::Vector2d>& pixels, int iterations,
                                   std::vector<int>& inliers) {
  constexpr float kMaxError = 4.0F;  // px
  constexpr double kConfidence = 0.99;
  std::vector<cv::Point3d> points_cv;
  std::vector<cv::Point2d> pixels_cv;
  for (const Eigen::Vector3d& p : points) {
    points_cv.emplace_back(p.x(), p.y(), p.z());
  }
  for (const Eigen::Vector2d& pixel : pixels) {
    pixels_cv.emplace_back(pixel.x(), pixel.y());
  }
  cv::Mat K;
  cv::eigen2cv(camera.K(), K);
  cv::Mat rotation_vector;
  cv::Mat translation;
  if (!cv::solvePnPRansac(points_cv, pixels_cv, K, cv::noArray(), rotation_vector, translation, false,
                          iterations, kMaxError, kConfidence, inliers, cv::SOLVEPNP_AP3P)) {
    return std::nullopt;
  }
  cv::Mat rotation;
  cv::Rodrigues(rotation_vector, rotation);
  Eigen::Matrix3d R;
  Eigen::Vector3d t;
  cv::cv2eigen(rotation, R);
  cv::cv2eigen(translation, t);
  return Rigid3d{Eigen::Quaterniond(R).normalized(), t};
}

}  // namespace sqslam
