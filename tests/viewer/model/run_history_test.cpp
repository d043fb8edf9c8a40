#include "app/viewer/model/run_history.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>

#include "slam/snapshot/object_edits.h"
#include "slam/snapshot/recording.h"
#include "tests/io/temporary_folder.h"
#include "tests/render/hand_made_map.h"

namespace sqslam::viewer {
namespace {

using ::testing::ElementsAre;
using ::testing::Optional;

// A desk that grows: in each of six snapshots a keyframe more, the cup from the third on.
class RecordingPass : public testing::Test {
 protected:
  void SetUp() override {
    RecordingWriter writer(path_, {});
    for (int i = 0; i < 6; ++i) {
      MapSnapshot map = HandMadeMap();
      map.frame_index = 10 * i + 5;
      map.timestamp = 0.5 * i;
      map.keyframes.resize(static_cast<std::size_t>(i + 2));
      for (SnapshotObject& object : map.objects) {
        object.observations = 7 * (i + 1);
        object.points = 3;
        object.yaw = 1.5 + 0.05 * i;
      }
      map.objects[1].superquadric.shape.e1 = 0.2 + 0.1 * i;
      // Half turns, as an estimate may jump: the solid stays the same.
      map.objects[0].yaw = (i % 2 == 0 ? 0.0 : -std::numbers::pi) + 0.1 * i;
      if (i < 2) {
        map.objects.erase(map.objects.begin() + 1);
      }
      map.detections = {{{"book", 0.5, {}}, 0}, {{"book", 0.5, {}}, -1}};
      map.progress = SnapshotProgress{100 + i, i == 5 ? 0.0 : 8.0 + i, 60.0, {.loops = i >= 3 ? 1 : 0}};
      if (i == 4) {
        map.T_map_camera.reset();
        map.progress->tracked_points = 0;
      }
      writer.Add(map);
    }
  }
  TemporaryFolder folder_;
  std::filesystem::path path_ = folder_.Path() / "map.sqmap";
};

ObjectHistories Histories(const RecordingReader& recording) {
  ObjectHistories histories;
  for (int i = 0; i < recording.Size(); ++i) {
    AddSamples(i, *recording.Read(i), histories);
  }
  return histories;
}

RunSeries SeriesOf(const RecordingReader& recording) {
  RunSeries series;
  for (int i = 0; i < recording.Size(); ++i) {
    series.Add(*recording.Read(i));
  }
  return series;
}

TEST_F(RecordingPass, StartsHistoryWithFirstObservation) {
  const RecordingReader reader(path_);
  const ObjectHistories histories = Histories(reader);
  ASSERT_EQ(histories.size(), 3u);
  EXPECT_EQ(histories.at(0).size(), 6u);
  const std::vector<ObjectSample>& cup = histories.at(1);
  ASSERT_EQ(cup.size(), 4u);
  EXPECT_EQ(cup[0].snapshot, 2);
  EXPECT_EQ(cup[0].frame_index, 25);
  EXPECT_EQ(cup[0].observations, 21);
  EXPECT_NEAR(cup[3].e1, 0.7, 1e-12);
  EXPECT_EQ(cup[3].half_size, Eigen::Vector3d(0.12, 0.12, 0.2));
}

TEST(BoxHistories, UnwrapsQuarterTurnsWithSwappedAxes) {
  MapSnapshot map = HandMadeMap();
  ObjectHistories histories;
  map.objects[0].yaw = 0.7;  // 0.3 by 0.2
  AddSamples(0, map, histories);
  map.objects[0].yaw = 0.8 - 0.5 * std::numbers::pi;
  map.objects[0].superquadric.shape.half_size = {0.21, 0.31, 0.1};
  AddSamples(1, map, histories);
  const std::vector<ObjectSample>& samples = histories.at(0);
  EXPECT_NEAR(samples[1].yaw, 0.8 - 0.5 * std::numbers::pi, 1e-12) << "the newest is as the map says";
  EXPECT_EQ(samples[1].half_size, Eigen::Vector3d(0.21, 0.31, 0.1));
  EXPECT_NEAR(samples[0].yaw, 0.7 - 0.5 * std::numbers::pi, 1e-12);
  EXPECT_EQ(samples[0].half_size, Eigen::Vector3d(0.2, 0.3, 0.1));
}

TEST(BoxHistories, KeepsEarlierSamplesWithoutQuarterTurn) {
  MapSnapshot map = HandMadeMap();
  ObjectHistories histories;
  for (const double yaw : {0.1, 0.4, 0.4 + std::numbers::pi, 0.6 + std::numbers::pi}) {
    map.objects[0].yaw = yaw;
    AddSamples(static_cast<int>(histories[0].size()), map, histories);
    const double half_turn = yaw < 1.0 ? 0.0 : std::numbers::pi;
    const std::vector<ObjectSample>& samples = histories.at(0);
    EXPECT_DOUBLE_EQ(samples.front().yaw, 0.1 + half_turn);
    EXPECT_EQ(samples.front().half_size, Eigen::Vector3d(0.3, 0.2, 0.1));
    EXPECT_EQ(samples.back().yaw, yaw);
  }
}

TEST_F(RecordingPass, UnwrapsHalfTurns) {
  const RecordingReader reader(path_);
  const ObjectHistories histories = Histories(reader);
  const std::vector<ObjectSample>& book = histories.at(0);
  for (std::size_t i = 0; i < book.size(); ++i) {
    EXPECT_NEAR(book[i].yaw, 0.1 * static_cast<double>(i) - std::numbers::pi, 1e-9);
  }
  EXPECT_NEAR(histories.at(2).back().yaw, 1.75, 1e-12) << "also beyond a quarter turn";
}

TEST_F(RecordingPass, AppliesEditsToHistories) {
  ObjectEdits edits;
  edits.Merge(1, 2);
  const RecordingReader reader(path_, [&](const MapSnapshotPtr& map) { return Apply(edits, *map); });
  const ObjectHistories histories = Histories(reader);
  ASSERT_FALSE(histories.contains(2));
  EXPECT_EQ(histories.at(1).size(), 6u) << "the ball alone, then the cup with it";
  EXPECT_EQ(histories.at(1)[5].observations, 84);
}

TEST_F(RecordingPass, CollectsSeriesOfRun) {
  const RunSeries series = SeriesOf(RecordingReader(path_));
  const Series& tracked = series.Named("tracked points");
  EXPECT_THAT(tracked.frame, ElementsAre(5, 15, 25, 35, 45, 55));
  EXPECT_THAT(tracked.value, ElementsAre(100, 101, 102, 103, 0, 105));
  EXPECT_EQ(tracked.Range(), std::pair(0.0, 105.0));
  EXPECT_EQ(tracked.time[3], 1.5);
  const Series& tracking = series.Named("tracking");
  EXPECT_EQ(tracking.unit, "ms");
  EXPECT_THAT(tracking.value[4], Optional(12.0));
  EXPECT_FALSE(tracking.value[5].has_value()) << "not measured is not zero";
  EXPECT_THAT(series.Named("objects").value, ElementsAre(2, 2, 3, 3, 3, 3));
  EXPECT_THAT(series.Named("keyframes").value, ElementsAre(2, 3, 4, 5, 6, 7));
  EXPECT_THROW(series.Named("nothing"), std::out_of_range);
}

TEST_F(RecordingPass, HoldsValueUntilNextSnapshot) {
  const RunSeries series = SeriesOf(RecordingReader(path_));
  const Series& tracked = series.Named("tracked points");
  EXPECT_FALSE(tracked.At(4.0).has_value());
  EXPECT_THAT(tracked.At(5.0), Optional(100.0));
  EXPECT_THAT(tracked.At(14.9), Optional(100.0));
  EXPECT_THAT(tracked.At(999.0), Optional(105.0));
}

TEST_F(RecordingPass, MarksKeyframesAndEvents) {
  const RunSeries series = SeriesOf(RecordingReader(path_));
  std::vector<std::pair<RunMark::Kind, std::int64_t>> events;
  int keyframes = 0;
  std::int64_t last = -1;
  for (const RunMark& mark : series.Marks()) {
    EXPECT_GE(mark.frame_index, last);
    last = mark.frame_index;
    if (mark.kind == RunMark::Kind::kKeyframe) {
      ++keyframes;
    } else {
      events.emplace_back(mark.kind, mark.frame_index);
    }
  }
  EXPECT_EQ(keyframes, 7);
  EXPECT_THAT(events, ElementsAre(std::pair(RunMark::Kind::kLoop, 35), std::pair(RunMark::Kind::kLost, 45),
                                  std::pair(RunMark::Kind::kFoundAgain, 55)));
  EXPECT_STREQ(NameOf(RunMark::Kind::kLoop), "loop closed");
}

TEST(RunSeries, ThinsLongRunsBetweenTheirEnds) {
  RunSeries series;
  MapSnapshot map = HandMadeMap();
  for (int i = 0; i < 10; ++i) {
    map.frame_index = i;
    series.Add(map);
    series.Thin(6);
  }
  EXPECT_THAT(series.Named("objects").frame, ElementsAre(0, 4, 7, 9));
  EXPECT_EQ(series.Named("objects").time.size(), 4U);
  EXPECT_EQ(series.Named("objects").value.size(), 4U);
}

TEST(RunSeriesOfOldRecordings, LeavesGapsForMissingValues) {
  RunSeries series;
  series.Add(HandMadeMap());
  EXPECT_FALSE(series.Named("tracked points").HasValues());
  EXPECT_TRUE(series.Named("objects").HasValues());
  EXPECT_EQ(series.Named("tracking").Range(), std::pair(0.0, 0.0));
}

}  // namespace
}  // namespace sqslam::viewer
