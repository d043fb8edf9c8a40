#include "slam/mapping/loop_verification.h"

#include <algorithm>
#include <set>

#include "slam/estimation/sim3_estimation.h"
#include "slam/features/matching.h"
#include "slam/mapping/local_mapping.h"

namespace sqslam {
namespace {

constexpr int kMinMatches = 20;  // map points matched by descriptors, and inliers of the similarity

// One of the two keyframes that may show the same place, with its map.
struct Side {
  const Map& map;
  const Keyframe& keyframe;

  PointId PointAt(int keypoint) const { return keyframe.points[static_cast<std::size_t>(keypoint)]; }
  Eigen::Vector3d PointInCamera(int keypoint) const {
    return keyframe.T_camera_map * map.Point(PointAt(keypoint)).p_map;
  }
  const Keypoint& KeypointAt(int keypoint) const {
    return keyframe.features->keypoints[static_cast<std::size_t>(keypoint)];
  }
  // Returns the points that the keyframe and its neighbours see.
  std::vector<PointId> PointsAround() const {
    constexpr int kNeighbours = 10;
    std::set<PointId> points = PointsOf(map, keyframe.id);
    for (const KeyframeId neighbour : keyframe.BestCovisible(kNeighbours)) {
      points.merge(PointsOf(map, neighbour));
    }
    return {points.begin(), points.end()};
  }
};

Sim3Match MakeMatch(const Side& current, int i, const Side& known, int j) {
  const Keypoint& keypoint1 = current.KeypointAt(i);
  const Keypoint& keypoint2 = known.KeypointAt(j);
  return {current.PointInCamera(i),
          known.PointInCamera(j),
          keypoint1.pixel,
          keypoint2.pixel,
          current.map.Levels().Variance(keypoint1.octave),
          known.map.Levels().Variance(keypoint2.octave)};
}

// Returns pairs of different map points with matching descriptors in the two keyframes.
std::vector<Sim3Match> MatchDescriptors(const Side& current, const Side& known) {
  constexpr double kRatio = 0.75;
  std::vector<Sim3Match> matches;
  for (const auto& [i, j] :
       MatchAll(*current.keyframe.features, *known.keyframe.features, HavePoints(current.keyframe.points),
                HavePoints(known.keyframe.points), kMaxUnguidedDistance, kRatio)) {
    if (current.PointAt(i) != known.PointAt(j)) {
      matches.push_back(MakeMatch(current, i, known, j));
    }
  }
  return matches;
}

// Returns the pose of one keyframe in the other's map, in that map's unit of length.
Rigid3d PoseInMap(const Sim3d& S_here_there, const Keyframe& there) {
  return (S_here_there * Sim3d::FromRigid(there.T_camera_map)).RigidPose();
}

// The part of a set of map points that an image shows.
struct VisiblePoints {
  int predicted = 0;                           // points that the pose puts into the image
  std::vector<std::pair<PointId, int>> found;  // points matched there, each with a keypoint of its own

  double Share() const { return static_cast<double>(found.size()) / std::max(predicted, 1); }
};

class LoopVerifier {
 public:
  LoopVerifier(const Camera& camera, const LoopOptions& options, const Side& current, const Side& known)
      : camera_(camera), options_(options), current_(current), known_(known) {
    search_.radius = kLoopSearchRadius;
  }

  std::optional<LoopCandidate> Verify() const {
    constexpr std::size_t kMinFound = 50;  // map points of the known side
    const std::optional<Sim3d> S_current_known = EstimateSimilarity();
    if (!S_current_known) {
      return std::nullopt;
    }
    LoopCandidate loop{current_.keyframe.id, known_.keyframe.id, *S_current_known, known_.PointsAround(), {}};
    VisiblePoints visible = FindPoints(known_, loop.known_points,
                                       PoseInMap(*S_current_known, known_.keyframe), current_.keyframe);
    const double share = visible.Share();
    loop.confirmed = std::move(visible.found);
    const bool verified = loop.confirmed.size() >= kMinFound &&
                          share >= RequiredShare(known_, loop.known_points) && NeighboursConfirm(loop);
    return verified ? std::optional(std::move(loop)) : std::nullopt;
  }

 private:
  std::optional<Sim3d> EstimateSimilarity() const {
    const std::vector<Sim3Match> matches = MatchDescriptors(current_, known_);
    if (static_cast<int>(matches.size()) < kMinMatches) {
      return std::nullopt;
    }
    std::optional<Sim3Estimate> estimate = EstimateSim3(camera_, matches);
    if (!estimate) {
      return std::nullopt;
    }
    Sim3d S_current_known = estimate->S_camera1_camera2;
    std::vector<bool> inliers;  // empty: starts with all matches
    const int count = RefineSim3(camera_, MatchGuided(S_current_known), S_current_known, inliers);
    return count >= kMinMatches ? std::optional(S_current_known) : std::nullopt;
  }

