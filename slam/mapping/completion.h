#pragma once

#include <cstdint>
#include <optional>
#include <set>
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
