#include "slam/dense/dense_cloud.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "slam/io/point_cloud.h"
#include "slam/util/text_lines.h"
#include "tests/io/temporary_folder.h"

namespace sqslam {
namespace {

using ::testing::HasSubstr;

// A camera half a metre above a table (z = 0), looking down aslant.
DepthMap TableFromAbove() {
  DepthMap map;
  map.camera = {80, 60, 70.0, 70.0, 40.0, 30.0, {}, 30.0};
  map.T_map_camera.rotation = Eigen::AngleAxisd(2.5, Eigen::Vector3d::UnitX());
  map.T_map_camera.translation = {0.1, 0.2, 0.5};
  map.depth = cv::Mat(60, 80, CV_32F);
  map.views = cv::Mat(60, 80, CV_8U, cv::Scalar(3));
  map.bgr = cv::Mat(60, 80, CV_8UC3, cv::Scalar(30, 20, 10));
  for (int y = 0; y < 60; ++y) {
    for (int x = 0; x < 80; ++x) {
      const Eigen::Vector3d ray =
          map.T_map_camera.rotation * map.camera.Unproject({static_cast<double>(x), static_cast<double>(y)});
      map.depth.at<float>(y, x) = static_cast<float>(-0.5 / ray.z());
    }
  }
  return map;
}

TEST(DenseCloud, GivesPointsAndNormalsOfTable) {
  CloudFusion fusion(0.01);
  fusion.Add(TableFromAbove());
  const DenseCloud cloud = fusion.Cloud();
  ASSERT_GT(cloud.size(), 1000U);
  for (const DensePoint& point : cloud) {
    EXPECT_NEAR(point.p_map.z(), 0.0F, 1e-5F);
    EXPECT_GT(point.normal.z(), 0.999F);
    EXPECT_EQ(point.rgb, (std::array<std::uint8_t, 3>{10, 20, 30}));
    EXPECT_EQ(point.views, 3);
  }
}

TEST(DenseCloud, MergesSameSurfaceSeenTwice) {
  CloudFusion once(0.02);
  once.Add(TableFromAbove());
  CloudFusion twice(0.02);
  twice.Add(TableFromAbove());
  twice.Add(TableFromAbove());
  EXPECT_EQ(once.Cloud().size(), twice.Cloud().size());
}

TEST(DenseCloud, MergesLayersOfOneSurface) {
  DepthMap lower = TableFromAbove();
  DepthMap upper = TableFromAbove();
  DepthMap between = TableFromAbove();
  lower.T_map_camera.translation.z() -= 0.001;
  between.T_map_camera.translation.z() += 0.005;
  upper.T_map_camera.translation.z() += 0.011;
  CloudFusion one(0.01);
  one.Add(between);
  CloudFusion both(0.01);
  both.Add(lower);
  both.Add(upper);
  const DenseCloud cloud = both.Cloud();
  double squares = 0.0;
  for (const DensePoint& point : cloud) {
    squares += std::pow(point.p_map.z() - 0.005, 2);
  }
  EXPECT_LT(std::sqrt(squares / static_cast<double>(cloud.size())), 0.002);
  EXPECT_LT(static_cast<double>(cloud.size()), 1.3 * static_cast<double>(one.Cloud().size()));
}

TEST(DenseCloud, KeepsTopOfBoxAboveTable) {
  CloudFusion fusion(0.01);
  fusion.Add(TableFromAbove());
  DepthMap box = TableFromAbove();
  box.T_map_camera.translation.z() += 0.05;  // its top is well above the table
  box.depth.colRange(40, 80).setTo(0.0F);
  fusion.Add(box);
  for (const DensePoint& point : fusion.Cloud()) {
    EXPECT_LT(std::min(std::abs(point.p_map.z()), std::abs(point.p_map.z() - 0.05F)), 1e-4F);
  }
}

// One map of a table with something 30 mm above its right half, and `tables` maps of the bare table.
DenseCloud SeenAbove(int tables) {
  CloudFusion fusion(0.01);
  for (int i = 0; i < tables; ++i) {
    fusion.Add(TableFromAbove());
  }
  DepthMap above = TableFromAbove();
  above.T_map_camera.translation.z() += 0.03;
  above.depth.colRange(0, 40).setTo(0.0F);
  above.views.setTo(2);
  fusion.Add(above);
  return fusion.Cloud();
}

TEST(DenseCloud, DropsPointsBesideBetterSeenSurface) {
  const auto highest = [](const DenseCloud& cloud) {
    return std::ranges::max(cloud, {}, [](const DensePoint& point) { return point.p_map.z(); }).p_map.z();
  };
  EXPECT_GT(highest(SeenAbove(1)), 0.02F);
  EXPECT_LT(highest(SeenAbove(40)), 0.001F);
}

TEST(DenseCloud, WeightsPointsByInverseVariance) {
  DepthMap sure = TableFromAbove();
  sure.sigma = cv::Mat(60, 80, CV_32F, cv::Scalar(0.002));
  DepthMap unsure = TableFromAbove();
  unsure.sigma = cv::Mat(60, 80, CV_32F, cv::Scalar(0.006));
  unsure.T_map_camera.translation.z() += 0.005;
  CloudFusion fusion(0.02);
  fusion.Add(sure);
  fusion.Add(unsure);
  double sum = 0.0;
  const DenseCloud cloud = fusion.Cloud();
  for (const DensePoint& point : cloud) {
    sum += point.p_map.z();
    EXPECT_GT(point.sigma, 0.002F * 0.4F);
    EXPECT_LT(point.sigma, 0.006F * 2.0F);
  }
  EXPECT_NEAR(sum / static_cast<double>(cloud.size()), 0.0005, 2e-4);
}

TEST(DenseCloud, PrefersMeasuredOverFilledPoints) {
  const DepthMap measured = TableFromAbove();
  DepthMap filled = TableFromAbove();
  filled.views = cv::Mat(60, 80, CV_8U, cv::Scalar(kFilledByPlane));
  filled.bgr = cv::Mat(60, 80, CV_8UC3, cv::Scalar(255, 255, 255));
  for (const bool measured_first : {true, false}) {
    CloudFusion fusion(0.02);
    fusion.Add(measured_first ? measured : filled);
    fusion.Add(measured_first ? filled : measured);
    for (const DensePoint& point : fusion.Cloud()) {
      EXPECT_EQ(point.views, 3);
      EXPECT_EQ(point.rgb[0], 10);
    }
  }
}

TEST(DenseCloud, TakesNormalFromOneSideOfDepthEdge) {
  DepthMap map = TableFromAbove();
  for (int y = 0; y < 60; ++y) {
    for (int x = 40; x < 80; ++x) {
      map.depth.at<float>(y, x) *= 0.5F;
    }
  }
  EXPECT_GT(NormalAt(map, 39, 30).z(), 0.999);  // from its own side alone
  map.depth.col(38).setTo(0.0F);
  map.depth.col(37).setTo(0.0F);
  EXPECT_EQ(NormalAt(map, 39, 30), Eigen::Vector3d::Zero());
}

TEST(DenseCloud, WritesReadablePly) {
  CloudFusion fusion(0.02);
  fusion.Add(TableFromAbove());
  const DenseCloud cloud = fusion.Cloud();
  const TemporaryFolder folder;
  WriteDenseCloud(folder.Path() / "dense.ply", cloud);
  const PointCloud read = ReadPointCloud(folder.Path() / "dense.ply");
  ASSERT_EQ(read.points.size(), cloud.size());
  EXPECT_EQ(read.points[5].cast<float>(), cloud[5].p_map);
  EXPECT_EQ(read.rgb[5], cloud[5].rgb);
}

TEST(DenseCloud, RefusesPointCountBeyondFileSize) {
  const TemporaryFolder folder;
  const std::filesystem::path file = folder.Path() / "dense.ply";
  WriteDenseCloud(file, {});
  const std::string empty = ReadFile(file, "");
  constexpr const char* kWraps = "4611686018427387904";  // 2^62: its bytes are a multiple of 2^64
  for (const char* points : {"1", kWraps, "18446744073709551615", "99999999999999999999"}) {
    std::string promised = empty;
    promised.replace(promised.find("vertex 0") + 7, 1, points);
    folder.Write("dense.ply", promised);
    EXPECT_THAT(InputErrorOf([&] { ReadDensePoints(file); }), HasSubstr("expected a dense.ply")) << points;
  }
}

}  // namespace
}  // namespace sqslam