  // Returns pairs of different map points that each keyframe finds where the similarity predicts those of the
  // other.
  std::vector<Sim3Match> MatchGuided(const Sim3d& S_current_known) const {
    const Rigid3d T_current_known_map = PoseInMap(S_current_known, known_.keyframe);
    const Rigid3d T_known_current_map = PoseInMap(S_current_known.Inverse(), current_.keyframe);
    std::vector<Sim3Match> matches;
    for (int j = 0; j < static_cast<int>(known_.keyframe.points.size()); ++j) {
      const PointId point = known_.PointAt(j);
      if (point == kNoPoint) {
        continue;
      }
      const int i = FindKeypoint(known_.map.Levels(), camera_, T_current_known_map,
                                 *current_.keyframe.features, known_.map.Point(point), search_);
      if (i < 0 || current_.PointAt(i) == kNoPoint || current_.PointAt(i) == point) {
        continue;
      }
      const int back =
          FindKeypoint(current_.map.Levels(), camera_, T_known_current_map, *known_.keyframe.features,
                       current_.map.Point(current_.PointAt(i)), search_);
      if (back == j) {
        matches.push_back(MakeMatch(current_, i, known_, j));
      }
    }
    return matches;
  }

  // Searches for points of one side in a keyframe of either side, whose pose in the map of `side` is given.
  VisiblePoints FindPoints(const Side& side, const std::vector<PointId>& points, const Rigid3d& T_camera_map,
                           const Keyframe& keyframe) const {
    const Eigen::Vector3d center = T_camera_map.Inverse().translation;
    std::vector<bool> taken(keyframe.features->Size(), false);
    VisiblePoints visible;
    for (const PointId id : points) {
      const MapPoint& point = side.map.Point(id);
      visible.predicted += PredictSight(point, camera_, T_camera_map, center) ? 1 : 0;
      const int keypoint =
          FindKeypoint(side.map.Levels(), camera_, T_camera_map, *keyframe.features, point, search_);
      if (keypoint >= 0 && !taken[static_cast<std::size_t>(keypoint)]) {
        taken[static_cast<std::size_t>(keypoint)] = true;
        visible.found.emplace_back(id, keypoint);
      }
    }
    return visible;
  }

  // Returns the minimum share of the points around a keyframe that another image of the same place must show:
  // relative to the share that the keyframe itself shows, which depends on the scene.
  double RequiredShare(const Side& side, const std::vector<PointId>& points) const {
    return options_.min_relative_share *
           FindPoints(side, points, side.keyframe.T_camera_map, side.keyframe).Share();
  }

  struct Votes {
    int asked = 0;      // neighbours that were searched for the points of the other side
    int confirmed = 0;  // neighbours that show enough of them
  };

  // Searches the most covisible neighbours of the keyframe `here` for points around the keyframe `there`.
  Votes AskNeighbours(const Side& here, const Side& there, const Sim3d& S_here_there,
                      const std::vector<PointId>& points_there) const {
    constexpr int kAskedPerNeeded = 2;     // some neighbours may look past the place
    constexpr std::size_t kMinFound = 30;  // map points
    const double required = RequiredShare(there, points_there);
    Votes votes;
    for (const KeyframeId id :
         here.keyframe.BestCovisible(kAskedPerNeeded * options_.confirming_neighbours)) {
      const Keyframe& neighbour = here.map.At(id);
      const Rigid3d T_neighbour_here = neighbour.T_camera_map * here.keyframe.T_camera_map.Inverse();
      const VisiblePoints visible =
          FindPoints(there, points_there,
                     PoseInMap(Sim3d::FromRigid(T_neighbour_here) * S_here_there, there.keyframe), neighbour);
      ++votes.asked;
      votes.confirmed += visible.found.size() >= kMinFound && visible.Share() >= required ? 1 : 0;
    }
    return votes;
  }

  // Asks the neighbours of both keyframes: where a path meets another one, the neighbours of one side may
  // look past the place. In young maps with fewer neighbours, all must confirm.
  bool NeighboursConfirm(const LoopCandidate& loop) const {
    const Votes ours = AskNeighbours(current_, known_, loop.S_current_known, loop.known_points);
    const Votes theirs =
        AskNeighbours(known_, current_, loop.S_current_known.Inverse(), current_.PointsAround());
    return ours.confirmed + theirs.confirmed >=
           std::min(options_.confirming_neighbours, ours.asked + theirs.asked);
  }

  const Camera& camera_;
  const LoopOptions& options_;
  Side current_;
  Side known_;
  ProjectionSearch search_;
};

}  // namespace

std::optional<LoopCandidate> VerifyLoop(const Camera& camera, const LoopOptions& options, const Map& map,
                                        const Keyframe& current, const Map& known_map,
                                        const Keyframe& known) {
  return LoopVerifier(camera, options, {map, current}, {known_map, known}).Verify();
}

}  // namespace sqslam
