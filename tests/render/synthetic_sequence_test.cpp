#include "render/synthetic/synthetic_sequence.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <iterator>
#include <opencv2/imgcodecs.hpp>
#include <set>

#include "render/solids/tessellation.h"
#include "render/synthetic/scene_renderer.h"
#include "render/synthetic/true_surface.h"
#include "slam/io/cameras.h"
#include "slam/io/point_cloud.h"
#include "slam/util/error.h"

namespace sqslam {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

std::string FileText(const fs::path& path) {
  std::ifstream stream(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

// Two bodies beside each other and a third hidden behind the first; the principal point is off the middle.
SceneDescription SmallScene() {
  SceneDescription scene;
  scene.frames = 3;
  scene.camera = {.width = 160, .height = 120, .fx = 140.0, .fy = 150.0, .cx = 71.0, .cy = 66.5};
  const auto add = [&](std::int32_t id, const Superquadric& shape, const Eigen::Vector3d& center,
                       double yaw) {
    SceneBody body;
    body.id = id;
    body.label = id == 2 ? "sports ball" : "box";
    body.superquadric = {shape,
                         {Eigen::Quaterniond(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ())), center}};
    body.yaw = yaw;
    body.texture = {"ceramic", {{200, 60, 40}, {240, 230, 210}}, "", static_cast<std::uint64_t>(id)};
    scene.bodies.push_back(body);
  };
  add(1, {{0.2, 0.12, 0.3}, 0.1, 0.1}, {-0.35, 0.0, 0.0}, 0.4);
  add(2, {{0.2, 0.2, 0.2}, 1.0, 1.0}, {0.35, 0.1, 0.05}, 0.0);
  add(3, {{0.05, 0.05, 0.05}, 0.5, 1.0}, {-0.45, 0.6, 0.0}, 0.0);
  scene.lights.push_back({{0, -1, 3}, {0, 0.5, 0}, {0.5, 0, 0}, {3, 3, 3}});
  scene.waypoints = {{{-0.1, -2.0, 0.3}, {0, 0, 0}}, {{0.1, -2.0, 0.35}, {0.05, 0, 0}}};
  return scene;
}

Box2d ProjectedBox(const SceneBody& body, const Camera& camera, const Rigid3d& T_world_camera) {
  Eigen::Array2d low = Eigen::Array2d::Constant(1e9);
  Eigen::Array2d high = -low;
  for (const Eigen::Vector3f& vertex : Tessellate(body.superquadric.shape).vertices) {
    const Eigen::Vector3d p_world = body.superquadric.T_map_object * vertex.cast<double>();
    const Eigen::Vector2d pixel = camera.ProjectDistorted(T_world_camera.Inverse() * p_world);
    low = low.min(pixel.array());
    high = high.max(pixel.array());
  }
  return {low.x(), low.y(), high.x() - low.x(), high.y() - low.y()};
}

TEST(SyntheticSceneTest, MatchesBoxesWithProjectionsOfVisibleBodies) {
  const SceneDescription scene = SmallScene();
  SceneRenderer renderer(scene, 2, RenderBackend::kAuto);
  for (const Rigid3d& pose : HandHeldMotion(scene, scene.frames, 1)) {
    const auto boxes = FindExactBoxes(scene, pose, renderer.Render(pose).ids, 2);
    ASSERT_EQ(boxes.size(), 2U);  // the third is hidden
    for (const ExactBox& exact : boxes) {
      const Box2d expected =
          ProjectedBox(scene.bodies[static_cast<std::size_t>(exact.object_id) - 1], scene.camera, pose);
      const Box2d& box = exact.detection.box;
      EXPECT_NEAR(box.x, expected.x, 0.6);
      EXPECT_NEAR(box.y, expected.y, 0.6);
      EXPECT_NEAR(box.x + box.width, expected.x + expected.width, 0.6);
      EXPECT_NEAR(box.y + box.height, expected.y + expected.height, 0.6);
      EXPECT_NEAR(exact.visible_fraction, 1.0, 0.02);
    }
  }
}

// An equidistant lens that sees 107 degrees from corner to corner.
Camera EquidistantLens() {
  Camera lens = {.width = 160, .height = 120, .fx = 107.0, .fy = 107.0, .cx = 81.0, .cy = 58.5};
  lens.lens = LensModel::kFisheye;
  return lens;
}

Camera BarrelLens() {
  Camera lens = EquidistantLens();
  lens.lens = LensModel::kRadialTangential;
  lens.distortion = {-0.1};
  return lens;
}

void ExpectBentPictureAndBoxes(const Camera& lens) {
  SceneDescription scene = SmallScene();
  scene.bodies.resize(2);
  scene.camera = lens;
  const SceneBody& ball = scene.bodies[1];
  const Eigen::Vector3d center = ball.superquadric.T_map_object.translation;
  Rigid3d pose = LookAt(center - Eigen::Vector3d(0.0, 1.2, 0.0), center);
  pose.rotation =
      pose.rotation * Eigen::AngleAxisd(-0.47, Eigen::Vector3d::UnitY());  // the ball at the border
  SceneRenderer renderer(scene, 2, RenderBackend::kAuto);
  EXPECT_EQ(renderer.Render(pose).color.size(), cv::Size(160, 120));
  const auto boxes = FindExactBoxes(scene, pose, renderer.Render(pose).ids, 2);
  const auto exact = std::ranges::find(boxes, 2, &ExactBox::object_id);
  ASSERT_NE(exact, boxes.end());
  const Box2d expected = ProjectedBox(ball, scene.camera, pose);
  const Box2d& box = exact->detection.box;
  EXPECT_GT(box.x, 110.0);
  EXPECT_NEAR(box.x, expected.x, 0.6);
  EXPECT_NEAR(box.y, expected.y, 0.6);
  EXPECT_NEAR(box.x + box.width, expected.x + expected.width, 0.6);
  EXPECT_NEAR(box.y + box.height, expected.y + expected.height, 0.6);
  EXPECT_NEAR(exact->visible_fraction, 1.0, 0.02);
}

TEST(SyntheticSceneTest, BendsPictureAndBoxesThroughFisheyeLens) {
  ExpectBentPictureAndBoxes(EquidistantLens());
}

TEST(SyntheticSceneTest, BendsPictureAndBoxesThroughBarrelLens) { ExpectBentPictureAndBoxes(BarrelLens()); }

TEST(SyntheticSceneTest, RejectsLensTooWideToDraw) {
  SceneDescription scene = SmallScene();
  scene.camera = EquidistantLens();
  scene.camera.fx = scene.camera.fy = 1000.0;
  scene.camera.width = scene.camera.height = 4000;
  EXPECT_THROW(SceneRenderer(scene, 2, RenderBackend::kAuto), InputError);
}

TEST(SyntheticSceneTest, CountsPartsBeyondImageBorderAsHidden) {
  SceneDescription scene = SmallScene();
  scene.bodies.resize(2);
  const SceneBody& ball = scene.bodies[1];
  const Eigen::Vector3d center = ball.superquadric.T_map_object.translation;
  Rigid3d pose = LookAt(center - Eigen::Vector3d(0, 2, 0), center);
  scene.camera.cx = -0.5;  // the optical axis meets the left border: half of the ball is outside
  SceneRenderer renderer(scene, 2, RenderBackend::kAuto);
  const auto boxes = FindExactBoxes(scene, pose, renderer.Render(pose).ids, 2);
  ASSERT_EQ(boxes.size(), 1U);
  EXPECT_EQ(boxes[0].object_id, 2);
  EXPECT_NEAR(boxes[0].visible_fraction, 0.5, 0.02);
}

// Two bodies and a floor, which lies partly behind the camera.
SceneDescription SceneWithFloor() {
  SceneDescription scene = SmallScene();
  scene.panels.push_back(
      {{-3.0, -3.0, -0.3}, {6.0, 0.0, 0.0}, {0.0, 6.0, 0.0}, 0.2, scene.bodies[0].texture});
  return scene;
}

TEST(SeenSurfaceTest, LiesOnBodiesAndPanelsAndFacesTheCamera) {
  const SceneDescription scene = SceneWithFloor();
  const std::vector<Rigid3d> poses = HandHeldMotion(scene, 20, 1);
  const std::vector<TruePoint> points = SeenSurface(scene, poses);
  std::array<int, 4> counts{};  // by body; the last: of the floor
  for (const TruePoint& point : points) {
    std::size_t on = 3;
    double distance = std::abs(point.position.z() + 0.3);
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
    for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
      const auto& [shape, T_world_object] = scene.bodies[i].superquadric;
      const auto radial = shape.RadialDistanceWithGradient(T_world_object.Inverse() * point.position);
      if (std::abs(radial.value) < distance) {
        on = i;
        distance = std::abs(radial.value);
        normal = (T_world_object.rotation * radial.by_point).normalized();
      }
    }
    ++counts[on];
    EXPECT_LT(distance, 1e-3);
    EXPECT_GT(normal.dot(point.normal), 0.99);
    const bool faces_camera = std::ranges::any_of(std::array{poses[0], poses[12]}, [&](const Rigid3d& pose) {
      return point.normal.dot(pose.translation - point.position) > 0.0;
    });
    EXPECT_TRUE(faces_camera);
  }
  EXPECT_GT(counts[0], 50);
  EXPECT_GT(counts[1], 50);
  EXPECT_EQ(counts[2], 0) << "hidden behind the first";
  EXPECT_GT(counts[3], 50);
}

TEST(SeenSurfaceTest, KeepsOnlySeenPointsInDistinctCubes) {
  const SceneDescription scene = SceneWithFloor();
  const std::vector<Rigid3d> poses = HandHeldMotion(scene, 20, 1);
  std::set<std::array<int, 3>> cubes;
  for (const TruePoint& point : SeenSurface(scene, poses)) {
    const bool is_seen = std::ranges::any_of(std::array{poses[0], poses[12]}, [&](const Rigid3d& pose) {
      const Eigen::Vector3d p_camera = pose.Inverse() * point.position;
      const Eigen::Vector2d pixel = scene.camera.Project(p_camera);
      const auto first = CastRay(scene, pose.translation, point.position - pose.translation);
      return p_camera.z() > 0.0 && pixel.x() > -0.5 && pixel.y() > -0.5 && pixel.x() < 159.5 &&
             pixel.y() < 119.5 && first && (first->position - point.position).norm() < 1e-4;
    });
    EXPECT_TRUE(is_seen) << point.position.transpose();
    const Eigen::Array3i cube = (point.position.array() / 0.007).floor().cast<int>();
    EXPECT_TRUE(cubes.insert({cube.x(), cube.y(), cube.z()}).second);
  }
}

TEST(HandHeldMotionTest, StartsAndEndsAtWaypointsAndMovesSmoothly) {
  SceneDescription scene = SmallScene();
  scene.tremor_position = 0.0;
  scene.tremor_angle = 0.0;
  const auto poses = HandHeldMotion(scene, 50, 1);
  EXPECT_LT((poses.front().translation - scene.waypoints.front().position).norm(), 1e-9);
  EXPECT_LT((poses.back().translation - scene.waypoints.back().position).norm(), 1e-9);
  for (std::size_t i = 1; i < poses.size(); ++i) {
    EXPECT_LT((poses[i].translation - poses[i - 1].translation).norm(), 0.01);
  }
}

class SyntheticSequenceTest : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("sqslam_synth_test_" + std::to_string(getpid()));
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  fs::path folder_;
};

