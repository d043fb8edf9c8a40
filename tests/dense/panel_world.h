#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <opencv2/core.hpp>

#include "slam/dense/patch_scores.h"
#include "tests/support/textured_world.h"

namespace sqslam::testing {

constexpr std::size_t kPanels = 4;

// True depth of a pixel of the textured world, from the corners of its panels; 0 where it shows none.
inline double TrueDepth(const TexturedWorld& world, const Camera& camera, const Rigid3d& T_map_camera,
                        double u, double v) {
  const Eigen::Vector3d ray = T_map_camera.rotation * camera.Unproject({u, v});
  double nearest = 0.0;
  for (std::size_t panel = 0; panel < kPanels; ++panel) {
    const auto corners = world.PanelCorners(panel);
    const Eigen::Vector3d right = corners[1] - corners[0];
    const Eigen::Vector3d down = corners[3] - corners[0];
    Eigen::Matrix3d basis;
    basis << right, down, -ray;
    const Eigen::Vector3d place = basis.inverse() * (T_map_camera.translation - corners[0]);
    const bool on_it = place.x() >= 0.0 && place.x() <= 1.0 && place.y() >= 0.0 && place.y() <= 1.0;
    if (on_it && place.z() > 0.0 && (nearest == 0.0 || place.z() < nearest)) {
      nearest = place.z();
    }
  }
  return nearest;
}

inline cv::Mat TrueDepths(const TexturedWorld& world, const Camera& camera, const Rigid3d& T_map_camera) {
  cv::Mat depth(camera.height, camera.width, CV_32F);
  for (int y = 0; y < depth.rows; ++y) {
    for (int x = 0; x < depth.cols; ++x) {
      depth.at<float>(y, x) = static_cast<float>(TrueDepth(world, camera, T_map_camera, x, y));
    }
  }
  return depth;
}

// A slanted wall and before it the upright front of a box, both painted with waves: exact images of any view.
class PaintedScene {
 public:
  const Camera camera{320, 240, 260.0, 260.0, 160.0, 120.0, {}, 30.0};

  // Depth of what the pixel shows from a camera that looks ahead from `place`.
  double Depth(const Eigen::Vector3d& place, double u, double v) const {
    return Hit(place, u, v).z() - place.z();
  }

  StereoView View(const Eigen::Vector3d& place) const {
    StereoView view{cv::Mat(camera.height, camera.width, CV_8U), {Eigen::Quaterniond::Identity(), place}};
    for (int y = 0; y < camera.height; ++y) {
      PaintRow(place, y, view.gray);
    }
    return view;
  }

  // Paints row y of what is seen from `place`, for cameras that read their rows one after the other.
  void PaintRow(const Eigen::Vector3d& place, int y, cv::Mat& gray) const {
    for (int x = 0; x < camera.width; ++x) {
      gray.at<std::uint8_t>(y, x) = cv::saturate_cast<std::uint8_t>(Paint(Hit(place, x, y)));
    }
  }

 private:
  static Eigen::Vector3d Hit(const Eigen::Vector3d& place, double u, double v) {
    const Eigen::Vector3d ray((u - 160.0) / 260.0, (v - 120.0) / 260.0, 1.0);
    const Eigen::Vector3d on_box = place + (1.8 - place.z()) * ray;
    if (std::abs(on_box.x()) < 0.35 && on_box.y() > -0.1 && on_box.y() < 0.5) {
      return on_box;
    }
    const Eigen::Vector3d normal(-0.5, 0.2, 1.0);  // of the wall, z = 3 + 0.5 x - 0.2 y
    return place + (3.0 - normal.dot(place)) / normal.dot(ray) * ray;
  }
  double Paint(const Eigen::Vector3d& p) const {
    double gray = 128.0;
    for (const Wave& wave : waves_) {
      gray += 12.0 * std::sin(wave.direction.dot(p) + wave.phase + (p.z() == 1.8 ? 1.0 : 0.0));
    }
    return gray;
  }

  struct Wave {
    Eigen::Vector3d direction;
    double phase = 0.0;
  };
  static std::array<Wave, 12> Waves() {
    std::array<Wave, 12> waves;
    cv::RNG random(9);
    for (Wave& wave : waves) {
      wave.direction = Eigen::Vector3d(random.uniform(-60.0, 60.0), random.uniform(-60.0, 60.0), 0.0);
      wave.phase = random.uniform(0.0, 6.0);
    }
    return waves;
  }
  const std::array<Wave, 12> waves_ = Waves();
};

}  // namespace sqslam::testing
