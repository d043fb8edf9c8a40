#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "slam/mapping/mapper.h"
#include "tests/support/synthetic_map.h"
#include "tests/support/tracked_frame.h"

namespace sqslam::testing {

inline constexpr std::size_t kFirstPoints = 200;  // that the first two keyframes have

// The test stands in for the tracking thread: it reports where on the arc each frame was seen, and takes the
// points of a keyframe from the map that was published last.
class MapperTest : public ::testing::Test {
 protected:
  explicit MapperTest(std::shared_ptr<const Vocabulary> words = nullptr) {
    options_.deterministic = true;
    options_.mapping.culling.redundant_share = 1.0;  // where all see all, no keyframe would stay
    Restart(std::move(words));
  }
  void Restart(std::shared_ptr<const Vocabulary> words = nullptr) {
    atlas_.reset();
    snapshots_.clear();
    mapper_ = std::make_unique<Mapper>(
        world_.camera, options_, std::move(words),
        Mapper::Outputs{[this](AtlasViewPtr atlas) { atlas_ = std::move(atlas); },
                        [this](MapSnapshotPtr snapshot) { snapshots_.push_back(std::move(snapshot)); },
                        {},
                        [this](std::string state) { kept_.push_back(std::move(state)); }},
        times_);
  }

  TrackingReport Report(std::int64_t index) const {
    TrackingReport report;
    report.frame_index = index;
    report.timestamp = static_cast<double>(index) / 30.0;
    return report;
  }
  TrackingReport Beginning(std::int64_t submap, Map map) const {
    const Keyframe& newest = map.At(map.NewestKeyframe());
    TrackingReport report = Report(newest.frame_index);
    report.submap = submap;
    report.pose = AnchoredPose{newest.id, {}, newest.scale};
    report.initial_map = std::make_unique<Map>(std::move(map));
    return report;
  }
  // A map of two keyframes, at the places 0 and 1 of the arc; some keypoints have no map point yet.
  void Begin(std::int64_t submap = 0) {
    SyntheticMap first = MakeSyntheticMap({.keyframes = 2});
    for (std::size_t id = kFirstPoints; id < first.points.size(); ++id) {
      first.map.RemovePoint(static_cast<PointId>(id));
    }
    mapper_->Process(Beginning(submap, std::move(first.map)));
  }

  const TrackingView& View(std::int64_t submap = 0) const { return *atlas_->submaps.at(submap); }
  // A frame at a place of the arc as tracking would report it, a little off the truth.
  TrackingReport Seen(std::int64_t index, double place, bool keyframe) const {
    const ViewKeyframe& reference = View().keyframes.rbegin()->second;
    TrackedFrame frame = NewFrame(world_.See(PoseOnArc(place), {.pixel_noise = 0.2}).features, index);
    frame.points = reference.points;  // one keypoint a point, in the same order in all frames
    TrackingReport report = Report(index);
    report.pose = AnchoredPose{reference.id, PoseOnArc(place + 0.01) * reference.pose.T_camera_map.Inverse(),
                               reference.pose.scale};
    report.matches = MatchesOf(frame, ScaleLevels(OrbOptions{}));
    for (const PointId point : frame.points) {
      if (point != kNoPoint) {
        report.seen.visible.push_back(point);
        report.seen.found.push_back(point);
      }
    }
    if (keyframe) {
      report.keyframe = KeyframeCandidate{frame.features, frame.points};
    }
    return report;
  }
  // Two frames for each place of the arc up to `last`, every second one a keyframe.
  void Walk(int last) {
    for (int i = 3; i <= 2 * last; ++i) {
      mapper_->Process(Seen(i, 0.5 * i, i % 2 == 0));
    }
  }

  SyntheticMap world_ = MakeSyntheticMap({});
  MapperOptions options_;
  StageTimes times_;
  AtlasViewPtr atlas_;
  std::vector<MapSnapshotPtr> snapshots_;
  std::vector<std::string> kept_;
  std::unique_ptr<Mapper> mapper_;
};

class MapperWithWords : public MapperTest {
 protected:
  MapperWithWords() : MapperTest(RandomWords()) {}
};

}  // namespace sqslam::testing
