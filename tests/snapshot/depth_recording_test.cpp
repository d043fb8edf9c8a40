#include "slam/snapshot/depth_recording.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sqlite3.h>

#include <cmath>
#include <limits>

#include "slam/snapshot/recording.h"
#include "tests/io/temporary_folder.h"

namespace sqslam {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

DepthMap MakeMap(std::int64_t keyframe, double nearest) {
  DepthMap map;
  map.keyframe = keyframe;
  map.frame_index = 1000 - 10 * keyframe;  // later keyframes of earlier frames
  map.camera = {40, 30, 33.5, 34.5, 20.25, 15.75, {}, 30.0};
  map.T_map_camera = {Eigen::Quaterniond(0.5, 0.5, -0.5, 0.5), {1.0, 2.0, 3.0}};
  map.depth = cv::Mat(30, 40, CV_32F);
  map.sigma = cv::Mat(30, 40, CV_32F);
  map.views = cv::Mat(30, 40, CV_8U);
  map.bgr = cv::Mat(30, 40, CV_8UC3, cv::Scalar(200, 100, 50));
  for (int i = 0; i < 1200; ++i) {
    map.depth.at<float>(i) = i % 7 == 0 ? 0.0F : static_cast<float>(nearest + 0.01 * i);
    map.sigma.at<float>(i) = 1e-4F * static_cast<float>(1 + i);
    map.views.at<std::uint8_t>(i) = static_cast<std::uint8_t>(i % 7 == 0 ? 0 : i % 9);
  }
  return map;
}

void ExpectNear(const DepthMap& read, const DepthMap& map) {
  EXPECT_EQ(read.keyframe, map.keyframe);
  EXPECT_EQ(read.frame_index, map.frame_index);
  EXPECT_EQ(read.camera.width, 40);
  EXPECT_EQ(read.camera.fy, 34.5);
  EXPECT_EQ(read.T_map_camera.Matrix(), map.T_map_camera.Matrix());
  for (int i = 0; i < 1200; ++i) {
    const float truth = map.depth.at<float>(i);
    ASSERT_NEAR(read.depth.at<float>(i), truth, 2e-4 * truth);
    ASSERT_EQ(read.depth.at<float>(i) == 0.0F, truth == 0.0F);
    if (truth > 0.0F) {
      ASSERT_NEAR(read.sigma.at<float>(i) / map.sigma.at<float>(i), 1.0, 0.1);
    }
  }
  EXPECT_LT(cv::norm(read.bgr, map.bgr, cv::NORM_INF), 4.0);
}

class DepthRecordingTest : public ::testing::Test {
 protected:
  DepthRecordingTest() {
    RecordingWriter writer(path_, {"sequence", "test", "config"});
    writer.Add({});
  }
  TemporaryFolder folder_;
  const std::filesystem::path path_ = folder_.Path() / "map.sqmap";
};

TEST_F(DepthRecordingTest, RestoresMapsInOrderOfFrames) {
  {
    DepthRecording recording(path_, DepthRecording::Access::kWrite);
    for (const std::int64_t keyframe : {4, 7}) {
      recording.PutEstimate(MakeMap(keyframe, 1.0), "settings");
    }
    EXPECT_THAT(recording.Keyframes(), IsEmpty());
    EXPECT_THAT(recording.Estimated(), ElementsAre(7, 4));
    recording.PutKept(MakeMap(4, 0.5));
    EXPECT_THAT(recording.Keyframes(), ElementsAre(4));
    recording.PutKept(MakeMap(7, 0.5));
  }
  const DepthRecording recording(path_);
  EXPECT_THAT(recording.Keyframes(), ElementsAre(7, 4));
  ExpectNear(recording.Estimate(4), MakeMap(4, 1.0));
  const DepthMap kept = recording.Kept(4);
  ExpectNear(kept, MakeMap(4, 0.5));
  EXPECT_EQ(cv::norm(kept.views, MakeMap(4, 0.5).views, cv::NORM_INF), 0.0);
}

TEST_F(DepthRecordingTest, KeepsSettings) {
  DepthRecording recording(path_, DepthRecording::Access::kWrite);
  recording.PutEstimate(MakeMap(4, 1.0), "some");
  recording.PutKept(MakeMap(4, 1.0));
  EXPECT_EQ(recording.Settings(4), "some");
  recording.PutEstimate(MakeMap(4, 1.0), "other");
  EXPECT_EQ(recording.Settings(4), "other");
  EXPECT_THAT(recording.Keyframes(), IsEmpty());  // what was kept was kept of the older one
  recording.Remove(4);
  EXPECT_EQ(recording.Settings(4), "");
}

TEST_F(DepthRecordingTest, TakesFinishedMapsAsShownFromFirstFrameOn) {
  {
    DepthRecording recording(path_, DepthRecording::Access::kWrite);
    recording.PutEstimate(MakeMap(1, 2.0), "a");
    recording.PutKept(MakeMap(1, 3.0));
    recording.PutText("surface", "fine");
  }
  const std::filesystem::path other = folder_.Path() / "other.sqmap";
  RecordingWriter(other, {"sequence", "test", "config"}).Close();
  DepthRecording taken(other, DepthRecording::Access::kWrite);
  taken.TakeFinished(path_);
  DepthMap expected = MakeMap(1, 3.0);
  expected.frame_index = 0;
  ExpectNear(taken.Kept(1), expected);
  EXPECT_EQ(taken.Settings(1), "a");
  EXPECT_EQ(taken.Text("surface"), "fine");
}

TEST_F(DepthRecordingTest, KeepsSnapshots) {
  DepthRecording(path_, DepthRecording::Access::kWrite).PutEstimate(MakeMap(4, 1.0), "some");
  EXPECT_EQ(RecordingReader(path_).Size(), 1);
  EXPECT_EQ(RecordingReader(path_).Info().config, "config");
}

TEST_F(DepthRecordingTest, ReportsRecordingWithoutDepth) {
  const DepthRecording recording(path_);
  EXPECT_THAT(recording.Keyframes(), IsEmpty());
  EXPECT_EQ(recording.Settings(4), "");
  EXPECT_THAT(InputErrorOf([&] { recording.Kept(4); }), HasSubstr("map.sqmap: "));
}

TEST_F(DepthRecordingTest, RefusesBrokenDepthMaps) {
  DepthRecording(path_, DepthRecording::Access::kWrite).PutEstimate(MakeMap(4, 1.0), "some");
  sqlite3* db = nullptr;
  ASSERT_EQ(sqlite3_open(path_.c_str(), &db), SQLITE_OK);
  sqlite3_exec(db, "UPDATE depth_maps SET estimate = substr(estimate, 1, 40)", nullptr, nullptr, nullptr);
  sqlite3_close(db);
  EXPECT_THAT(InputErrorOf([&] { DepthRecording(path_).Estimate(4); }), HasSubstr("depth map of keyframe 4"));
}

TEST_F(DepthRecordingTest, RefusesDepthsThatAreNotFinite) {
  DepthMap map = MakeMap(4, 1.0);
  map.depth.setTo(std::numeric_limits<double>::infinity());  // written as a range from 0 to 0
  DepthRecording(path_, DepthRecording::Access::kWrite).PutEstimate(map, "some");
  EXPECT_THAT(InputErrorOf([&] { DepthRecording(path_).Estimate(4); }),
              HasSubstr("the depth map of keyframe 4 is broken"));
}

}  // namespace
}  // namespace sqslam
