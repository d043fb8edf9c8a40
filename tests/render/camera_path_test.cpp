#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "hand_made_map.h"
#include "render/camera/scene_framing.h"
#include "render/video/video.h"
#include "slam/util/error.h"
#include "tests/io/temporary_folder.h"

namespace sqslam {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

class CameraPathFileTest : public testing::Test {
 protected:
  CameraPathFile Read(const std::string& yaml) {
    return ReadCameraPath(folder_.Write("path.yaml", yaml), 10.0);
  }

  std::vector<ViewCamera> Views(const std::string& yaml, int frames) {
    return ViewsAlong(Read(yaml), HandMadeMap(), {}, NoFrames, frames, 10.0);
  }

  std::string ErrorOf(const std::string& yaml) {
    try {
      Views(yaml, 10);
    } catch (const UsageError& error) {
      return error.what();
    }
    return "(no UsageError)";
  }

  static Rigid3d NoFrames(std::int64_t frame) {
    throw UsageError("frame " + std::to_string(frame) + ": unknown");
  }

  TemporaryFolder folder_;
};

constexpr const char* kThree = R"(
keys:
  - {time: 0, position: [0, -4, 1], focal_point: [0, 0, 0]}
  - {time: 1, position: [3, -3, 2], focal_point: [0, 0.5, 0], view_angle: 40}
  - {frame: 30, position: [4, 0, 1], focal_point: [0, 0, 0]}
)";

TEST_F(CameraPathFileTest, ReachesKeysAtTheirTimes) {
  const auto views = Views(kThree, 31);
  ASSERT_EQ(views.size(), 31u);
  EXPECT_LT((views[0].position - Eigen::Vector3d(0, -4, 1)).norm(), 1e-9);
  EXPECT_LT((views[10].position - Eigen::Vector3d(3, -3, 2)).norm(), 1e-9);
  EXPECT_LT((views[10].focal_point - Eigen::Vector3d(0, 0.5, 0)).norm(), 1e-9);
  EXPECT_NEAR(views[10].view_angle, 40.0, 1e-9);
  EXPECT_LT((views[30].position - Eigen::Vector3d(4, 0, 1)).norm(), 1e-9);
  EXPECT_NEAR(*Read(kThree).Length(), 3.0, 1e-12);
}

TEST_F(CameraPathFileTest, MovesSmoothlyAndRestsAtEnds) {
  const auto views = Views(kThree, 31);
  const auto step = [&](std::size_t i) { return (views[i + 1].position - views[i].position).eval(); };
  for (std::size_t i = 0; i + 2 < views.size(); ++i) {
    EXPECT_LT((step(i + 1) - step(i)).norm(), 0.2) << i;  // the mean step is 0.2
  }
  EXPECT_LT(step(0).norm(), 0.3 * step(5).norm());
  EXPECT_LT(step(29).norm(), 0.3 * step(20).norm());
  const auto even = Views(std::string("easing: linear") + kThree, 31);
  EXPECT_GT((even[1].position - even[0].position).norm(), 0.25);  // in full motion from the start
}

TEST_F(CameraPathFileTest, LoopContinuesFromLastKeyToFirst) {
  const std::string yaml = R"(
loop: true
duration: 4
keys:
  - {time: 0, position: [0, -4, 1], focal_point: [0, 0, 0]}
  - {time: 1, position: [4, 0, 1], focal_point: [0, 0, 0]}
  - {time: 2, position: [0, 4, 1], focal_point: [0, 0, 0]}
  - {time: 3, position: [-4, 0, 1], focal_point: [0, 0, 0]}
)";
  const auto views = Views(yaml, 81);  // twice around
  for (std::size_t i = 0; i + 40 < views.size(); ++i) {
    EXPECT_LT((views[i].position - views[i + 40].position).norm(), 1e-9);
    EXPECT_NEAR(views[i].position.head<2>().norm(), 4.0, 0.5);  // nearly a circle
  }
  EXPECT_NEAR((views[1].position - views[0].position).norm(),
              (views[40].position - views[39].position).norm(), 1e-3);
}

TEST_F(CameraPathFileTest, ClosesLateStartingLoopAtItsUsualSpeed) {
  const CameraPathFile file = Read(R"(
loop: true
keys:
  - {time: 2, position: [0, -4, 1], focal_point: [0, 0, 0]}
  - {time: 3, position: [4, 0, 1], focal_point: [0, 0, 0]}
  - {time: 4, position: [0, 4, 1], focal_point: [0, 0, 0]}
  - {time: 5, position: [-4, 0, 1], focal_point: [0, 0, 0]}
)");
  EXPECT_NEAR(*file.Length(), 4.0, 1e-12);
}

TEST_F(CameraPathFileTest, MovesAroundFocalPoint) {
  for (const std::string far : {"[0, 4, 0]", "[-4, 0.1, 0]", "[3, 2.7, 0]"}) {  // across, and beside that
    const auto views = Views(
        "keys:\n  - {time: 0, position: [0, -4, 0], focal_point: [0, 0, 0]}\n  - {time: 2, position: " + far +
            ", focal_point: [0, 0, 0]}\n",
        21);
    for (const ViewCamera& view : views) {
      EXPECT_NEAR(view.position.norm(), 4.0, 0.1) << far;
      EXPECT_NEAR(view.position.z(), 0.0, 1e-6) << far;
    }
  }
}