TEST_F(SyntheticSequenceTest, GivesSameBytesForSameSeed) {
  const SceneDescription scene = SmallScene();
  WriteSyntheticSequence(scene, folder_ / "a", {.seed = 5});
  WriteSyntheticSequence(scene, folder_ / "b", {.seed = 5});
  WriteSyntheticSequence(scene, folder_ / "c", {.seed = 6});
  int files = 0;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder_ / "a")) {
    if (entry.is_regular_file()) {
      ++files;
      const fs::path name = fs::relative(entry.path(), folder_ / "a");
      EXPECT_EQ(FileText(entry.path()), FileText(folder_ / "b" / name)) << name;
    }
  }
  EXPECT_EQ(files, 10);  // three pictures, six texts and the surface
  EXPECT_NE(FileText(folder_ / "a/groundtruth.txt"), FileText(folder_ / "c/groundtruth.txt"));
}

TEST_F(SyntheticSequenceTest, WritesFilesThatReadersExpect) {
  const SynthesisSummary summary = WriteSyntheticSequence(SmallScene(), folder_ / "a", {.frames = 2});
  EXPECT_EQ(summary.frames, 2);
  EXPECT_EQ(summary.objects, 2);
  EXPECT_EQ(cv::imread((folder_ / "a/rgb/000001.jpg").string()).size(), cv::Size(160, 120));
  EXPECT_NE(FileText(folder_ / "a/boxes.txt").find(" sports_ball 1.000 "), std::string::npos);
  EXPECT_NE(FileText(folder_ / "a/objects_gt.json").find("\"primitive\":\"cuboid\""), std::string::npos);
  EXPECT_NE(FileText(folder_ / "a/camera.yaml").find("cx: 71"), std::string::npos);
}

