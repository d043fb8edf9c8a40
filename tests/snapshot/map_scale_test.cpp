#include "slam/snapshot/map_scale.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <csignal>
#include <fstream>
#include <limits>
#include <thread>

#include "slam/snapshot/depth_recording.h"
#include "slam/snapshot/recording.h"
#include "slam/snapshot/sqlite_file.h"
#include "slam/util/error.h"
#include "slam/util/text_lines.h"
#include "slam/util/throw_if.h"
#include "tests/io/temporary_folder.h"
#include "tests/render/hand_made_map.h"

namespace sqslam {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

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

TEST_F(MapScaleTest, ImpossibleScalesAreNotKept) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  KeepMapScale(path_, kScale);
  for (const MapScale& scale :
       {MapScale{0.0, 0.1, "x"}, MapScale{-1.0, 0.1, "x"}, MapScale{kInfinity, 0.1, "x"},
        MapScale{1e300, 0.1, "x"}, MapScale{2.0, kInfinity, "x"}, MapScale{std::nan(""), 0.1, "x"}}) {
    EXPECT_THAT(InputErrorOf([&] { KeepMapScale(path_, scale); }),
                HasSubstr("map.sqmap: a map unit would be "));
    EXPECT_EQ(ReadMapScale(path_), kScale);
  }
}

TEST_F(MapScaleTest, BrokenScalesAreRefusedAndCanBeRemoved) {
  for (const std::string metres : {"0", "-1", "null", "1e300"}) {
    Put("map_scale", R"({"metres": )" + metres + R"(, "deviation": 0.1, "source": "x"})");
    EXPECT_THAT(InputErrorOf([&] { RecordingReader reader(path_); }),
                HasSubstr("map.sqmap: its scale is broken"));
    EXPECT_FALSE(RecordingReader(path_, {}, RecordingReader::Lengths::kInUnits).Last()->metric);
    KeepMapScale(path_, std::nullopt);
    ExpectLengths(*Read(), map_, 1.0);
  }
}

void Rescale(const std::filesystem::path& file, const std::filesystem::path& rescaled,
             const std::optional<double>& factor) {
  std::ofstream(rescaled) << std::stod(ReadFile(file, "")) * factor.value();
}

// A recording with two files beside it, each of which holds one length.
class RescaledFiles : public MapScaleTest {
 protected:
  void WriteLengths(const std::string& length) const {
    folder_.Write("trajectory.txt", length);
    folder_.Write("dense.ply", length);
  }
  double LengthIn(const std::string& name) const { return std::stod(ReadFile(folder_.Path() / name, "")); }
  void ExpectFiles(double length, const std::string& what) const {
    EXPECT_NEAR(LengthIn("trajectory.txt"), length, 1e-9) << what;
    EXPECT_NEAR(LengthIn("dense.ply"), length, 1e-9) << what;
    for (const auto& entry : std::filesystem::directory_iterator(folder_.Path())) {
      EXPECT_THAT(entry.path().string(), Not(HasSubstr("rescaled"))) << what;
    }
  }
  // The state that a program leaves if it is killed when it has stored kScale and renamed `renamed` files.
  void KillBeforeRenaming(int renamed) const {
    KeepMapScale(path_, kScale);
    Put("rescaled", "");
    WriteLengths("1");
    for (const std::string name : {"trajectory.txt", "dense.ply"}) {
      folder_.Write(renamed-- > 0 ? name : name + ".rescaled", "2.5");
    }
  }
};

TEST_F(RescaledFiles, ChangeTogetherWithTheScale) {
  WriteLengths("1");
  KeepMapScale(path_, kScale, Rescale);
  ExpectFiles(2.5, "a first scale");
  KeepMapScale(path_, MapScale{5.0, 0.1, "x"}, Rescale);
  ExpectFiles(5.0, "another one");
  KeepMapScale(path_, std::nullopt, Rescale);
  ExpectFiles(1.0, "none");
}

TEST_F(RescaledFiles, AllStayIfOneFails) {
  WriteLengths("1");
  const auto fail_at_second = [](const auto& file, const auto& rescaled, const auto& factor) {
    ThrowIf<InputError>(file.filename() == "dense.ply", "dense.ply is broken");
    Rescale(file, rescaled, factor);
  };
  EXPECT_EQ(InputErrorOf([&] { KeepMapScale(path_, kScale, fail_at_second); }), "dense.ply is broken");
  EXPECT_FALSE(ReadMapScale(path_));
  ExpectFiles(1.0, "a failure");
  KeepMapScale(path_, kScale, Rescale);
  ExpectFiles(2.5, "the repeat");
}

TEST_F(RescaledFiles, AllStayIfTheProgramIsKilledBeforeItStoresTheScale) {
  WriteLengths("1");
  const pid_t child = ::fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    KeepMapScale(path_, kScale, [](const auto& file, const auto& rescaled, const auto& factor) {
      Rescale(file, rescaled, factor);
      if (file.filename() == "dense.ply") {
        ::kill(::getpid(), SIGKILL);
      }
    });
    ::_exit(1);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  ASSERT_TRUE(WIFSIGNALED(status));
  ASSERT_TRUE(std::filesystem::exists(folder_.Path() / "dense.ply.rescaled"));
  EXPECT_FALSE(RecordingReader(path_).Info().scale);
  EXPECT_EQ(LengthIn("trajectory.txt"), 1.0);
  EXPECT_EQ(LengthIn("dense.ply"), 1.0);
  std::filesystem::remove(folder_.Path() / "dense.ply");
  KeepMapScale(path_, MapScale{5.0, 0.1, "x"}, Rescale);
  EXPECT_NEAR(LengthIn("trajectory.txt"), 5.0, 1e-9);
  EXPECT_FALSE(std::filesystem::exists(folder_.Path() / "dense.ply")) << "a leftover took its place";
}

TEST_F(RescaledFiles, OfAKilledProgramAreCompletedByReaders) {
  for (const int renamed : {0, 1, 2}) {
    KillBeforeRenaming(renamed);
    EXPECT_EQ(RecordingReader(path_).Info().scale, kScale);
    ExpectFiles(2.5, std::to_string(renamed));
    KillBeforeRenaming(renamed);
    FinishRescaling(path_);
    ExpectFiles(2.5, std::to_string(renamed));
  }
  FinishRescaling(folder_.Path() / "none.sqmap");
}

TEST_F(RescaledFiles, OfAKilledProgramAreCompletedBeforeTheNextScale) {
  for (const int renamed : {0, 1, 2}) {
    for (const std::optional<MapScale>& next :
         {std::optional(kScale), std::optional(MapScale{5.0, 0.1, "x"}), std::optional<MapScale>()}) {
      KillBeforeRenaming(renamed);
      KeepMapScale(path_, next, Rescale);
      ExpectFiles(next ? next->metres : 1.0, std::to_string(renamed));
      EXPECT_EQ(ReadMapScale(path_), next);
    }
  }
}

TEST_F(RescaledFiles, AreChangedByOneProgramAfterTheOther) {
  WriteLengths("1");
  std::thread other;
  KeepMapScale(path_, kScale, [&](const auto& file, const auto& rescaled, const auto& factor) {
    if (!other.joinable()) {
      other = std::thread([&] { KeepMapScale(path_, MapScale{5.0, 0.1, "x"}, Rescale); });
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
    Rescale(file, rescaled, factor);
  });
  other.join();
  ExpectFiles(5.0, "the second");
  EXPECT_EQ(ReadMapScale(path_)->metres, 5.0);
}

}  // namespace
}  // namespace sqslam
