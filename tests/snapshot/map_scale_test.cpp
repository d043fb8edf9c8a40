#include "slam/snapshot/map_scale.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "slam/snapshot/depth_recording.h"
#include "slam/snapshot/recording.h"
#include "slam/snapshot/sqlite_file.h"
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
  void Put(const std::string& key, const std::string& value) const {
    const sqlite::Database db = sqlite::Open(path_, SQLITE_OPEN_READWRITE);
    sqlite::Statement(db.get(), path_, "INSERT OR REPLACE INTO meta (key, value) VALUES (?, ?)", key, value)
        .Run();
  }

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

TEST_F(MapScaleTest, ReadsMetresUntilScaleIsRemoved) {
  EXPECT_FALSE(Read()->metric);
  StoreMapScale(path_, MapScale{7.0, 0.1, "something else"});
  StoreMapScale(path_, kScale);
  EXPECT_EQ(ReadMapScale(path_), kScale);
  EXPECT_EQ(RecordingReader(path_).Info().scale, kScale);
  EXPECT_TRUE(Read()->metric);
  ExpectLengths(*Read(), map_, 2.5);
  StoreMapScale(path_, std::nullopt);
  EXPECT_FALSE(Read()->metric);
  ExpectLengths(*Read(), map_, 1.0);
}

TEST_F(MapScaleTest, WritesStatesInMetresAsUnits) {
  StoreMapScale(path_, kScale);
  AppendToRecording(path_, *Read());
  EXPECT_EQ(RecordingReader(path_).Size(), 2);
  ExpectLengths(*Read(), map_, 2.5);
  const std::filesystem::path copy = folder_.Path() / "copy.sqmap";
  RecordingWriter(copy, RecordingReader(path_).Info()).Add(*Read());
  ExpectLengths(*RecordingReader(copy).Last(), map_, 2.5);
}

TEST_F(MapScaleTest, ScalesDepthMaps) {
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
  StoreMapScale(path_, kScale);
  expect(2.5);
  put();  // in metres now
  expect(1.0);
  StoreMapScale(path_, std::nullopt);
  expect(0.4);
}

TEST_F(MapScaleTest, RefusesImpossibleScales) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  StoreMapScale(path_, kScale);
  for (const MapScale& scale :
       {MapScale{0.0, 0.1, "x"}, MapScale{-1.0, 0.1, "x"}, MapScale{kInfinity, 0.1, "x"},
        MapScale{1e300, 0.1, "x"}, MapScale{2.0, kInfinity, "x"}, MapScale{std::nan(""), 0.1, "x"}}) {
    EXPECT_THAT(InputErrorOf([&] { StoreMapScale(path_, scale); }),
                HasSubstr("map.sqmap: a map unit would be "));
    EXPECT_EQ(ReadMapScale(path_), kScale);
  }
}

TEST_F(MapScaleTest, RemovesBrokenScales) {
  for (const std::string metres : {"0", "-1", "null", "1e300"}) {
    Put("map_scale", R"({"metres": )" + metres + R"(, "deviation": 0.1, "source": "x"})");
    EXPECT_THAT(InputErrorOf([&] { RecordingReader reader(path_); }),
                HasSubstr("map.sqmap: its scale is broken"));
    StoreMapScale(path_, std::nullopt);
    ExpectLengths(*Read(), map_, 1.0);
  }
}

TEST(UnitComment, GivesBackItsScale) {
  EXPECT_EQ(MetresPerUnitIn("# a file; metres, " + UnitComment(2.0 / 3.0) + "\n1 2 3\n"), 2.0 / 3.0);
  EXPECT_EQ(UnitComment(1.0), "");
  EXPECT_EQ(MetresPerUnitIn("# a file\n1 2 3\n"), 1.0);
  EXPECT_EQ(MetresPerUnitIn("# 1 map unit = 0 m\n"), 1.0) << "no length";
  EXPECT_EQ(MetresPerUnitIn("# 1 map unit = "), 1.0) << "cut off";
}

}  // namespace
}  // namespace sqslam