TEST_F(SyntheticSequenceTest, WritesSurfaceSeenByFrames) {
  const SceneDescription scene = SceneWithFloor();
  WriteSyntheticSequence(scene, folder_ / "a", {.seed = 5});
  const PointCloud cloud = ReadPointCloud(folder_ / "a/dense.ply");
  const std::vector<TruePoint> points = SeenSurface(scene, HandHeldMotion(scene, 3, 5));
  ASSERT_EQ(cloud.points.size(), points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    EXPECT_LT((cloud.points[i] - points[i].position).norm(), 1e-5);
  }
}

TEST_F(SyntheticSequenceTest, NeverOverwritesFolder) {
  fs::create_directories(folder_ / "a");
  std::ofstream(folder_ / "a/mine.txt") << "keep";
  EXPECT_THROW(WriteSyntheticSequence(SmallScene(), folder_ / "a", {}), InputError);
  EXPECT_EQ(FileText(folder_ / "a/mine.txt"), "keep");
}

TEST(ReadSceneTest, ReadsBundledDesk) {
  const SceneDescription scene = ReadScene(fs::path(SQSLAM_SOURCE_DIR) / "assets/scenes/desk.yaml");
  EXPECT_EQ(scene.camera.width, 640);
  EXPECT_GE(std::count_if(scene.bodies.begin(), scene.bodies.end(), [](const auto& b) { return b.id > 0; }),
            10);
}

