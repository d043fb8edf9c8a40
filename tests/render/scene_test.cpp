#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>

#include "hand_made_map.h"
#include "render/camera/camera_path.h"
#include "render/camera/scene_framing.h"
#include "render/picture/picture_overlay.h"
#include "render/scene/scene_geometry.h"
#include "render/scene/style.h"
#include "render/solids/scene_order.h"
#include "render/video/video_alignment.h"
#include "slam/geometry/angles.h"

namespace sqslam {
namespace {

TEST(FramingTest, IgnoresOutliers) {
  const MapSnapshot map = HandMadeMap();
  MapSnapshot with_stray = map;
  with_stray.points.push_back({Eigen::Vector3f(900.0F, -300.0F, 50.0F), {0, 0, 0}, -1});
  const ViewCamera a = FrameScene(FindFocus(map), 1.5);
  const ViewCamera b = FrameScene(FindFocus(with_stray), 1.5);
  EXPECT_LT((a.position - b.position).norm(), 0.02 * a.Distance());
  EXPECT_LT((a.focal_point - b.focal_point).norm(), 0.02 * a.Distance());
}

TEST(FramingTest, KeepsRadiusWithOutliersAndNoObjects) {
  MapSnapshot map = HandMadeMap();
  map.objects.clear();
  const double before = FindFocus(map).radius;
  map.points.push_back({Eigen::Vector3f(900.0F, -300.0F, 50.0F), {0, 0, 0}, -1});
  EXPECT_NEAR(FindFocus(map).radius, before, 0.05 * before);
}

TEST(FramingTest, ContainsEveryObject) {
  const MapSnapshot map = HandMadeMap();
  for (const double aspect : {0.5, 1.0, 16.0 / 9.0, 3.0}) {
    const ViewCamera camera = FrameScene(FindFocus(map), aspect);
    const cv::Size size(static_cast<int>(1000 * aspect), 1000);
    for (const SnapshotObject& object : map.objects) {
      for (int i = 0; i < 64; ++i) {
        const double angle = 2.0 * std::numbers::pi * i / 64;
        const PosedSuperquadric& solid = object.superquadric;
        const SeenPoint seen = Project(camera, size, solid.T_map_object * solid.shape.PointAt(0.0, angle));
        EXPECT_GT(seen.depth, 0.0);
        EXPECT_TRUE(cv::Rect(cv::Point(), size).contains(seen.pixel));
      }
    }
  }
}

TEST(FramingTest, IgnoresUndrawnParts) {
  MapSnapshot map = HandMadeMap();
  map.keyframes.back().T_map_camera.translation = {9.0, 0.0, 1.0};
  map.objects.front().fit.reliability = 0.1;
  map.objects.front().superquadric.T_map_object.translation = {0.0, 0.0, 7.0};
  const auto farthest = [&](const FramedParts& parts, int axis) {
    double most = 0.0;
    for (const Eigen::Vector3d& p : FindFocus(map, parts).outline) {
      most = std::max(most, p[axis]);
    }
    return most;
  };
  EXPECT_EQ(farthest({}, 0), 9.0);
  EXPECT_LT(farthest({.path = false}, 0), 2.0);
  EXPECT_GT(farthest({}, 2), 6.0);
  EXPECT_LT(farthest({.uncertain_objects = false}, 2), 2.0);
  EXPECT_LT(farthest({.objects = false}, 2), 2.0);
  EXPECT_FALSE(FindFocus(map, {.points = false}).outline.empty());
}

TEST(FramingTest, ContainsPathButKeepsScale) {
  MapSnapshot map = HandMadeMap();
  const double radius = FindFocus(map).radius;
  map.keyframes.push_back(map.keyframes.back());
  map.keyframes.back().T_map_camera.translation = {4.0, -3.0, 1.0};
  const SceneFocus focus = FindFocus(map);
  EXPECT_NEAR(focus.radius, radius, 1e-9);
  const cv::Size size(1280, 720);
  const double aspect = 1280.0 / 720.0;
  std::vector<ViewCamera> views = {FrameScene(focus, aspect), PresetView("top", focus, aspect)};
  const ViewCamera turned = Azimuth(views.front(), 50.0);
  views.push_back(FitOutline(turned, focus.outline, aspect));
  const std::vector<ViewCamera> orbit = OrbitPath(views.front(), 24, focus.up);
  const double distance = DistanceForAll(orbit, focus.outline, aspect);
  for (const ViewCamera& view : orbit) {
    views.push_back(Zoom(view, view.Distance() / distance));
  }
  for (const ViewCamera& view : views) {
    for (const SnapshotKeyframe& keyframe : map.keyframes) {
      const SeenPoint seen = Project(view, size, keyframe.T_map_camera.translation);
      EXPECT_GT(seen.depth, 0.0);
      EXPECT_TRUE(cv::Rect(cv::Point(), size).contains(seen.pixel));
    }
  }
}

// A wall behind the objects, and a stray point.
std::vector<Eigen::Vector3d> Wall(const SceneFocus& focus) {
  std::vector<Eigen::Vector3d> wall;
  for (int i = 0; i < 2500; ++i) {
    wall.push_back(focus.center +
                   focus.radius * Eigen::Vector3d(0.04 * (i % 50) - 1.0, 0.9, 0.03 * (i / 50)));
  }
  wall.emplace_back(focus.center + 40.0 * focus.radius * Eigen::Vector3d::UnitX());
  return wall;
}

bool Inside(const ViewCamera& view, const Eigen::Vector3d& p, const cv::Rect& area) {
  const SeenPoint seen = Project(view, {1280, 720}, p);
  return seen.depth > 0.0 && area.contains(seen.pixel);
}

TEST(FramingTest, ContainsBulkOfCloudButKeepsScale) {
  const MapSnapshot map = HandMadeMap();
  SceneFocus focus = FindFocus(map);
  const SceneFocus before = focus;
  const std::vector<Eigen::Vector3d> wall = Wall(focus);
  IncludeCloud(wall, focus);
  EXPECT_EQ(focus.radius, before.radius);
  EXPECT_EQ(focus.center, before.center);
  const auto inside = [&](const SceneFocus& framed) {
    const ViewCamera view = FrameScene(framed, 1280.0 / 720.0);
    return std::count_if(wall.begin(), wall.end(), [&](const auto& p) {
      return Inside(view, p, {0, 0, 1280, 720});
    });
  };
  EXPECT_LT(inside(before), 2300);
  EXPECT_EQ(inside(focus), 2500);
  EXPECT_LT(FrameScene(focus, 1.5).Distance(), 3.0 * FrameScene(before, 1.5).Distance())
      << "without the stray point";
}

TEST(FramingTest, KeepsDeskNearWhenWallIsMuchLonger) {
  SceneFocus focus = FindFocus(HandMadeMap());
  const double without = FrameScene(focus, 1.5).Distance();
  std::vector<Eigen::Vector3d> wall;
  for (int i = 0; i < 4000; ++i) {
    wall.push_back(focus.center + focus.radius * Eigen::Vector3d(0.1 * (i % 80) - 4.0, 0.9,
                                                                 0.02 * (i / 80)));  // NOLINT: rows
  }
  IncludeCloud(wall, focus);
  EXPECT_LT(FrameScene(focus, 1.5).Distance(), 1.45 * without);
}

TEST(FramingTest, PlacesGridOnFloorWhenObjectsStandThere) {
  MapSnapshot map = HandMadeMap();
  EXPECT_EQ(FindFocus(map).ground_height, 0.0);
  SnapshotObject chair = map.objects.front();
  chair.label = "chair";
  chair.superquadric.shape.half_size = {0.2, 0.2, 0.4};
  chair.superquadric.T_map_object.translation = {1.0, 0.0, -0.3};
  map.objects.push_back(chair);
  EXPECT_NEAR(FindFocus(map).ground_height, -0.7, 1e-9);
  map.objects.back().fit.reliability = 0.0;  // it may not be there
  EXPECT_EQ(FindFocus(map).ground_height, 0.0);
}

TEST(FramingTest, KeepsOutlineClearOfTexts) {
  SceneFocus focus = FindFocus(HandMadeMap());
  IncludeCloud(Wall(focus), focus);
  const double aspect = 1280.0 / 720.0;
  const ViewCamera plain = FrameScene(focus, aspect);
  const auto covered = [&](const ViewCamera& view, const cv::Rect& area) {
    return std::any_of(focus.outline.begin(), focus.outline.end(),
                       [&](const Eigen::Vector3d& p) { return Inside(view, p, area); });
  };
  for (const cv::Rect& text :
       {cv::Rect(1000, 0, 280, 300), cv::Rect(0, 420, 400, 300), cv::Rect(0, 0, 1280, 150)}) {
    const std::vector<PicturePart> written = {{Eigen::Vector2d(text.x / 1280.0, text.y / 720.0),
                                               Eigen::Vector2d(text.br().x / 1280.0, text.br().y / 720.0)}};
    EXPECT_TRUE(covered(plain, text));
    const ViewCamera view = FitBeside(plain, focus.outline, aspect, written);
    EXPECT_FALSE(covered(view, text));
    for (const Eigen::Vector3d& p : focus.outline) {
      EXPECT_TRUE(Inside(view, p, {0, 0, 1280, 720}));
    }
  }
  const ViewCamera same = FitBeside(plain, focus.outline, aspect, {});
  EXPECT_LT((same.position - plain.position).norm(), 1e-3 * plain.Distance());
}

TEST(FramingTest, LooksDownFromCameraSide) {
  const MapSnapshot map = HandMadeMap();
  const ViewCamera camera = FrameScene(FindFocus(map), 1.5);
  EXPECT_GT(camera.position.z(), camera.focal_point.z());
  EXPECT_LT(camera.position.y(), camera.focal_point.y());  // the keyframes stand at negative y
}

TEST(FramingTest, TurnsPlanAlongLongestWall) {
  constexpr double kTurn = 33.0 * kRadiansPerDegree;
  const Eigen::Vector3d wall(std::cos(kTurn), std::sin(kTurn), 0.0);
  const Eigen::Vector3d other(-wall.y(), wall.x(), 0.0);
  SceneFocus focus;
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < 200; ++i) {  // two walls 2.5 m high, 4 m and 2.5 m long, and a floor
    const Eigen::Vector3d height(0.0, 0.0, 0.0125 * i), noise = 0.02 * std::sin(7.0 * i) * (wall + other);
    points.push_back(noise + 0.02 * ((37 * i) % 200) * wall + height);
    if (i < 125) {
      points.push_back(noise + 0.02 * ((37 * i) % 125) * other + height);
    }
    points.push_back(0.02 * ((41 * i) % 200) * wall + 0.0125 * i * other);
  }
  focus.outline = points;
  focus.main_direction = MainDirection(points, focus.up);
  EXPECT_GT(std::abs(focus.main_direction->dot(wall)), std::cos(1.5 * kRadiansPerDegree));
  for (const double aspect : {0.6, 1.6}) {
    const ViewCamera plan = PresetView("top", focus, aspect, 30.0, Projection::kOrthographic);
    const Eigen::Vector3d along = aspect > 1.0 ? AxesOf(plan).right : plan.view_up;
    EXPECT_NEAR(std::abs(along.dot(*focus.main_direction)), 1.0, 1e-9);
    EXPECT_LE(plan.view_up.dot(focus.front), 0.0);  // the front is below
    for (const Eigen::Vector3d& p : points) {
      const SeenPoint seen = Project(plan, cv::Size(static_cast<int>(1000 * aspect), 1000), p);
      EXPECT_TRUE(cv::Rect2d(0, 0, 1000 * aspect, 1000).contains(seen.pixel));
    }
  }
}

using Order = std::vector<std::size_t>;

TEST(StyleTest, KeepsReadableColorsInRangeForAnyContrast) {
  for (const double paper : {0.0, 0.3, 0.49, 0.5, 0.7, 1.0}) {
    for (const double ink : {0.0, 0.4, 1.0}) {
      for (const double contrast : {0.0, 0.3, 0.6, 1.0}) {
        const Eigen::Vector3d color =
            ReadableOn(Eigen::Vector3d::Constant(paper), Eigen::Vector3d::Constant(ink), contrast);
        EXPECT_GE(color.minCoeff(), 0.0) << paper << " " << ink << " " << contrast;
        EXPECT_LE(color.maxCoeff(), 1.0 + 1e-9) << paper << " " << ink << " " << contrast;
      }
    }
  }
}

TEST(FrustumTest, MatchesImageCorners) {
  MapSnapshot map = HandMadeMap();
  map.camera = {.width = 320, .height = 240, .fx = 300.0, .fy = 200.0, .cx = 100.0, .cy = 50.0};
  map.T_map_camera = Rigid3d{};
  const auto frustum = CurrentFrustum(map, 1.2, {});
  std::vector<Eigen::Vector2d> pixels;
  for (vtkIdType i = 1; i <= 4; ++i) {  // after the eye
    pixels.push_back(map.camera.Project(Eigen::Map<const Eigen::Vector3d>(frustum->GetPoint(i))));
  }
  EXPECT_LT((pixels[0] - Eigen::Vector2d(-0.5, -0.5)).norm(), 1e-3);
  EXPECT_LT((pixels[1] - Eigen::Vector2d(319.5, -0.5)).norm(), 1e-3);
  EXPECT_LT((pixels[2] - Eigen::Vector2d(319.5, 239.5)).norm(), 1e-3);
  EXPECT_LT((pixels[3] - Eigen::Vector2d(-0.5, 239.5)).norm(), 1e-3);
}

TEST(SolidOrderTest, DrawsNearerOfTwoLast) {
  std::vector<PosedSuperquadric> solids(2);
  solids[0].T_map_object.translation = {0.0, 0.0, 0.0};
  solids[1].T_map_object.translation = {5.0, 0.0, 0.0};
  const SolidOrder order(solids);
  EXPECT_EQ(order.BackToFront({20.0, 0.0, 0.0}), (Order{0, 1}));
  EXPECT_EQ(order.BackToFront({-20.0, 0.0, 0.0}), (Order{1, 0}));
}

TEST(SolidOrderTest, DrawsCupAtFarEndAfterItsTable) {
  std::vector<PosedSuperquadric> solids(2);
  solids[0].shape = {{0.1, 0.1, 0.1}, 0.3, 1.0};
  solids[0].T_map_object.translation = {0.0, 1.8, 0.2};
  solids[1].shape = {{1.0, 2.0, 0.1}, 0.1, 0.1};
  const Eigen::Vector3d eye(0.0, -4.0, 2.0);  // nearer to the table's centre than to the cup
  EXPECT_EQ(SolidOrder(solids).BackToFront(eye), (Order{1, 0}));
}

TEST(SolidOrderTest, DrawsNearerOfTwoInterpenetratingSolidsLast) {
  std::vector<PosedSuperquadric> solids(4);
  for (int i = 0; i < 4; ++i) {
    solids[static_cast<std::size_t>(i)].shape.half_size.setConstant(1.0);
    solids[static_cast<std::size_t>(i)].T_map_object.translation = {i < 2 ? 1.2 * i : 4.0 * i, 0.0, 0.0};
  }
  EXPECT_EQ(SolidOrder(solids).BackToFront({50.0, 0.0, 0.0}), (Order{0, 1, 2, 3}));
  EXPECT_EQ(SolidOrder(solids).BackToFront({-50.0, 0.0, 0.0}), (Order{3, 2, 1, 0}));
}

TEST(SolidOrderTest, OrdersThousandsOfSolidsByDistance) {
  std::vector<PosedSuperquadric> solids(3000);
  for (std::size_t i = 0; i < solids.size(); ++i) {  // a row, each reaching into the next one
    solids[i].shape.half_size.setConstant(1.0);
    solids[i].T_map_object.translation = {static_cast<double>(i), 0.0, 0.0};
  }
  const Order order = SolidOrder(solids).BackToFront({-10.0, 0.0, 0.0});
  ASSERT_EQ(order.size(), solids.size());
  EXPECT_EQ(order.front(), 2999U);
  EXPECT_EQ(order.back(), 0U);
}

TEST(CameraPathTest, OrbitKeepsDistanceAndCloses) {
  const std::vector<ViewCamera> path = OrbitPath(ViewCamera(), 36, Eigen::Vector3d::UnitZ());
  ASSERT_EQ(path.size(), 36U);
  for (const ViewCamera& view : path) {
    EXPECT_NEAR(view.Distance(), ViewCamera().Distance(), 1e-9);
  }
  EXPECT_LT((Azimuth(path.back(), 10.0).position - path.front().position).norm(), 1e-9);
}

TEST(CameraPathTest, OrbitStaysAboveWhenViewIsFromAbove) {
  ViewCamera above;
  above.position = {0.0, 0.0, 5.0};
  above.view_up = Eigen::Vector3d::UnitY();
  for (const ViewCamera& view : OrbitPath(above, 8, Eigen::Vector3d::UnitZ())) {
    EXPECT_LT((view.position - above.position).norm(), 1e-9);
    EXPECT_NEAR(view.view_up.z(), 0.0, 1e-9);
  }
  EXPECT_LT((OrbitPath(above, 8, Eigen::Vector3d::UnitZ())[2].view_up + Eigen::Vector3d::UnitX()).norm(),
            1e-9);
}

TEST(CameraPathTest, FirstPersonProjectsLikeInputCamera) {
  const MapSnapshot map = HandMadeMap();
  const Rigid3d& pose = map.keyframes[3].T_map_camera;
  const ViewCamera view = FirstPerson(pose, map.camera, 1.0);
  const Eigen::Vector3d p(0.1, 0.2, 0.1);
  const Eigen::Vector2d expected = map.camera.Project(pose.Inverse() * p);
  const SeenPoint seen = Project(view, {map.camera.width, map.camera.height}, p);
  EXPECT_NEAR(seen.pixel.x - 0.5, expected.x(), 1e-6);  // a pixel's centre lies at a half here
  EXPECT_NEAR(seen.pixel.y - 0.5, expected.y(), 1e-6);
}

TEST(AlignmentTest, UndoesRotationAndScale) {
  const MapSnapshot last = HandMadeMap();
  Sim3d moved;
  moved.scale = 0.7;
  moved.rotation = Eigen::AngleAxisd(0.9, Eigen::Vector3d(1, -2, 0.5).normalized());
  moved.translation = {3.0, -1.0, 0.5};
  const MapSnapshot early = Transformed(moved, last);
  const MapSnapshot back = Transformed(AlignByKeyframes(early, last), early);
  EXPECT_LT((back.points[77].p_map - last.points[77].p_map).norm(), 1e-5F);
  EXPECT_NEAR(back.objects[0].superquadric.shape.half_size.x(), 0.3, 1e-6);
}

}  // namespace
}  // namespace sqslam
