#include "render/solids/ground_shadow.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <vector>

namespace sqslam {
namespace {

constexpr int kOutlinePoints = 48;
constexpr double kGoldenAngle = 2.399963229728653;

struct PlaneAxes {
  Eigen::Vector3d x, y, up;
};

PlaneAxes AxesOf(const Eigen::Vector3d& up) {
  const Eigen::Vector3d x = up.unitOrthogonal();
  return {x, up.cross(x), up};
}

// Directions to the light with their weights, which sum to 1.
struct LightSample {
  Eigen::Vector3d towards;
  double weight;
};

std::vector<LightSample> SampleLight(const ShadowLight& light, const Eigen::Vector3d& up) {
  std::vector<LightSample> samples;
  const PlaneAxes lamp = AxesOf(light.towards.normalized());
  for (int i = 0; i < light.lamp_samples; ++i) {
    const double radius = std::tan(light.size) * std::sqrt((i + 0.5) / light.lamp_samples);
    const double angle = kGoldenAngle * i;
    samples.push_back(
        {(lamp.up + radius * (std::cos(angle) * lamp.x + std::sin(angle) * lamp.y)).normalized(),
         light.lamp / light.lamp_samples});
  }
  const PlaneAxes sky = AxesOf(up);
  for (int i = 0; i < light.sky_samples; ++i) {  // as many as the cosine law sends
    const double sine = std::sqrt((i + 0.5) / light.sky_samples);
    const double angle = kGoldenAngle * i;
    samples.push_back(
        {std::sqrt(1.0 - sine * sine) * sky.up + sine * (std::cos(angle) * sky.x + std::sin(angle) * sky.y),
         (1.0 - light.lamp) / light.sky_samples});
  }
  return samples;
}

// Outline of the shadow of one solid by one direction of light, in the plane's x and y.
std::vector<Eigen::Vector2d> Outline(const PosedSuperquadric& solid, const Eigen::Vector3d& towards,
                                     const PlaneAxes& plane, double height) {
  const PlaneAxes across = AxesOf(towards);
  std::vector<Eigen::Vector2d> outline;
  for (int i = 0; i < kOutlinePoints; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / kOutlinePoints;
    const Eigen::Vector3d p = SupportPoint(solid, std::cos(angle) * across.x + std::sin(angle) * across.y);
    const double above = std::max(0.0, p.dot(plane.up) - height);
    const Eigen::Vector3d on_plane = p - above / towards.dot(plane.up) * towards;
    outline.emplace_back(on_plane.dot(plane.x), on_plane.dot(plane.y));
  }
  return outline;
}

}  // namespace

GroundShadow CastGroundShadow(std::span<const PosedSuperquadric> solids, const Eigen::Vector3d& up,
                              double height, const ShadowLight& light, int resolution) {
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
  // Always a square of the same size: a software renderer compiles its programs anew for other shapes.
  const cv::Size size(resolution, resolution);
  const double pixel = bounds.sizes().maxCoeff() / resolution;
  cv::Mat sum = cv::Mat::zeros(size, CV_32F);
  cv::Mat dark(size, CV_8U);
  constexpr int kShift = 4;  // polygons are placed to a sixteenth of a pixel
  for (const LightSample& sample : SampleLight(light, up)) {
    dark.setTo(0);
    for (const PosedSuperquadric& solid : casting) {
      std::vector<cv::Point> polygon;
      for (const Eigen::Vector2d& p : Outline(solid, sample.towards, plane, height)) {
        const Eigen::Vector2d at = (p - bounds.min()) / pixel * (1 << kShift);
        polygon.emplace_back(static_cast<int>(std::lround(std::clamp(at.x(), -1e6, 1e6))),
                             static_cast<int>(std::lround(std::clamp(at.y(), -1e6, 1e6))));
      }
      std::vector<cv::Point> hull;
      cv::convexHull(polygon, hull);
      cv::fillConvexPoly(dark, hull, 255, cv::LINE_AA, kShift);
    }
    cv::scaleAdd(cv::Mat_<float>(dark), sample.weight, sum, sum);
  }
  // The faintest part, which reaches far, would only make the paper look grey.
  constexpr double kUnseen = 16.0;
  sum.convertTo(shadow.darkness, CV_8U, 255.0 / (255.0 - kUnseen), -255.0 * kUnseen / (255.0 - kUnseen));
  const Eigen::Vector2d low = bounds.min();
  shadow.corner = low.x() * plane.x + low.y() * plane.y + height * up;
  shadow.across = size.width * pixel * plane.x;
  shadow.down = size.height * pixel * plane.y;
  return shadow;
}

}  // namespace sqslam