TEST_F(CameraPathFileTest, SpreadsKeysWithoutTimesOverVideo) {
  const auto views = Views("keys:\n  - {view: front}\n  - {keyframe: 2}\n  - {view: top, zoom: 2}\n", 21);
  const Rigid3d pose = HandMadeMap().keyframes[2].T_map_camera;
  EXPECT_LT((views[10].position - pose.translation).norm(), 1e-9);
  EXPECT_GT(
      (views[10].focal_point - views[10].position).normalized().dot(pose.rotation * Eigen::Vector3d::UnitZ()),
      1.0 - 1e-9);
  EXPECT_GT(views[20].position.z(), 1.0);
}

TEST_F(CameraPathFileTest, NamesFileLineAndKeyInErrors) {
  EXPECT_THAT(ErrorOf("keys:\n  - {time: 0, view: frnt}\n"),
              AllOf(HasSubstr("path.yaml:2"), HasSubstr("view is 'frnt'")));
  EXPECT_THAT(ErrorOf("easing: bouncy\nkeys:\n  - {view: front}\n"),
              HasSubstr("path.yaml:1: easing is 'bouncy'"));
  EXPECT_THAT(ErrorOf("keys:\n  - {view: front}\n  - {viw: back}\n"),
              AllOf(HasSubstr(":3"), HasSubstr("unknown option 'viw'; did you mean 'view'?")));
  EXPECT_THAT(ErrorOf("keys:\n  - {position: [1, 2], focal_point: [0, 0, 0]}\n"),
              AllOf(HasSubstr(":2"), HasSubstr("position")));
  EXPECT_THAT(ErrorOf("keys:\n  - {position: [1, 2, 3]}\n"), HasSubstr("position and focal_point"));
  EXPECT_THAT(ErrorOf("keys:\n  - {time: 1, view: front}\n  - {time: 1, view: back}\n"),
              AllOf(HasSubstr(":3"), HasSubstr("time")));
  EXPECT_THAT(ErrorOf("keys:\n  - {time: 1, view: front}\n  - {view: back}\n"),
              AllOf(HasSubstr(":3"), HasSubstr("time")));
  EXPECT_THAT(ErrorOf("keys:\n  - {keyframe: 99}\n"),
              AllOf(HasSubstr(":2"), HasSubstr("keyframe: 99"), HasSubstr("0, 1, 2")));
  EXPECT_THAT(ErrorOf("keys:\n  - {camera_frame: 7}\n"),
              AllOf(HasSubstr(":2"), HasSubstr("camera_frame: frame 7")));
  EXPECT_THAT(ErrorOf("keys: []\n"), HasSubstr("keys"));
  EXPECT_THROW(ReadCameraPath(folder_.Path() / "none.yaml", 30.0), UsageError);
}

TEST_F(CameraPathFileTest, ReadsBundledTour) {
  const auto file = ReadCameraPath(std::string(SQSLAM_SOURCE_DIR) + "/configs/camera_paths/tour.yaml", 30.0);
  EXPECT_NEAR(*file.Length(), 12.0, 1e-12);
  EXPECT_EQ(ViewsAlong(file, HandMadeMap(), {}, NoFrames, 360, 30.0).size(), 360u);
}

// The cameras of the map stand around -y, at an angle of -2.2 + 0.63 on average.
TEST(ViewPresetTest, LooksFromNamedSide) {
  const MapSnapshot map = HandMadeMap();
  const SceneFocus focus = FindFocus(map);
  const auto from = [&](const std::string& name) {
    const ViewCamera view = PresetView(name, focus, 1.5);
    return ((view.position - view.focal_point).normalized()).eval();
  };
  Eigen::Vector3d front = Eigen::Vector3d::Zero();
  for (const SnapshotKeyframe& keyframe : map.keyframes) {
    front += (keyframe.T_map_camera.translation - focus.center).normalized();
  }
  front.z() = 0.0;
  front.normalize();
  const Eigen::Vector3d right = Eigen::Vector3d::UnitZ().cross(front);
  EXPECT_LT((from("front") - front).norm(), 1e-6);
  EXPECT_LT((from("right") - right).norm(), 1e-6);
  EXPECT_LT((from("back") + front).norm(), 1e-6);
  EXPECT_LT((from("left") + right).norm(), 1e-6);
  EXPECT_LT((from("top") - Eigen::Vector3d::UnitZ()).norm(), 1e-6);
  EXPECT_LT(
      (from("isometric") -
       (front + right + std::sqrt(2.0) * std::tan(35.264 / 57.29578) * Eigen::Vector3d::UnitZ()).normalized())
          .norm(),
      1e-4);
  const ViewCamera top = PresetView("top", focus, 1.5);
  EXPECT_LT((top.view_up + front).norm(), 1e-6);
  EXPECT_THROW(PresetView("bottom", focus, 1.5), UsageError);
}

}  // namespace
}  // namespace sqslam
