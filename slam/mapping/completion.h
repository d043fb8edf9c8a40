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
#include "slam/mapping/thinned_frames.h"
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

// Attempts to locate a leftover in a submap. They depend on that frame and on the maps alone, so one that has
// failed is not made again until a map has changed.
class CompletionAttempts {
 public:
  enum class Kind { kTie, kLocate, kTwoViews };

  // Once `stop` returns true, no attempt is due; it is asked before each one. Empty: never.
  explicit CompletionAttempts(std::function<bool()> stop = {}) : stop_(std::move(stop)) {}

  // `leftover`: the index of a frame, or the number of a submap to be tied.
  bool AreDue(Kind kind, std::int64_t submap, std::int64_t leftover) const {
    return !failed_.contains({kind, submap, leftover}) && !(stop_ && stop_());
  }
  void Fail(Kind kind, std::int64_t submap, std::int64_t leftover) {
    failed_.emplace(kind, submap, leftover);
  }
  void Change(std::int64_t submap) {  // its map has changed
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
  Completion(const Camera& camera, const CompletionOptions& options, const PoseTracker& tracker,
             const PlaceRecognizer& places)
      : camera_(camera), options_(options), tracker_(tracker), places_(places) {}

  // Locates a frame in a map: pools its matches with keyframes close in time and similar in appearance,
  // estimates the pose by P3P, and verifies it by searching the local map.
  std::optional<TrackedFrame> Locate(const Map& map, const TrackingView& view,
                                     const LeftoverFrame& frame) const;

  // Locates a frame that shares too few map points with any keyframe: two-view geometry gives its pose
  // relative to a keyframe next in time, the few shared points give the length of the baseline.
  std::optional<TrackedFrame> LocateByTwoViews(const Map& map, const LeftoverFrame& frame) const;

  // Returns the indices of the frames, those closest in time to a keyframe of the map first.
  std::vector<std::int64_t> InTurn(const Map& map, const LeftoverFrames& frames) const;

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
  std::vector<KeyframeId> LikeliestToTie(const Map& current, const Map& known) const;

  Camera camera_;
  CompletionOptions options_;
  const PoseTracker& tracker_;
  const PlaceRecognizer& places_;
};

}  // namespace sqslam