TEST_F(SyntheticSequenceTest, WritesLensOfScene) {
  fs::create_directories(folder_);
  std::ofstream(folder_ / "scene.yaml")
      << "camera: {width: 160, height: 120, fx: 107, distortion_model: fisheye, "
         "distortion: [0.1, 0, 0, 0]}\nmotion: {waypoints: [{position: [0, -2, "
         "0], look_at: [0, 0, 0]}, {position: [0.1, -2, 0], look_at: [0, 0, 0]}]}\n";
  WriteSyntheticSequence(ReadScene(folder_ / "scene.yaml"), folder_ / "a", {.frames = 1});
  const Camera camera = ReadCamera(folder_ / "a/camera.yaml");
  EXPECT_EQ(camera.lens, LensModel::kFisheye);
  EXPECT_EQ(camera.distortion[0], 0.1);
  const std::string motion =
      FileText(folder_ / "scene.yaml").substr(FileText(folder_ / "scene.yaml").find("motion"));
  std::ofstream(folder_ / "barrel.yaml") << "camera: {distortion: [-0.1, 0.01, 0, 0]}\n" << motion;
  const Camera barrel = ReadScene(folder_ / "barrel.yaml").camera;
  EXPECT_EQ(barrel.lens, LensModel::kRadialTangential);
  EXPECT_EQ(barrel.distortion[0], -0.1);
  std::ofstream(folder_ / "other.yaml") << "camera: {distortion_model: kalibr}\nmotion: {}\n";
  EXPECT_THROW(ReadScene(folder_ / "other.yaml"), InputError);
}

TEST(ReadSceneTest, NamesUnreadableFile) {
  try {
    ReadScene("/nowhere/scene.yaml");
    FAIL() << "no error";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("/nowhere/scene.yaml"), std::string::npos);
  }
}

TEST_F(SyntheticSequenceTest, RejectsInvalidNumbersByName) {
  const std::string desk = FileText(std::string(SQSLAM_SOURCE_DIR) + "/assets/scenes/desk.yaml");
  fs::create_directories(folder_);
  const auto error_with = [&](const std::string& after, char until, const std::string& number) {
    std::string scene = desk;
    const std::size_t at = scene.find(after) + after.size();
    scene.replace(at, scene.find(until, at) - at, number);
    std::ofstream(folder_ / "scene.yaml") << scene;
    try {
      ReadScene(folder_ / "scene.yaml");
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string("none");
  };
  EXPECT_THAT(error_with("colors: [[", ',', "832"),
              HasSubstr("'colors': expected red, green and blue from 0 to 255"));
  EXPECT_THAT(error_with("colors: [[", ']', "1, 2, .nan"), HasSubstr("'colors': expected finite numbers"));
  EXPECT_THAT(error_with("half_size: [", ']', "1, .inf, 1"),
              HasSubstr("'half_size': expected finite numbers"));
  EXPECT_THAT(error_with("shape: [", ',', ".nan"), HasSubstr("'shape': expected finite numbers"));
  EXPECT_THAT(error_with("shape: [", ',', "2.5"), HasSubstr("'shape': expected exponents from 0 to 2"));
  EXPECT_THAT(error_with("yaw: ", '\n', ".nan,"), HasSubstr("'yaw': expected a finite number"));
  EXPECT_THAT(error_with("fx: ", ',', ".inf"), HasSubstr("'fx': expected a finite number"));
  EXPECT_THAT(error_with("fx: ", ',', "wide"), HasSubstr("scene.yaml:"));  // with its line
  EXPECT_THAT(error_with("width: ", ',', "wide"), HasSubstr("scene.yaml:"));
}

}  // namespace
}  // namespace sqslam
