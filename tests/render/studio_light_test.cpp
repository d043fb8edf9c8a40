#include "render/scene/studio_light.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

namespace sqslam {
namespace {

// Light on a surface by adding up the radiance over its hemisphere.
Eigen::Vector3d IrradianceBySum(const Studio& studio, const Eigen::Vector3d& n) {
  const Eigen::Vector3d x = n.unitOrthogonal();
  const Eigen::Vector3d y = n.cross(x);
  constexpr int kRings = 200;
  constexpr int kSpokes = 400;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (int i = 0; i < kRings; ++i) {
    const double sine = std::sqrt((i + 0.5) / kRings);  // the cosine law is in the spacing
    for (int k = 0; k < kSpokes; ++k) {
      const double angle = 2.0 * std::numbers::pi * k / kSpokes;
      const Eigen::Vector3d d =
          std::sqrt(1.0 - sine * sine) * n + sine * (std::cos(angle) * x + std::sin(angle) * y);
      sum += StudioRadiance(d.dot(studio.up), d.dot(studio.Lamp()), d.dot(studio.Window()));
    }
  }
  return sum / (kRings * kSpokes);
}

TEST(StudioLightTest, IntegratesRadianceOverHemisphere) {
  Studio studio;
  studio.front = Eigen::Vector3d(0.6, -0.8, 0.0);
  for (const Eigen::Vector3d& direction :
       {Eigen::Vector3d(0, 0, 1), Eigen::Vector3d(0, 0, -1), Eigen::Vector3d(1, 0, 0.2),
        Eigen::Vector3d(-1, 1, 0), Eigen::Vector3d(0.3, -0.5, 0.6), studio.Lamp(),
        Eigen::Vector3d(-studio.Lamp())}) {
    const Eigen::Vector3d n = direction.normalized();
    const Eigen::Vector3d expected = IrradianceBySum(studio, n);
    const Eigen::Vector3d got =
        StudioIrradiance(n.dot(studio.up), n.dot(studio.Lamp()), n.dot(studio.Window()));
    EXPECT_LT((got - expected).cwiseAbs().maxCoeff(), 0.04) << n.transpose();
  }
}

TEST(StudioLightTest, LightsWhiteFacingLampFullyAndFarSidePartly) {
  const Studio studio;
  const auto light = [&](const Eigen::Vector3d& n) {
    return StudioIrradiance(n.dot(studio.up), n.dot(studio.Lamp()), n.dot(studio.Window())).mean();
  };
  EXPECT_NEAR(light(studio.Lamp()), 1.15, 0.25);
  EXPECT_GT(light(-studio.Lamp()), 0.25);
}

}  // namespace
}  // namespace sqslam
