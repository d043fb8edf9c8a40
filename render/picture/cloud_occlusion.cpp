#include "render/picture/cloud_occlusion.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <vector>

namespace sqslam {

cv::Mat1f CloudDepth(const CloudLayer& cloud, const Camera& camera, const Rigid3d& T_map_camera,
                     std::int64_t newest) {
  constexpr double kMinDepth = 1e-6;  // map units
  constexpr double kMaxSide = 40.0;   // pixels, of points close to the camera
  constexpr double kOverlap = 1.5;    // of neighbours: their distances vary
  cv::Mat1f depth(camera.height, camera.width, std::numeric_limits<float>::infinity());
  const Rigid3d T_camera_map = T_map_camera.Inverse();
  for (const CloudPoint& point : cloud.points) {
    const Eigen::Vector3d p = T_camera_map * point.p_map.cast<double>();
    if (p.z() <= kMinDepth || point.frame > newest) {
      continue;
    }
    const Eigen::Vector2d pixel = camera.Project(p);
    const double half = 0.5 * std::clamp(kOverlap * point.spacing * camera.fx / p.z(), 1.0, kMaxSide);
    const int left = std::max(0, static_cast<int>(std::ceil(pixel.x() - half)));
    const int right = std::min(camera.width - 1, static_cast<int>(std::floor(pixel.x() + half)));
    const int top = std::max(0, static_cast<int>(std::ceil(pixel.y() - half)));
    const int bottom = std::min(camera.height - 1, static_cast<int>(std::floor(pixel.y() + half)));
    for (int y = top; y <= bottom; ++y) {
      for (int x = left; x <= right; ++x) {
        depth(y, x) = std::min(depth(y, x), static_cast<float>(p.z()));
      }
    }
  }
  return depth;
}

cv::Mat1b HiddenBehind(const cv::Mat1f& cloud_depth, const SolidImage& image,
                       std::span<const PosedSuperquadric> solids) {
  std::vector<float> margins;
  for (const PosedSuperquadric& solid : solids) {
    margins.push_back(static_cast<float>(0.25 * std::cbrt(solid.shape.half_size.prod())));
  }
  cv::Mat1b hidden(image.number.size(), std::uint8_t{0});
  hidden.forEach([&](std::uint8_t& pixel, const int* at) {
    const int number = image.number(at[0], at[1]);
    const float depth = image.depth(at[0], at[1]);
    if (number >= 0 &&
        cloud_depth(at[0], at[1]) < 0.98F * depth - margins[static_cast<std::size_t>(number)]) {
      pixel = 255;
    }
  });
  cv::morphologyEx(hidden, hidden, cv::MORPH_CLOSE, cv::Mat(5, 5, CV_8UC1, cv::Scalar(1)));
  cv::medianBlur(hidden, hidden, 5);
  return hidden;
}

}  // namespace sqslam
