#include "slam/mapping/loop_verification.h"

#include <algorithm>
#include <set>

#include "slam/features/matching.h"
#include "slam/mapping/local_mapping.h"

namespace sqslam {
namespace {

constexpr int kKnownNeighbours = 10;  // of the known keyframe, whose points are searched for too

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

// Pairs of different map points with matching descriptors in the two keyframes.
std::vector<Sim3Match> MatchDescriptors(const Side& current, const Side& known) {
  constexpr double kRatio = 0.75;
  std::vector<Sim3Match> matches;
  for (const auto& [i, j] :
       MatchAll(*current.keyframe.features, *known.keyframe.features, HavePoints(current.keyframe.points),
                HavePoints(known.keyframe.points), kStrictDistance, kRatio)) {
    if (current.PointAt(i) != known.PointAt(j)) {
      matches.push_back(MakeMatch(current, i, known, j));
    }
  }
  return matches;
}

// The pose of one keyframe in the other's map, in that map's unit of length.
Rigid3d PoseInMap(const Sim3d& S_here_there, const Keyframe& there) {
  return (S_here_there * Sim3d::FromRigid(there.T_camera_map)).RigidPose();
}

// Pairs of different map points that each keyframe finds where the similarity predicts those of the other.
std::vector<Sim3Match> MatchGuided(const Camera& camera, const Side& current, const Side& known,
                                   const Sim3d& S_current_known, const ProjectionSearch& search) {
  const Rigid3d T_current_known_map = PoseInMap(S_current_known, known.keyframe);
  const Rigid3d T_known_current_map = PoseInMap(S_current_known.Inverse(), current.keyframe);
  std::vector<Sim3Match> matches;
  for (int j = 0; j < static_cast<int>(known.keyframe.points.size()); ++j) {
    const PointId point = known.PointAt(j);
    if (point == kNoPoint) {
      continue;
    }
    const int i = FindKeypoint(known.map.Levels(), camera, T_current_known_map, *current.keyframe.features,
                               known.map.Point(point), search);
    if (i < 0 || current.PointAt(i) == kNoPoint || current.PointAt(i) == point) {
      continue;
    }
    const int back = FindKeypoint(current.map.Levels(), camera, T_known_current_map, *known.keyframe.features,
                                  current.map.Point(current.PointAt(i)), search);
    if (back == j) {
      matches.push_back(MakeMatch(current, i, known, j));
    }
  }
  return matches;
}

std::optional<Sim3d> EstimateSimilarity(const Camera& camera, const LoopOptions& options, const Side& current,
                                        const Side& known, const ProjectionSearch& search) {
  const std::vector<Sim3Match> matches = MatchDescriptors(current, known);
  if (static_cast<int>(matches.size()) < options.min_matches) {
    return std::nullopt;
  }
  std::optional<Sim3Estimate> estimate = EstimateSim3(camera, matches, options.similarity);
  if (!estimate) {
    return std::nullopt;
  }
  Sim3d S_current_known = estimate->S_camera1_camera2;
  const std::vector<Sim3Match> guided = MatchGuided(camera, current, known, S_current_known, search);
  std::vector<bool> inliers;  // all of them to begin with
  const bool refined = RefineSim3(camera, guided, S_current_known, inliers) >= options.similarity.min_inliers;
  return refined ? std::optional(S_current_known) : std::nullopt;
}

std::vector<PointId> PointsAround(const Map& map, const Keyframe& keyframe) {
  std::set<PointId> points = PointsOf(map, keyframe.id);
  for (const KeyframeId neighbour : keyframe.BestCovisible(kKnownNeighbours)) {
    points.merge(PointsOf(map, neighbour));
  }
  return {points.begin(), points.end()};
}

// Points that were looked for in an image.
struct Sought {
  int predicted = 0;                           // those that the pose puts into it
  std::vector<std::pair<PointId, int>> found;  // those that are there, each with a keypoint of its own

