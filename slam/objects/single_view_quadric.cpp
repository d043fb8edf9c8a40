#include "slam/objects/single_view_quadric.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "slam/objects/landmark_geometry.h"
#include "slam/objects/landmark_outliers.h"
#include "slam/objects/support_hypotheses.h"
#include "slam/objects/visibility.h"

namespace sqslam {
namespace {

// Returns an upright ellipsoid with the priors' proportions and about the height of the box, at the point
// where the lower edge of the box meets the support. Empty if the support is not below the camera there.
std::optional<PosedSuperquadric> StartOnSupport(const BoxView& view, const Camera& camera, double yaw,
                                                const QuadricPriors& priors) {
  const Box2d box = UndistortBox(view.box, camera);
  const Eigen::Vector3d ray =
      view.T_map_camera.rotation * camera.Unproject({box.Center().x(), box.y + box.height});
  const double depth = (priors.support - view.T_map_camera.translation.z()) / ray.z();
  if (!(depth > 0.0) || !std::isfinite(depth)) {
    return std::nullopt;
  }
  const double height = depth * box.height / camera.fy;
  const double across = height / std::exp(priors.known.log_height_ratio);
  const double ratio = std::exp(0.5 * priors.known.log_width_ratio);
  PosedSuperquadric start{{{0.5 * across * ratio, 0.5 * across / ratio, 0.5 * height}, 1.0, 1.0}, {}};
  start.T_map_object.rotation = Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ());
  start.T_map_object.translation = view.T_map_camera.translation + depth * ray;
  start.T_map_object.translation += 0.5 * across * Eigen::Vector3d(ray.x(), ray.y(), 0.0).normalized();
  start.T_map_object.translation.z() = priors.support + 0.5 * height;
  return start;
}

// Returns the grey level of a surface point in the image; empty if the camera does not see it.
std::optional<double> Seen(const Eigen::Vector3d& p_object, const Eigen::Vector3d& normal_object,
                           const PosedSuperquadric& ellipsoid, const Rigid3d& T_map_camera,
                           const Camera& camera, const cv::Mat& gray) {
  const Eigen::Vector3d p_map = ellipsoid.T_map_object * p_object;
  const Eigen::Vector3d to_camera = T_map_camera.translation - p_map;
  const Eigen::Vector3d p_camera = T_map_camera.Inverse() * p_map;
  if (to_camera.dot(ellipsoid.T_map_object.rotation * normal_object) <= 0.0 || p_camera.z() <= 0.0) {
    return std::nullopt;
  }
  const Eigen::Vector2d pixel = camera.ProjectDistorted(p_camera);
  const auto x = static_cast<int>(std::lround(pixel.x()));
  const auto y = static_cast<int>(std::lround(pixel.y()));
  return x >= 0 && y >= 0 && x < gray.cols && y < gray.rows
             ? std::optional<double>(gray.at<unsigned char>(y, x))
             : std::nullopt;
}

}  // namespace

std::optional<double> TextureAsymmetry(const PosedSuperquadric& ellipsoid, const Rigid3d& T_map_camera,
                                       const Camera& camera, const cv::Mat& gray) {
  constexpr int kRings = 16;
  constexpr int kSpokes = 48;
  constexpr double kLeastShare = 0.25;  // of the half of the surface that faces the camera
  std::array<double, 2> sums{};
  std::array<int, 2> counts{};
  int visible = 0;
  for (int i = 0; i < kRings; ++i) {
    for (int j = 0; j < kSpokes; ++j) {
      const double eta = std::asin((2.0 * i + 1.0) / kRings - 1.0);
      const Eigen::Vector3d p = ellipsoid.shape.PointAt(eta, 2.0 * std::numbers::pi * (j + 0.5) / kSpokes);
      const Eigen::Vector3d normal = p.cwiseQuotient(ellipsoid.shape.half_size.cwiseAbs2());
      const std::optional<double> level = Seen(p, normal, ellipsoid, T_map_camera, camera, gray);
      visible += level ? 1 : 0;
      for (std::size_t plane = 0; level && plane < 2; ++plane) {
        Eigen::Vector3d mirror = Eigen::Vector3d::Ones();
        mirror[plane == 0 ? 1 : 0] = -1.0;
        if (const auto other = Seen(mirror.cwiseProduct(p), mirror.cwiseProduct(normal), ellipsoid,
                                    T_map_camera, camera, gray)) {
          sums[plane] += std::abs(*level - *other);
          ++counts[plane];
        }
      }
    }
  }
  std::optional<double> least;
  for (std::size_t plane = 0; plane < 2; ++plane) {
    if (counts[plane] > 0 && counts[plane] >= kLeastShare * visible) {
      const double mean = sums[plane] / counts[plane];
      least = std::min(mean, least.value_or(mean));
    }
  }
  return least;
}

std::optional<PosedSuperquadric> QuadricFromOneView(const BoxView& view, const cv::Mat& gray,
                                                    const Camera& camera, const ObjectOptions& options,
                                                    const QuadricPriors& priors) {
  constexpr int kAngles = 36;
  constexpr double kDisagreement = 255.0;  // grey levels; cost of a box without overlap
  if (!IsWhole(view.edge_free)) {
    return std::nullopt;
  }
  std::optional<PosedSuperquadric> best;
  double least = 0.0;
  for (int i = 0; i < kAngles; ++i) {
    const auto start = StartOnSupport(view, camera, std::numbers::pi * i / kAngles, priors);
    const auto fit = start ? RefineDualQuadric(*start, {&view, 1}, camera, options, priors) : start;
    if (!fit) {
      continue;
    }
    const double asymmetry =
        TextureAsymmetry(*fit, view.T_map_camera, camera, gray).value_or(0.5 * kDisagreement);
    const double cost = asymmetry + kDisagreement * (1.0 - BoxAgreement(*fit, {view}, camera));
    if (!best || cost < least) {
      best = fit;
      least = cost;
    }
  }
  return best;
}

std::optional<PosedSuperquadric> EstimateQuadricOnSupport(const Landmark& landmark,
                                                          const std::vector<BoxView>& views,
                                                          const EstimationContext& context) {
  std::optional<double> support = landmark.support;
  if (!support) {
    const std::vector<double> near = PossibleSupports(landmark.points, context).near;
    support = near.empty() ? std::nullopt : std::optional(near.front());
  }
  if (!landmark.clearest || !support || !context.upright) {
    return std::nullopt;
  }
  const QuadricPriors priors{context.classes->Of(landmark.labels.Best()), *support};
  const auto start = QuadricFromOneView(landmark.clearest->view, landmark.clearest->gray, context.camera,
                                        *context.options, priors);
  if (!start) {
    return std::nullopt;
  }
  const auto refined = RefineDualQuadric(*start, views, context.camera, *context.options, priors);
  return EllipsoidOf(DualQuadricOf(refined.value_or(*start)));
}

}  // namespace sqslam
