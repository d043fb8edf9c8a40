#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "slam/estimation/two_view.h"
#include "slam/map/map.h"
#include "slam/mapping/place_recognizer.h"
#include "slam/mapping/submap.h"
#include "slam/mapping/view_graph.h"
#include "slam/tracking/pose_tracker.h"

// Tries leftovers of a run (frames without a pose and unconnected submaps) once more at its end, as
// structure-from-motion programs do (Schoenberger and Frahm 2016): the frame that shows most map points is
// placed next, submaps with common views are merged, and a new submap starts from the best pair that is left.
namespace sqslam {

// A frame without a pose in any map.
struct LeftoverFrame {
  std::int64_t index = 0;
  double timestamp = 0.0;
  FrameFeaturesPtr features;
  std::string image_path = {};             // empty if there is no file
  std::vector<Detection> detections = {};  // its boxes
  cv::Mat ignored = {};  // 8UC1 of any size, nonzero where no features are taken; may be empty
};

using LeftoverFrames = ThinnedFrames<LeftoverFrame>;

// A keyframe of one submap, located in another submap.
struct SubmapTie {
  LoopCandidate loop;
  int shared_points = 0;  // seen in both submaps
};

// Attempts to locate leftovers and to tie submaps. A failed one is repeated only with more evidence.
class CompletionAttempts {
 public:
  // In the order in which a frame is tried: kLocateLoosely takes poses that the points determine poorly.
  enum class Kind { kTie, kLocate, kTwoViews, kLocateLoosely };

  // `stop` is called before each attempt; once it returns true, no more are made. Empty: never stops.
  explicit CompletionAttempts(std::function<bool()> stop = {}) : stop_(std::move(stop)) {}

  bool Stopped() const { return stop_ && stop_(); }

  // Returns the result of locate(), an optional; empty if it fails now or has failed before with nearly as
  // much evidence. `leftover`: the index of a frame, or the number of a submap to be tied. `evidence`: number
  // of common points or matches.
  auto Try(Kind kind, std::int64_t submap, std::int64_t leftover, int evidence, auto&& locate)
      -> decltype(locate()) {
    constexpr double kMinGrowth = 1.2;  // of the evidence
    const Attempt attempt{kind, submap, leftover};
    const auto failed = failed_.find(attempt);
    if ((failed != failed_.end() && evidence < kMinGrowth * failed->second) || Stopped()) {
      return std::nullopt;
    }
    auto located = locate();
    if (!located) {
      failed_[attempt] = evidence;
    }
    return located;
  }

 private:
  using Attempt = std::tuple<Kind, std::int64_t, std::int64_t>;

  std::function<bool()> stop_;
  std::map<Attempt, int> failed_;  // evidence of the last failure
};

// Map points that a frame shows, by its matches with keyframes of the map.
struct SharedPoints {
  std::vector<std::pair<PointId, int>> matches;  // map point, keypoint of the frame
  KeyframeId reference = kNoKeyframe;            // shows most of them
};

// A keyframe of one submap and one of another that show the same things.
struct CommonView {
  KeyframeId current = kNoKeyframe;
  KeyframeId known = kNoKeyframe;
  int matches = 0;
};

// Two leftovers that a map can start from.
struct StartPair {
  std::int64_t first = 0;
  std::int64_t second = 0;
  ImageMatches matches;
  TwoViewGeometry geometry;
};

class Completion {
 public:
  static constexpr int kMinSharedPoints = 12;  // that determine the scale between two submaps

  Completion(const Camera& camera, const PoseTracker& tracker, const ViewGraph& views)
      : camera_(camera), tracker_(tracker), views_(views) {}

  // Returns the map points that the frame shows.
  SharedPoints PointsShared(const Map& map, std::int64_t frame_index) const;

  // Locates a frame in a map by its shared points: P3P, then a search of the local map that verifies the
  // pose. Fails if the points leave the pose more uncertain than `max_deviation` (CornerDeviation()).
  std::optional<TrackedFrame> Locate(const TrackingView& view, const SharedPoints& shared,
                                     const LeftoverFrame& frame,
                                     double max_deviation = std::numeric_limits<double>::infinity()) const;

  // Locates a frame that shares too few map points with any keyframe: two-view geometry gives its pose
  // relative to a keyframe that shows the same things, the few shared points give the length of the baseline,
  // and at least half of those shared with any keyframe must agree.
  std::optional<TrackedFrame> LocateByTwoViews(const Map& map, const LeftoverFrame& frame) const;

  // Returns the pairs of keyframes that show the same things, those with most matches first.
  std::vector<CommonView> CommonViews(const Map& current, const Map& known) const;

  // Locates a keyframe of `current` in `known` and estimates the scale from the points that both maps have
  // there. The loop has the form that PlaceRecognizer::Recognize() returns.
  std::optional<SubmapTie> Tie(const Map& current, const Map& known, const TrackingView& known_view,
                               const std::vector<CommonView>& common) const;

  // Triangulates new points between a keyframe and all others from their matches, then fuses duplicates.
  void AddNewPoints(Map& map, KeyframeId keyframe) const;

  // Returns the keyframes of the map that show the same things as the given one, but with map points of their
  // own, as before a loop closure; those with most matches first.
  std::vector<KeyframeId> LoopsAt(const Map& map, KeyframeId keyframe) const;

  // Returns pairs of frames that a map may start from, those whose geometry determines most points best
  // first; no two of them begin near each other.
  std::vector<StartPair> Starts(const LeftoverFrames& frames);

  // Returns how well further frames confirm a map of two views: the mean share of the points they show that
  // agree with one pose; 0 if too few show any. Matches in two views satisfy many wrong geometries, in three
  // hardly any.
  double ThirdViewSupport(const Map& map, const LeftoverFrames& frames) const;

 private:
  std::optional<TrackedFrame> StepFrom(const Map& map, const Keyframe& keyframe, const ImageMatches& pairs,
                                       const SharedPoints& shared, const LeftoverFrame& leftover) const;
  std::optional<SubmapTie> TieFrom(const Map& current, const Keyframe& keyframe, const Map& known,
                                   const TrackedFrame& located) const;
  std::vector<StartPair> AllStarts(const LeftoverFrames& frames) const;

  Camera camera_;
  const PoseTracker& tracker_;
  const ViewGraph& views_;
  std::optional<std::vector<StartPair>> pairs_;  // with a geometry, the best first; computed once
};

}  // namespace sqslam
