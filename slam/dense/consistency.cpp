#include "slam/dense/consistency.h"

#include <algorithm>
#include <cmath>

#include "slam/util/to_vector.h"

namespace sqslam {
namespace {

// Interpolates the depth between pixels, from those of the four neighbours that are near `expected`; 0 if
// there is none.
double DepthNear(const cv::Mat& depth, double u, double v, double expected, double tolerance) {
  const int x = static_cast<int>(u);
  const int y = static_cast<int>(v);
  double sum = 0.0, weights = 0.0;
  for (int dy = 0; dy < 2; ++dy) {
    for (int dx = 0; dx < 2; ++dx) {
      const double z = depth.at<float>(y + dy, x + dx);
      if (std::abs(z - expected) <= tolerance) {
        const double weight = (1.0 - std::abs(u - x - dx)) * (1.0 - std::abs(v - y - dy)) + 1e-6;
        sum += weight * z;
        weights += weight;
      }
    }
  }
  return weights > 0.0 ? sum / weights : 0.0;
}

// Returns true if the map's surface at the pixel lies clearly behind `expected`.
bool SeesThrough(const cv::Mat& depth, const Eigen::Vector2d& pixel, double expected, double max_difference) {
  constexpr double kClearly = 3.0;  // times max_difference
  return depth.at<float>(static_cast<int>(pixel.y() + 0.5), static_cast<int>(pixel.x() + 0.5)) >
         (1.0 + kClearly * max_difference) * expected;
}

}  // namespace

DepthMap KeepConsistent(const DepthMap& map, const std::vector<DepthMap>& neighbours,
                        const DepthFusionOptions& options) {
  DepthMap kept = map;
  kept.depth = cv::Mat(map.depth.size(), CV_32F, cv::Scalar(0));
  kept.views = cv::Mat(map.depth.size(), CV_8U, cv::Scalar(0));
  const std::vector<Rigid3d> T_neighbour_map =
      ToVector(neighbours, [](const DepthMap& neighbour) { return neighbour.T_map_camera.Inverse(); });
  for (int y = 0; y < map.depth.rows; ++y) {
    for (int x = 0; x < map.depth.cols; ++x) {
      const double z = map.depth.at<float>(y, x);
      if (!(z > 0.0)) {
        continue;
      }
      const Eigen::Vector3d p_map = map.PointAt(x, y);
      double ratios = 1.0;
      int views = 0, against = 0;
      for (std::size_t i = 0; i < neighbours.size(); ++i) {
        const DepthMap& other = neighbours[i];
        const Eigen::Vector3d p = T_neighbour_map[i] * p_map;
        if (!(p.z() > 0.0)) {
          continue;
        }
        const Eigen::Vector2d pixel = other.camera.Project(p);
        if (!(pixel.x() >= 0.0 && pixel.y() >= 0.0 && pixel.x() < other.depth.cols - 1 &&
              pixel.y() < other.depth.rows - 1)) {
          continue;
        }
        const double seen =
            DepthNear(other.depth, pixel.x(), pixel.y(), p.z(), options.max_difference * p.z());
        if (seen > 0.0) {
          ratios += seen / p.z();
          ++views;
        } else if (SeesThrough(other.depth, pixel, p.z(), options.max_difference)) {
          ++against;
        }
      }
      if (views >= std::max(options.min_views, against)) {
        kept.depth.at<float>(y, x) = static_cast<float>(z * ratios / (1 + views));
        kept.views.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(views);
      }
    }
  }
  return kept;
}

}  // namespace sqslam
