#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <set>
#include <tuple>
#include <utility>
#include <vector>

#include "slam/map/map.h"
#include "slam/mapping/place_recognizer.h"
#include "slam/mapping/submap.h"
#include "slam/tracking/pose_tracker.h"

// Tries leftovers of a run (frames without a pose and unconnected submaps) once more at its end, as
// structure-from-motion programs do (Schoenberger and Frahm 2016).
namespace sqslam {

// A frame without a pose in any map.
struct LeftoverFrame {
  std::int64_t index = 0;
  double timestamp = 0.0;
  FrameFeaturesPtr features;
};

using LeftoverFrames = ThinnedFrames<LeftoverFrame>;

// A keyframe of one submap, located in another submap.
struct SubmapTie {
  LoopCandidate loop;
  int shared_points = 0;  // seen in both submaps
};

// Attempts to locate a leftover in a submap. They depend on that frame and on the maps alone: a failed
// attempt is not repeated until a map has changed.
class CompletionAttempts {
 public:
  enum class Kind { kTie, kLocate, kTwoViews };

  // `stop` is called before each attempt; once it returns true, no more are made. Empty: never stops.
  explicit CompletionAttempts(std::function<bool()> stop = {}) : stop_(std::move(stop)) {}

  // Returns the result of locate(), an optional; empty if it fails now or has failed before. `leftover`: the
  // index of a frame, or the number of a submap to be tied.
  auto Try(Kind kind, std::int64_t submap, std::int64_t leftover, auto&& locate) -> decltype(locate()) {
    if (failed_.contains({kind, submap, leftover}) || (stop_ && stop_())) {
      return std::nullopt;
    }
    auto located = locate();
    if (!located) {
      failed_.emplace(kind, submap, leftover);
    }
    return located;
  }
  // Call when the map of the submap has changed.
  void ForgetFailuresIn(std::int64_t submap) {
    std::erase_if(failed_, [submap](const Attempt& attempt) {
      const auto& [kind, in, leftover] = attempt;
      return in == submap || (kind == Kind::kTie && leftover == submap);
    });
  }

 private:
  using Attempt = std::tuple<Kind, std::int64_t, std::int64_t>;

  std::function<bool()> stop_;
  std::set<Attempt> failed_;
};

class Completion {
 public:
  static constexpr int kMinSharedPoints = 12;  // that determine the scale between two submaps

  Completion(const Camera& camera, const PoseTracker& tracker, const PlaceRecognizer& places)
      : camera_(camera), tracker_(tracker), places_(places) {}

  // Locates a frame in a map: pools its matches with keyframes close in time and similar in appearance,
  // estimates the pose by P3P, and verifies it by searching the local map.
  std::optional<TrackedFrame> Locate(const Map& map, const TrackingView& view,
                                     const LeftoverFrame& frame) const;

  // Locates a frame that shares too few map points with any keyframe: two-view geometry gives its pose
  // relative to a keyframe next in time, and the few shared points give the length of the baseline.
  std::optional<TrackedFrame> LocateByTwoViews(const Map& map, const LeftoverFrame& frame) const;

  // Returns the indices of the frames, in order of their distance in time from the map's keyframes.
  std::vector<std::int64_t> ByDistanceInTime(const Map& map, const LeftoverFrames& frames) const;

  // Locates a keyframe of `current` in `known` and estimates the scale from the points that both maps have
  // there. The loop has the form that PlaceRecognizer::Recognize() returns.
  std::optional<SubmapTie> Tie(const Map& current, const Map& known, const TrackingView& known_view) const;

 private:
  std::optional<TrackedFrame> StepFrom(const Map& map, const Keyframe& keyframe,
                                       const LeftoverFrame& leftover) const;
  std::set<KeyframeId> Candidates(const Map& map, std::int64_t frame_index,
                                  const FrameFeatures& features) const;
  std::optional<SubmapTie> TieFrom(const Map& current, const Keyframe& keyframe, const Map& known,
                                   const TrackedFrame& located) const;
  std::vector<KeyframeId> NearestInTime(const Map& current, const Map& known) const;

  Camera camera_;
  const PoseTracker& tracker_;
  const PlaceRecognizer& places_;
};

}  // namespace sqslam