  double Share() const { return static_cast<double>(found.size()) / std::max(predicted, 1); }
};

Sought FindPoints(const Camera& camera, const Map& map, const std::vector<PointId>& points,
                  const Rigid3d& T_camera_map, const FrameFeatures& features,
                  const ProjectionSearch& search) {
  const Eigen::Vector3d center = T_camera_map.Inverse().translation;
  std::vector<bool> taken(features.Size(), false);
  Sought sought;
  for (const PointId id : points) {
    const MapPoint& point = map.Point(id);
    sought.predicted += PredictSight(point, camera, T_camera_map, center) ? 1 : 0;
    const int keypoint = FindKeypoint(map.Levels(), camera, T_camera_map, features, point, search);
    if (keypoint >= 0 && !taken[static_cast<std::size_t>(keypoint)]) {
      taken[static_cast<std::size_t>(keypoint)] = true;
      sought.found.emplace_back(id, keypoint);
    }
  }
  return sought;
}

// Returns the least share of the points around a keyframe that another image of the same place must show. How
// many a keyframe shows of those that it should depends on the scene.
double NeededShare(const Camera& camera, const LoopOptions& options, const Side& side,
                   const std::vector<PointId>& points, const ProjectionSearch& search) {
  const Keyframe& keyframe = side.keyframe;
  return options.min_relative_share *
         FindPoints(camera, side.map, points, keyframe.T_camera_map, *keyframe.features, search).Share();
}

// Neighbours of a keyframe that were asked for the points of the other side, and those that found enough.
struct Answers {
  int asked = 0;
  int agreed = 0;
};

// Asks the most covisible neighbours of the keyframe `here` for points around the keyframe `there`.
Answers AskNeighbours(const Camera& camera, const LoopOptions& options, const Side& here, const Side& there,
                      const Sim3d& S_here_there, const std::vector<PointId>& points_there,
                      const ProjectionSearch& search) {
  constexpr int kAsked = 2;  // times the number that must agree: some may look past the place
  const double needed = NeededShare(camera, options, there, points_there, search);
  Answers answers;
  for (const KeyframeId id : here.keyframe.BestCovisible(kAsked * options.confirming_neighbours)) {
    const Keyframe& neighbour = here.map.At(id);
    const Rigid3d T_neighbour_here = neighbour.T_camera_map * here.keyframe.T_camera_map.Inverse();
    const Rigid3d T_neighbour_there_map =
        PoseInMap(Sim3d::FromRigid(T_neighbour_here) * S_here_there, there.keyframe);
    const Sought sought =
        FindPoints(camera, there.map, points_there, T_neighbour_there_map, *neighbour.features, search);
    ++answers.asked;
    answers.agreed += static_cast<int>(sought.found.size()) >= options.min_confirmed_by_neighbour &&
                              sought.Share() >= needed
                          ? 1
                          : 0;
  }
  return answers;
}

// Asks the neighbours of both keyframes: where a path meets another one, those of one side may look past the
// place. Young maps may have fewer than are asked for: then all must agree.
bool NeighboursConfirm(const Camera& camera, const LoopOptions& options, const Side& current,
                       const Side& known, const LoopCandidate& loop, const ProjectionSearch& search) {
  const Answers ours =
      AskNeighbours(camera, options, current, known, loop.S_current_known, loop.known_points, search);
  const Answers theirs = AskNeighbours(camera, options, known, current, loop.S_current_known.Inverse(),
                                       PointsAround(current.map, current.keyframe), search);
  return ours.agreed + theirs.agreed >= std::min(options.confirming_neighbours, ours.asked + theirs.asked);
}

}  // namespace

std::optional<LoopCandidate> VerifyLoop(const Camera& camera, const LoopOptions& options, const Map& map,
                                        const Keyframe& current, const Map& known_map,
                                        const Keyframe& known) {
  const Side current_side{map, current};
  const Side known_side{known_map, known};
  ProjectionSearch search;
  search.radius = options.search_radius;
  const std::optional<Sim3d> S_current_known =
      EstimateSimilarity(camera, options, current_side, known_side, search);
  if (!S_current_known) {
    return std::nullopt;
  }
  LoopCandidate loop{current.id, known.id, *S_current_known, PointsAround(known_map, known), {}};
  Sought sought = FindPoints(camera, known_map, loop.known_points, PoseInMap(*S_current_known, known),
                             *current.features, search);
  const double share = sought.Share();
  loop.confirmed = std::move(sought.found);
  const bool verified = static_cast<int>(loop.confirmed.size()) >= options.min_confirmed &&
                        share >= NeededShare(camera, options, known_side, loop.known_points, search) &&
                        NeighboursConfirm(camera, options, current_side, known_side, loop, search);
  return verified ? std::optional(std::move(loop)) : std::nullopt;
}

}  // namespace sqslam
