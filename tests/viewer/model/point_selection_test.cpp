#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "app/viewer/model/annotation_points.h"
#include "tests/io/temporary_folder.h"
#include "tests/render/hand_made_map.h"

namespace sqslam::viewer {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using ::testing::ElementsAre;

TEST(PointSelection, SelectsInRotatedBox) {
  SelectionBox box;
  box.T_map_box = {Eigen::Quaterniond(Eigen::AngleAxisd(0.785398, Vector3d::UnitZ())), {1.0, 0.0, 0.0}};
  box.half_size = {1.0, 0.1, 0.1};
  const std::vector<Vector3d> points = {{1.6, 0.6, 0.0}, {1.6, -0.6, 0.0}, {1.0, 0.0, 0.05}, {1.0, 0.0, 0.2}};
  EXPECT_THAT(SelectInBox(points, box), ElementsAre(0, 2));
}

TEST(PointSelection, SelectsInsideLasso) {
  Camera camera{.width = 200, .height = 100, .fx = 100, .fy = 100, .cx = 100, .cy = 50};
  const Rigid3d T_map_camera{Eigen::Quaterniond::Identity(), {0.0, 0.0, -1.0}};
  // An L: its notch is outside.
  const std::vector<Vector2d> polygon = {{90, 40}, {130, 40}, {130, 50}, {110, 50}, {110, 70}, {90, 70}};
  const std::vector<Vector3d> points = {{0.0, 0.0, 0.0},    // 100, 50
                                        {0.2, -0.05, 0.0},  // 120, 45
                                        {0.2, 0.1, 0.0},    // 120, 60: the notch
                                        {0.0, 0.0, 9.0},    // far behind
                                        {0.0, 0.0, -2.0},   // behind the camera
                                        {0.5, 0.0, 0.0}};
  EXPECT_THAT(SelectInLasso(points, polygon, camera, T_map_camera), ElementsAre(0, 1, 3));
  EXPECT_THAT(SelectInLasso(points, std::vector<Vector2d>{}, camera, T_map_camera), ElementsAre());
  camera.distortion = {0.5, 0.0, 0.0, 0.0, 0.0};
  const std::vector<Vector3d> aside = {{0.45, 0.0, 0.0}};  // 145 without the lens, 149.6 with it
  EXPECT_THAT(SelectInLasso(aside, std::vector<Vector2d>{{148, 40}, {155, 40}, {155, 60}, {148, 60}}, camera,
                            T_map_camera),
              ElementsAre(0));
}

TEST(PointSelection, CombinesSelections) {
  const std::vector<int> old = {1, 3, 5};
  const std::vector<int> chosen = {3, 4};
  EXPECT_THAT(Combine(old, chosen, SelectMode::kReplace), ElementsAre(3, 4));
  EXPECT_THAT(Combine(old, chosen, SelectMode::kAdd), ElementsAre(1, 3, 4, 5));
  EXPECT_THAT(Combine(old, chosen, SelectMode::kRemove), ElementsAre(1, 5));
}

TEST(PointSelection, FindsGroundOfMapOrLargestPlane) {
  std::vector<Vector3d> points;
  for (int i = 0; i < 400; ++i) {
    points.push_back({0.1 * (i % 20), 0.1 * (i / 20), 0.3});  // a table
  }
  for (int i = 0; i < 500; ++i) {
    points.push_back({0.0, 0.1 * (i % 20), 0.05 * (i / 20)});  // a wall, with more points
  }
  ASSERT_TRUE(GroundHeight(points).has_value());
  EXPECT_NEAR(*GroundHeight(points), 0.3, 1e-6);
  MapSnapshot map = HandMadeMap();
  map.support_height = 0.75;
  EXPECT_EQ(GroundHeight(map), 0.75);
  map.support_height.reset();
  EXPECT_NEAR(*GroundHeight(map), 0.0, 1e-6);
  EXPECT_FALSE(GroundHeight(std::vector<Vector3d>{}).has_value());
  EXPECT_THAT(AboveGround(points, std::vector<int>{0, 400, 899}, 0.3, 0.01), ElementsAre(899));
}

TEST(PointSelection, ReadsCloudFiles) {
  const TemporaryFolder folder;
  const auto file = folder.Write("cloud.xyz", "1 2 3\n4 5 6\n");
  Sim3d half;
  half.scale = 0.5;
  const Points of_file = ReadPoints(file, half);
  EXPECT_THAT(of_file, ElementsAre(Vector3d(0.5, 1.0, 1.5), Vector3d(2.0, 2.5, 3.0)));
}

}  // namespace
}  // namespace sqslam::viewer
