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
  std::vector<cv::Point3d> points_cv;
  std::vector<cv::Point2d> pixels_cv;
  for (const Eigen::Vector3d& p : points) {
    points_cv.emplace_back(p.x(), p.y(), p.z());
  }
  for (const Eigen::Vector2d& pixel : pixels) {
    pixels_cv.emplace_back(pixel.x(), pixel.y());
  }
  cv::Mat rotation_vector;
  cv::Mat translation;
  if (!cv::solvePnPRansac(points_cv, pixels_cv, CameraMatrix(camera), cv::noArray(), rotation_vector,
                          translation, false, iterations, kMaxError, kConfidence, inliers,
                          cv::SOLVEPNP_AP3P)) {
    return std::nullopt;
  }
  return PoseOf(rotation_vector, translation);
}

std::vector<Rigid3d> SolveP3P(const Camera& camera, const std::array<Eigen::Vector3d, 3>& points,
                              const std::array<Eigen::Vector2d, 3>& pixels) {
  std::vector<cv::Point3d> points_cv;
  std::vector<cv::Point2d> pixels_cv;
  for (std::size_t i = 0; i < points.size(); ++i) {
    points_cv.emplace_back(points[i].x(), points[i].y(), points[i].z());
    pixels_cv.emplace_back(pixels[i].x(), pixels[i].y());
  }
  std::vector<cv::Mat> rotation_vectors;
  std::vector<cv::Mat> translations;
  cv::solveP3P(points_cv, pixels_cv, CameraMatrix(camera), cv::noArray(), rotation_vectors, translations,
               cv::SOLVEPNP_AP3P);
  std::vector<Rigid3d> poses;
  for (std::size_t i = 0; i < rotation_vectors.size(); ++i) {
    poses.push_back(PoseOf(rotation_vectors[i], translations[i]));
  }
  return poses;
}

}  // namespace sqslam
