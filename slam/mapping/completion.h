#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <vector>

#include "slam/map/map.h"
#include "slam/mapping/place_recognizer.h"
#include "slam/mapping/thinned_frames.h"
#include "slam/tracking/pose_tracker.h"

// Tries leftovers of a run, frames without a pose and submaps that stayed apart, once more when all has
// been seen, as a structure-from-motion program would do (Schoenberger and Frahm 2016).
namespace sqslam {

// A frame that no map holds yet.
struct LeftoverFrame {
  std::int64_t index = 0;
  double timestamp = 0.0;
  FrameFeaturesPtr features;
};

using LeftoverFrames = ThinnedFrames<LeftoverFrame>;

// A keyframe of one submap as another submap sees it.
struct SubmapTie {
  LoopCandidate loop;
  int shared_points = 0;  // that both submaps know
};

class Completion {
 public:
  Completion(const Camera& camera, const CompletionOptions& options, const PoseTracker& tracker,
             const PlaceRecognizer& places)
      : camera_(camera), options_(options), tracker_(tracker), places_(places) {}

  // Finds a frame in a map: matches with the keyframes next to it in time and with those that look alike are
  // pooled, the pose comes from them by P3P, and the map points that it leads to must confirm it.
  std::optional<TrackedFrame> Locate(const Map& map, const TrackingView& view,
                                     const LeftoverFrame& frame) const;

  // The same by the geometry of two views, where too few map points are in common with any: the pose relative
  // to a keyframe next in time, with the length of the step from the few points that are.
  std::optional<TrackedFrame> LocateByTwoViews(const Map& map, const LeftoverFrame& frame) const;

  // Indices of the frames, those next to a keyframe of the map in time first.
  std::vector<std::int64_t> InTurn(const Map& map, const LeftoverFrames& frames) const;

  // Finds a keyframe of `current` in `known`, with the unit of length from the points that both know there.
  // The loop is as PlaceRecognizer::Recognize() gives it.
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
