#include "render/gl/solid_areas.h"

#include <gtest/gtest.h>

namespace sqslam {
namespace {

// Near plane 1, far plane infinitely far.
Eigen::Matrix4d Perspective() {
  Eigen::Matrix4d perspective = Eigen::Matrix4d::Zero();
  perspective.diagonal() << 1.0, 1.0, -1.0, 0.0;
  perspective(2, 3) = -2.0;
  perspective(3, 2) = -1.0;
  return perspective;
}

ClipBox Box(const Eigen::Vector3d& low, const Eigen::Vector3d& high) { return {{low, high}, Perspective()}; }

// Returns how often the areas cover each pixel.
cv::Mat1i Covered(const std::vector<cv::Rect>& areas, cv::Size picture) {
  cv::Mat1i times(picture, 0);
  for (const cv::Rect& area : areas) {
    times(area) += 1;
  }
  return times;
}

TEST(SolidAreasTest, CoversEachPixelOnce) {
  const cv::Size picture(203, 101);
  const std::vector<ClipBox> solids = {
      Box({-1.0, 0.0, -4.0}, {1.0, 1.0, -2.0}),    // 50 to 152, 50 to 76
      Box({0.8, -1.0, -2.0}, {5.0, -0.5, -1.5}),   // reaches beyond the border
      Box({-9.0, 0.0, -2.0}, {-8.0, 1.0, -1.5})};  // beside the picture
  const SolidAreas areas = FindSolidAreas(solids, picture, 4.0);
  const cv::Mat1i near = Covered(areas.near_solids, picture);
  EXPECT_EQ(cv::countNonZero(near + Covered(areas.elsewhere, picture) != 1), 0);
  EXPECT_EQ(near(60, 47), 1) << "within the margin";
  EXPECT_EQ(near(76, 152), 1);
  EXPECT_EQ(near(20, 202), 1);
  EXPECT_EQ(near(60, 20), 0);
  EXPECT_EQ(near(20, 60), 0);
}

TEST(SolidAreasTest, IncludesWholePictureWhenBoxReachesBehindCamera) {
  const std::vector<ClipBox> solids = {Box({-1.0, 0.0, -4.0}, {1.0, 1.0, 2.0})};
  EXPECT_TRUE(FindSolidAreas(solids, {200, 100}, 0.0).elsewhere.empty());
}

TEST(SolidAreasTest, FindsNoneWithoutSolids) {
  EXPECT_TRUE(FindSolidAreas({}, {200, 100}, 4.0).near_solids.empty());
}

}  // namespace
}  // namespace sqslam
