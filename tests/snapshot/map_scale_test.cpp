#include "slam/snapshot/map_scale.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "slam/snapshot/depth_recording.h"
#include "slam/snapshot/recording.h"
#include "slam/util/error.h"
#include "tests/io/temporary_folder.h"
#include "tests/render/hand_made_map.h"

namespace sqslam {
namespace {

using ::testing::HasSubstr;

const MapScale kScale{2.5, 0.05, "height of 1 cup, 0.1 m"};

class MapScaleTest : public ::testing::Test {
 protected:
  MapScaleTest() {
    map_ = HandMadeMap();
    map_.T_map_camera = map_.keyframes.front().T_map_camera;
    map_.support_height = 0.75;
    for (SnapshotObject& object : map_.objects) {
      object.fit.point_rms = 0.01;
      object.fit.covariance.setIdentity();
    }
    RecordingWriter(path_, {"sequence", "test", "config"}).Add(map_);
  }
  MapSnapshotPtr Read() const { return RecordingReader(path_).Last(); }

  TemporaryFolder folder_;
  const std::filesystem::path path_ = folder_.Path() / "map.sqmap";
  MapSnapshot map_;
};

void ExpectLengths(const MapSnapshot& read, const MapSnapshot& map, double factor) {
  EXPECT_LT((read.keyframes[3].T_map_camera.translation - factor * map.keyframes[3].T_map_camera.translation)
                .norm(),
            1e-12);
  EXPECT_LT((read.T_map_camera->translation - factor * map.T_map_camera->translation).norm(), 1e-12);
  EXPECT_TRUE(read.points[77].p_map.isApprox(static_cast<float>(factor) * map.points[77].p_map, 2e-5F));
  const SnapshotObject& object = read.objects[1];
  EXPECT_NEAR(object.superquadric.shape.half_size.z(), factor * 0.2, 1e-12);
  EXPECT_NEAR(object.superquadric.T_map_object.translation.x(), factor * 0.3, 1e-12);
  EXPECT_NEAR(object.fit.point_rms, factor * 0.01, 1e-12);
  EXPECT_NEAR(object.fit.covariance(5, 5), factor * factor, 1e-12);
  EXPECT_NEAR(object.fit.covariance(6, 6), 1.0, 1e-12) << "an angle has no length";
  EXPECT_NEAR(*read.support_height, factor * 0.75, 1e-12);
}

TEST_F(MapScaleTest, WhatIsReadIsInMetresAndInUnitsAgainOnceItIsTakenAway) {
  EXPECT_FALSE(Read()->metric);
  KeepMapScale(path_, MapScale{7.0, 0.1, "something else"});
  KeepMapScale(path_, kScale);
  EXPECT_EQ(ReadMapScale(path_), kScale);
  EXPECT_EQ(RecordingReader(path_).Info().scale, kScale);
  EXPECT_TRUE(Read()->metric);
  ExpectLengths(*Read(), map_, 2.5);
  KeepMapScale(path_, std::nullopt);
  EXPECT_FALSE(Read()->metric);
  ExpectLengths(*Read(), map_, 1.0);
}

TEST_F(MapScaleTest, StatesInMetresAreWrittenInUnits) {
  KeepMapScale(path_, kScale);
  AppendToRecording(path_, *Read());
  EXPECT_EQ(RecordingReader(path_).Size(), 2);
  ExpectLengths(*Read(), map_, 2.5);
  const std::filesystem::path copy = folder_.Path() / "copy.sqmap";
  RecordingWriter(copy, RecordingReader(path_).Info()).Add(*Read());
  ExpectLengths(*RecordingReader(copy).Last(), map_, 2.5);
}

TEST_F(MapScaleTest, DepthMapsFollow) {
  DepthMap depth;
  depth.keyframe = 3;
  depth.camera = {8, 6, 10.0, 10.0, 4.0, 3.0};
  depth.T_map_camera.translation = {1.0, 2.0, 3.0};
  depth.depth = cv::Mat(6, 8, CV_32F, cv::Scalar(4.0));
  depth.views = cv::Mat(6, 8, CV_8U, cv::Scalar(2));
  depth.bgr = cv::Mat(6, 8, CV_8UC3, cv::Scalar(1, 2, 3));
  const auto put = [&] {
    DepthRecording recording(path_, DepthRecording::Access::kWrite);
    recording.PutEstimate(depth, "settings");
    recording.PutKept(depth);
  };
  const auto expect = [&](double factor) {
    const DepthMap kept = DepthRecording(path_).Kept(3);
    EXPECT_NEAR(kept.depth.at<float>(2, 2), 4.0 * factor, 1e-3);
    EXPECT_NEAR(kept.T_map_camera.translation.y(), 2.0 * factor, 1e-9);
  };
  put();
  KeepMapScale(path_, kScale);
  expect(2.5);
  put();  // in metres now
  expect(1.0);
  KeepMapScale(path_, std::nullopt);
  expect(0.4);
}

TEST_F(MapScaleTest, BrokenScalesAreRefused) {
  for (const double metres : {0.0, -1.0}) {
    KeepMapScale(path_, MapScale{metres, 0.1, "x"});
    try {
      RecordingReader reader(path_);
      FAIL() << metres;
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), HasSubstr("map.sqmap: its scale is broken"));
    }
  }
}

}  // namespace
}  // namespace sqslam
