#include "slam/geometry/camera.h"

#include <gtest/gtest.h>

#include <opencv2/calib3d.hpp>
#include <string>

namespace sqslam {
namespace {

constexpr LensModel kFisheye = LensModel::kFisheye;

struct Lens {
  const char* name;
  Camera camera;
};

class LensTest : public ::testing::TestWithParam<Lens> {};

// The extractor undistorts each keypoint once; later stages use a pinhole camera. Distorting it again must
// return the keypoint, everywhere in the image.
TEST_P(LensTest, UndistortInvertsDistortion) {
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

TEST_P(LensTest, ProjectsPointsAsOpenCvDoes) {
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
        Lens{"fisheye",
             {640, 480, 300.0, 305.0, 315.0, 244.0, {-0.013, 0.006, -0.004, 0.0008}, 30.0, 0.0, kFisheye}},
        Lens{"equidistant", {640, 480, 400.0, 400.0, 320.0, 240.0, {}, 30.0, 0.0, kFisheye}},
        Lens{"pinhole", {640, 480, 525.0, 525.0, 320.0, 240.0, {}, 30.0}}),
    [](const auto& info) { return std::string(info.param.name); });

// k1 = -0.5 folds the image 0.54 focal lengths from the centre: no ray has a pixel beyond.
TEST(Camera, UndistortStaysFiniteWhenLensFolds) {
  const Camera camera{640, 480, 400.0, 400.0, 320.0, 240.0, {-0.5, 0.0, 0.0, 0.0, 0.0}, 30.0};
  for (const int x : {0, 40, 320, 600, 639}) {
    for (const int y : {0, 240, 479}) {
      EXPECT_LT(camera.Undistort({x, y}).norm(), 1e4) << x << " " << y;
    }
  }
}

// 640x480 pixels that see 152 degrees.
const Camera& WideLens() {
  static const Camera lens{640,  480, 230.0,   232.0, 318.0, 241.0, {-0.013, 0.006, -0.004, 0.0008},
                           30.0, 0.0, kFisheye};
  return lens;
}

TEST(FisheyeLens, AgreesWithOpenCv) {
  const Camera& lens = WideLens();
  const cv::Matx33d K(lens.fx, 0.0, lens.cx, 0.0, lens.fy, lens.cy, 0.0, 0.0, 1.0);
  const cv::Vec4d k(lens.distortion[0], lens.distortion[1], lens.distortion[2], lens.distortion[3]);
  std::vector<cv::Point3d> points;
  for (const double x : {-3.0, -1.0, -0.2, 0.0, 0.4, 2.0}) {
    for (const double y : {-1.5, 0.0, 0.1, 1.8}) {
      points.emplace_back(x, y, 1.0);
    }
  }
  std::vector<cv::Point2d> expected;
  cv::fisheye::projectPoints(points, expected, cv::Affine3d(), K, k);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3d point(points[i].x, points[i].y, points[i].z);
    const Eigen::Vector2d pixel = lens.ProjectDistorted(2.0 * point);
    EXPECT_NEAR(pixel.x(), expected[i].x, 1e-9) << points[i];
    EXPECT_NEAR(pixel.y(), expected[i].y, 1e-9) << points[i];
    EXPECT_LT((lens.Undistort(pixel) - lens.Project(point)).norm(), 1e-6) << points[i];
  }
}

TEST(FisheyeLens, ShowsPixelsOutsideUndistortedImage) {
  const Camera& lens = WideLens();
  EXPECT_TRUE(lens.HasDistortion());
  const Eigen::Vector2d at_border = lens.Undistort({2.0, 241.0});  // 76 degrees to the left
  EXPECT_LT(at_border.x(), -300.0);
  EXPECT_TRUE(lens.Shows(at_border));
  EXPECT_FALSE(lens.Shows(lens.Undistort({-3.0, 241.0})));
  EXPECT_LT(lens.ShownBounds()[0], at_border.x());
  const Camera pinhole = lens.WithoutDistortion();
  EXPECT_FALSE(pinhole.HasDistortion());
  EXPECT_FALSE(pinhole.Shows(at_border));
  EXPECT_EQ(pinhole.ShownBounds()[2], 640.0);
}

TEST(FisheyeLens, StaysFiniteBeyondHemisphere) {
  Camera lens = WideLens();
  lens.fx = lens.fy = 120.0;  // the corners would be 190 degrees off the axis
  for (const Eigen::Vector2d& pixel : {Eigen::Vector2d(0.0, 0.0), Eigen::Vector2d(639.0, 479.0)}) {
    EXPECT_LT(lens.Undistort(pixel).norm(), 3000.0);
  }
  lens.distortion = {-0.9, 0.0, 0.0, 0.0};  // folds over
  EXPECT_LT(lens.Undistort({0.0, 0.0}).norm(), 3000.0);
}

TEST(FisheyeLens, RotatesWithImages) {
  const Camera& lens = WideLens();
  const Camera turned = RotatedCamera(lens, 1);
  const Eigen::Vector3d point(0.9, -0.4, 1.0);
  const Eigen::Vector2d pixel = lens.ProjectDistorted(point);
  const Eigen::Vector2d clockwise(lens.height - 1.0 - pixel.y(), pixel.x());
  EXPECT_LT((turned.ProjectDistorted({0.4, 0.9, 1.0}) - clockwise).norm(), 1e-9);
}

}  // namespace
}  // namespace sqslam
