#include "render/solids/ground_shadow.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <mutex>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "slam/geometry/angles.h"

namespace sqslam {
namespace {

constexpr int kOutlinePoints = 48;

struct PlaneAxes {
  Eigen::Vector3d x, y, up;
};

PlaneAxes AxesOf(const Eigen::Vector3d& up) {
  const Eigen::Vector3d x = up.unitOrthogonal();
  return {x, up.cross(x), up};
}

// Directions to the lamp; SkyDirections samples the sky with cosine weighting.
std::vector<Eigen::Vector3d> LampDirections(const ShadowLight& light) {
  const PlaneAxes lamp = AxesOf(light.towards.normalized());
  std::vector<Eigen::Vector3d> directions;
  for (int i = 0; i < light.lamp_samples; ++i) {
    const double radius = std::tan(light.size) * std::sqrt((i + 0.5) / light.lamp_samples);
    const double angle = kGoldenAngle * i;
    directions.push_back(
        (lamp.up + radius * (std::cos(angle) * lamp.x + std::sin(angle) * lamp.y)).normalized());
  }
  return directions;
}

std::vector<Eigen::Vector3d> SkyDirections(const ShadowLight& light, const Eigen::Vector3d& up) {
  const PlaneAxes sky = AxesOf(up);
  std::vector<Eigen::Vector3d> directions;
  for (int i = 0; i < light.sky_samples; ++i) {
    const double sine = std::sqrt((i + 0.5) / light.sky_samples);
    const double angle = kGoldenAngle * i;
    directions.push_back(std::sqrt(1.0 - sine * sine) * sky.up +
                         sine * (std::cos(angle) * sky.x + std::sin(angle) * sky.y));
  }
  return directions;
}

// Maps the shadow's pixels to the plane.
struct ShadowPlane {
  PlaneAxes axes;
  double height = 0.0;
  Eigen::Vector2d corner = Eigen::Vector2d::Zero();  // in the plane's x and y
  double pixel = 0.0;                                // map units
  cv::Size size;
};

constexpr int kShift = 4;  // fractional bits of polygon coordinates

// Returns the outline of one solid's shadow from one light direction, pixels.
std::vector<cv::Point> Outline(const PosedSuperquadric& solid, const Eigen::Vector3d& towards,
                               const ShadowPlane& plane) {
  const PlaneAxes across = AxesOf(towards);
  const Eigen::Vector3d& center = solid.T_map_object.translation;
  std::vector<cv::Point> outline;
  const auto add = [&](const Eigen::Vector3d& p) {
    const double above = std::max(0.0, p.dot(plane.axes.up) - plane.height);
    const Eigen::Vector3d on_plane = p - above / towards.dot(plane.axes.up) * towards;
    const Eigen::Vector2d in_plane(on_plane.dot(plane.axes.x), on_plane.dot(plane.axes.y));
    const Eigen::Vector2d at = (in_plane - plane.corner) / plane.pixel * (1 << kShift);
    outline.emplace_back(static_cast<int>(std::lround(std::clamp(at.x(), -1e6, 1e6))),
                         static_cast<int>(std::lround(std::clamp(at.y(), -1e6, 1e6))));
  };
  for (int i = 0; i < kOutlinePoints / 2; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / kOutlinePoints;
    const Eigen::Vector3d p = SupportPoint(solid, std::cos(angle) * across.x + std::sin(angle) * across.y);
    add(p);
    add(2.0 * center - p);  // by symmetry, the support point in the opposite direction
  }
  std::vector<cv::Point> hull;
  cv::convexHull(outline, hull);
  return hull;
}

// Sums the solids' shadows over the directions (32FC1, 255 each). The threads' sums are whole numbers, so
// their order does not matter.
cv::Mat SumOfShadows(const std::vector<PosedSuperquadric>& solids,
                     const std::vector<Eigen::Vector3d>& directions, const ShadowPlane& plane) {
  cv::Mat sum = cv::Mat::zeros(plane.size, CV_32F);
  std::mutex mutex;
  cv::parallel_for_(
      {0, static_cast<int>(directions.size())},
      [&](const cv::Range& range) {
        cv::Mat own = cv::Mat::zeros(plane.size, CV_32F);
        cv::Mat dark(plane.size, CV_8U);
        for (int i = range.start; i < range.end; ++i) {
          dark.setTo(0);
          for (const PosedSuperquadric& solid : solids) {
            cv::fillConvexPoly(dark, Outline(solid, directions[static_cast<std::size_t>(i)], plane), 255,
                               cv::LINE_AA, kShift);
          }
          cv::accumulate(dark, own);
        }
        const std::lock_guard lock(mutex);
        sum += own;
      },
      cv::getNumThreads());
  return sum;
}

}  // namespace

GroundShadow CastGroundShadow(std::span<const PosedSuperquadric> solids, const Eigen::Vector3d& up,
                              double height, const ShadowLight& light) {
  const PlaneAxes plane = AxesOf(up);
  std::vector<PosedSuperquadric> casting;
  Eigen::AlignedBox2d bounds;
  for (const PosedSuperquadric& solid : solids) {
    const double top = solid.T_map_object.translation.dot(up) + SupportExtent(solid, up) - height;
    if (top > 0.0) {
      casting.push_back(solid);
      const Eigen::Vector3d& c = solid.T_map_object.translation;
      const double reach = solid.shape.half_size.norm() + 1.2 * top;
      bounds.extend(Eigen::Vector2d(c.dot(plane.x) - reach, c.dot(plane.y) - reach));
      bounds.extend(Eigen::Vector2d(c.dot(plane.x) + reach, c.dot(plane.y) + reach));
    }
  }
  GroundShadow shadow;
  if (casting.empty()) {
    return shadow;
  }
  // Always a square of the same size: a software renderer recompiles its programs for other shapes.
  constexpr int kSide = 512;
  const ShadowPlane picture{plane, height, bounds.min(), bounds.sizes().maxCoeff() / kSide, {kSide, kSide}};
  cv::Mat sum;
  cv::addWeighted(SumOfShadows(casting, LampDirections(light), picture),
                  light.lamp / std::max(1, light.lamp_samples),
                  SumOfShadows(casting, SkyDirections(light, up), picture),
                  (1.0 - light.lamp) / std::max(1, light.sky_samples), 0.0, sum);
  // Cuts off the faintest part, which reaches far and would only make the background look grey.
  constexpr double kMinDarkness = 16.0;
  sum.convertTo(shadow.darkness, CV_8U, 255.0 / (255.0 - kMinDarkness),
                -255.0 * kMinDarkness / (255.0 - kMinDarkness));
  shadow.corner = picture.corner.x() * plane.x + picture.corner.y() * plane.y + height * up;
  shadow.across = kSide * picture.pixel * plane.x;
  shadow.down = kSide * picture.pixel * plane.y;
  return shadow;
}

}  // namespace sqslam
