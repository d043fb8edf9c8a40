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
      EXPECT_NEAR(LogSurfaceArea(shape.half_size, e1, e2), std::log(SurfaceArea(shape)), 0.02)
          << e1 << " " << e2;
    }
  }
}

}  // namespace
}  // namespace sqslam
