#include "slam/estimation/absolute_pose.h"

#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>

namespace sqslam {
namespace {

cv::Mat CameraMatrix(const Camera& camera) {
  cv::Mat K;
  cv::eigen2cv(camera.K(), K);
  return K;
}

// Returns the vectors, one at least, as a column of OpenCV points, without a copy.
cv::Mat PointsOf(const auto& vectors) {
  return {static_cast<int>(vectors.size()), 1, CV_64FC(static_cast<int>(vectors[0].size())),
          const_cast<double*>(vectors[0].data())};
}

Rigid3d PoseOf(const cv::Mat& rotation_vector, const cv::Mat& translation) {
  cv::Mat rotation;
  cv::Rodrigues(rotation_vector, rotation);
  Eigen::Matrix3d R;
  Eigen::Vector3d t;
  cv::cv2eigen(rotation, R);
  cv::cv2eigen(translation, t);
  return {Eigen::Quaterniond(R).normalized(), t};
}

}  // namespace

std::optional<Rigid3d> LocateByP3P(const Camera& camera, const std::vector<Eigen::Vector3d>& points,
                                   const std::vector<Eigen::Vector2d>& pixels, int iterations,
                                   std::vector<int>& inliers) {
  constexpr float kMaxError = 4.0F;  // px
  constexpr double kConfidence = 0.99;
  cv::Mat rotation_vector;
  cv::Mat translation;
  if (!cv::solvePnPRansac(PointsOf(points), PointsOf(pixels), CameraMatrix(camera), cv::noArray(),
                          rotation_vector, translation, false, iterations, kMaxError, kConfidence, inliers,
                          cv::SOLVEPNP_AP3P)) {
    return std::nullopt;
  }
  return PoseOf(rotation_vector, translation);
}

std::vector<Rigid3d> SolveP3P(const Camera& camera, const std::array<Eigen::Vector3d, 3>& points,
                              const std::array<Eigen::Vector2d, 3>& pixels) {
  std::vector<cv::Mat> rotation_vectors;
  std::vector<cv::Mat> translations;
  cv::solveP3P(PointsOf(points), PointsOf(pixels), CameraMatrix(camera), cv::noArray(), rotation_vectors,
               translations, cv::SOLVEPNP_AP3P);
  std::vector<Rigid3d> poses;
  for (std::size_t i = 0; i < rotation_vectors.size(); ++i) {
    poses.push_back(PoseOf(rotation_vectors[i], translations[i]));
  }
  return poses;
}

}  // namespace sqslam
