#include "tests/support/surface_area.h"

#include <gtest/gtest.h>

#include <cmath>

#include "slam/fitting/surface_measures.h"

namespace sqslam {
namespace {

const double kExponents[] = {0.1, 0.3, 0.7, 1.0, 1.4, 1.9};

TEST(LogSurfaceArea, AgreesWithFineQuadrature) {
  for (const double e1 : kExponents) {
    for (const double e2 : kExponents) {
      const Superquadric shape{{0.3, 0.7, 1.1}, e1, e2};
      EXPECT_NEAR(LogSurfaceArea(shape), std::log(SurfaceArea(shape)), 0.02) << e1 << " " << e2;
    }
  }
}

TEST(LogSurfaceArea, GradientAgreesWithDifferences) {
  const Superquadric shape{{0.3, 0.7, 1.1}, 0.4, 1.3};
  Eigen::Matrix<double, 5, 1> gradient;
  LogSurfaceArea(shape, &gradient);
  for (int k = 0; k < 5; ++k) {
    const auto changed = [&](double change) {
      Superquadric other = shape;
      if (k < 3) {
        other.half_size[k] *= std::exp(change);
      } else {
        (k == 3 ? other.e1 : other.e2) += change;
      }
      return LogSurfaceArea(other);
    };
    EXPECT_NEAR(gradient[k], (changed(1e-4) - changed(-1e-4)) / 2e-4, 1e-6);
  }
}

}  // namespace
}  // namespace sqslam
