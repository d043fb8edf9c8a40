#include "slam/geometry/camera.h"

#include <gtest/gtest.h>

#include <string>

namespace sqslam {
namespace {

struct Lens {
  const char* name;
  Camera camera;
};

class LensTest : public ::testing::TestWithParam<Lens> {};

// The extractor takes distortion off each keypoint once; all that follows is a pinhole. Putting it on again
// has to give the keypoint back, everywhere in the image.
TEST_P(LensTest, UndistortedPixelsDistortBackToWhereTheyWere) {
  const Camera& camera = GetParam().camera;
  double worst = 0.0;
  for (int y = 0; y < camera.height; y += 7) {
    for (int x = 0; x < camera.width; x += 7) {
      const Eigen::Vector2d pixel(x, y);
      const Eigen::Vector2d back = camera.ProjectDistorted(camera.Unproject(camera.Undistort(pixel)));
      worst = std::max(worst, (back - pixel).norm());
    }
  }
  EXPECT_LT(worst, 0.01);
}

TEST_P(LensTest, PointsAreFoundWhereTheLensShowsThem) {
  const Camera& camera = GetParam().camera;
  for (const double x : {-0.5, -0.2, 0.0, 0.3, 0.5}) {
    for (const double y : {-0.35, 0.0, 0.1, 0.35}) {
      const Eigen::Vector3d point(2.0 * x, 2.0 * y, 2.0);
      EXPECT_LT((camera.Undistort(camera.ProjectDistorted(point)) - camera.Project(point)).norm(), 0.01);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(
    Camera, LensTest,
    ::testing::Values(
        Lens{"barrel", {640, 480, 500.0, 500.0, 320.0, 240.0, {-0.35, 0.12, 0.0, 0.0, 0.0}, 30.0}},
        Lens{"barrel_off_centre",
             {640, 480, 480.0, 490.0, 300.0, 260.0, {-0.35, 0.12, 0.001, -0.002, 0.0}, 30.0}},
        Lens{"tum_freiburg1",
             {640, 480, 517.3, 516.5, 318.6, 255.3, {0.2624, -0.9531, -0.0054, 0.0026, 1.1633}, 30.0}},
        Lens{"pinhole", {640, 480, 525.0, 525.0, 320.0, 240.0, {}, 30.0}}),
    [](const auto& info) { return std::string(info.param.name); });

// -0.5 alone folds the image over at 0.54 focal lengths from the centre: beyond that no ray has a pixel.
TEST(Camera, WhereTheLensModelFoldsOverUndistortionStaysFinite) {
  const Camera camera{640, 480, 400.0, 400.0, 320.0, 240.0, {-0.5, 0.0, 0.0, 0.0, 0.0}, 30.0};
  for (const int x : {0, 40, 320, 600, 639}) {
    for (const int y : {0, 240, 479}) {
      EXPECT_LT(camera.Undistort({x, y}).norm(), 1e4) << x << " " << y;
    }
  }
}

}  // namespace
}  // namespace sqslam
