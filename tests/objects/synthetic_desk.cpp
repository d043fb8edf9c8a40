#include "synthetic_desk.h"

#include <cmath>
#include <numbers>
#include <random>

#include "slam/objects/landmark_geometry.h"

namespace sqslam::testing {
namespace {

constexpr double kPi = std::numbers::pi;

SyntheticDesk::Object Place(const std::string& label, double x, double y, double yaw_deg,
                            const Eigen::Vector3d& half, double e1, double e2) {
  SyntheticDesk::Object object;
  object.label = label;
  object.superquadric.shape = {half, e1, e2};
  object.superquadric.T_map_object = {
      Eigen::Quaterniond(Eigen::AngleAxisd(yaw_deg * kPi / 180.0, Eigen::Vector3d::UnitZ())),
      {x, y, half.z()}};
  return object;
}

}  // namespace

SyntheticDesk::SyntheticDesk(std::uint64_t seed, double box_noise) : seed_(seed), box_noise_(box_noise) {
  camera_ = {640, 480, 525.0, 525.0, 320.0, 240.0, {}, 30.0};
  objects_ = {Place("cereal_box", -0.45, 0.25, 20, {0.09, 0.035, 0.14}, 0.1, 0.1),
              Place("book", -0.4, -0.1, -15, {0.11, 0.08, 0.02}, 0.1, 0.1),
              Place("cup", -0.15, 0.1, 0, {0.04, 0.04, 0.05}, 0.1, 1.0),
              Place("sports_ball", 0.05, -0.15, 0, {0.07, 0.07, 0.07}, 1.0, 1.0),
              Place("bottle", 0.1, 0.25, 0, {0.035, 0.035, 0.12}, 0.4, 1.0),
              Place("box", 0.35, 0.2, 35, {0.1, 0.06, 0.07}, 0.1, 0.2),
              Place("bowl", 0.3, -0.15, 0, {0.08, 0.08, 0.035}, 0.6, 1.0),
              Place("cup", 0.55, -0.05, 0, {0.04, 0.04, 0.05}, 0.1, 1.0),
              Place("vase", 0.6, 0.25, 0, {0.05, 0.05, 0.11}, 0.7, 1.0),
              Place("book", -0.15, -0.3, 10, {0.09, 0.12, 0.025}, 0.1, 0.1)};
  std::mt19937_64 generator(seed);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  std::normal_distribution<double> noise(0.0, 0.002);
  const auto noisy = [&](const Eigen::Vector3d& p) {
    const double dx = noise(generator);
    const double dy = noise(generator);
    const double dz = noise(generator);
    return Eigen::Vector3d(p + Eigen::Vector3d(dx, dy, dz));
  };
  for (std::size_t k = 0; k < objects_.size(); ++k) {
    const PosedSuperquadric& s = objects_[k].superquadric;
    for (int i = 0; i < 160; ++i) {
      // Directions to the faces of a cube, so that flat sides get their share.
      Eigen::Vector3d d(uniform(generator), uniform(generator), uniform(generator));
      d[i % 3] = i % 2 == 0 ? 1.0 : -1.0;
      d = d.cwiseProduct(s.shape.half_size);
      const Eigen::Vector3d p = d / s.shape.RadialScale(d);
      const double step = 1e-6;
      Eigen::Vector3d gradient;
      for (int axis = 0; axis < 3; ++axis) {
        const Eigen::Vector3d h = step * Eigen::Vector3d::Unit(axis);
        gradient[axis] = s.shape.RadialScale(p + h) - s.shape.RadialScale(p - h);
      }
      const Eigen::Vector3d world = s.T_map_object * p;
      points_.push_back(
          {world, noisy(world), s.T_map_object.rotation * gradient.normalized(), static_cast<int>(k)});
    }
  }
  for (int i = 0; i < 500; ++i) {
    const Eigen::Vector3d world(0.9 * uniform(generator), 0.6 * uniform(generator), 0.0);
    points_.push_back({world, noisy(world), Eigen::Vector3d::UnitZ(), -1});
  }
}

Rigid3d SyntheticDesk::Pose(int frame) const {
  const double azimuth = (-90.0 + 50.0 * std::sin(2.0 * kPi * frame / kFrames)) * kPi / 180.0;
  const double elevation = (35.0 + 8.0 * std::cos(4.0 * kPi * frame / kFrames)) * kPi / 180.0;
  const Eigen::Vector3d target(0.05, 0.0, 0.05);
  const Eigen::Vector3d centre =
      target + 1.35 * Eigen::Vector3d(std::cos(azimuth) * std::cos(elevation),
                                      std::sin(azimuth) * std::cos(elevation), std::sin(elevation));
  Eigen::Matrix3d R;
  R.col(2) = (target - centre).normalized();
  R.col(0) = R.col(2).cross(Eigen::Vector3d::UnitZ()).normalized();
  R.col(1) = R.col(2).cross(R.col(0));
  return {Eigen::Quaterniond(R), centre};
}

bool SyntheticDesk::IsVisible(const Point& point, const Eigen::Vector3d& camera_centre) const {
  const Eigen::Vector3d to_camera = (camera_centre - point.truth).normalized();
  if (point.normal.dot(to_camera) < 0.2) {
    return false;
  }
  for (int k = 0; k < static_cast<int>(objects_.size()); ++k) {
    const PosedSuperquadric& s = objects_[k].superquadric;
    const Eigen::Vector3d to_object = s.T_map_object.translation - point.truth;
    if (to_object.cross(to_camera).norm() > s.shape.half_size.norm()) {
      continue;
    }
    const Rigid3d T_object_map = s.T_map_object.Inverse();
    for (double t = 0.02; k != point.object && t < 0.6; t += 0.02) {
      if (s.shape.RadialScale(T_object_map * (point.truth + t * to_camera)) < 1.0) {
        return false;
      }
    }
  }
  return true;
}

ObjectFrame SyntheticDesk::Frame(int index) const {
  std::mt19937_64 generator(seed_ * 1000003u + static_cast<std::uint64_t>(index));
  std::normal_distribution<double> gaussian;
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  ObjectFrame frame;
  frame.frame_index = index;
  frame.T_map_camera = Pose(index);
  frame.camera = camera_;
  const Rigid3d T_camera_map = frame.T_map_camera.Inverse();
  for (std::size_t i = 0; i < points_.size(); ++i) {
    const Eigen::Vector3d p = T_camera_map * points_[i].truth;
    const Eigen::Vector2d pixel = camera_.Project(p);
    const bool tracked = uniform(generator) < 0.4;
    if (tracked && p.z() > 0.1 && Box2d{0, 0, 639, 479}.Contains(pixel) &&
        IsVisible(points_[i], frame.T_map_camera.translation)) {
      frame.points.push_back({static_cast<std::int64_t>(i), pixel, points_[i].mapped});
    }
  }
  for (const Object& object : objects_) {
    const auto exact = ProjectToBox(object.superquadric, frame.T_map_camera, camera_);
    const bool missed = uniform(generator) < 0.1;
    const bool mistaken = uniform(generator) < 0.03;
    const double score = 0.5 + 0.4 * uniform(generator);
    std::array<double, 4> d{};
    for (double& value : d) {
      value = box_noise_ * gaussian(generator);
    }
    if (missed || !exact) {
      continue;
    }
    const Box2d box = ClipToImage({exact->x + d[0] * exact->width, exact->y + d[1] * exact->height,
                                   exact->width * (1.0 - d[0] + d[2]), exact->height * (1.0 - d[1] + d[3])},
                                  camera_);
    if (box.Area() > 400.0) {
      frame.detections.push_back({mistaken ? "toaster" : object.label, score, box});
    }
  }
  return frame;
}

std::optional<Eigen::Vector3d> SyntheticDesk::Position(std::int64_t id) const {
  const auto index = static_cast<std::size_t>(id);
  return index < points_.size() ? std::optional<Eigen::Vector3d>(points_[index].mapped) : std::nullopt;
}

}  // namespace sqslam::testing
