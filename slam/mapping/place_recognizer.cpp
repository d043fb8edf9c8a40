#include "slam/mapping/place_recognizer.h"

#include <algorithm>
#include <set>

#include "slam/features/matching.h"
#include "slam/mapping/local_mapping.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace {

constexpr int kNeighbours = 10;  // of the known keyframe, whose points are searched for too

// Returns the map that has the keyframe, or null.
const Map* MapOf(const std::vector<const Map*>& maps, KeyframeId id) {
  const auto it = std::ranges::find_if(maps, [&](const Map* map) { return map->HasKeyframe(id); });
  return it != maps.end() ? *it : nullptr;
}

// Pairs of different map points with matching descriptors in the two keyframes.
std::vector<Sim3Match> MatchPoints(const Map& map, const Keyframe& current, const Map& known_map,
                                   const Keyframe& known) {
  constexpr double kRatio = 0.75;
  std::vector<Sim3Match> matches;
  for (const auto& [i, j] : MatchAll(*current.features, *known.features, HavePoints(current.points),
                                     HavePoints(known.points), kStrictDistance, kRatio)) {
    const auto a = static_cast<std::size_t>(i);
    const auto b = static_cast<std::size_t>(j);
    if (current.points[a] == known.points[b]) {
      continue;  // already the same point
    }
    const Keypoint& keypoint1 = current.features->keypoints[a];
    const Keypoint& keypoint2 = known.features->keypoints[b];
    matches.push_back({current.T_camera_map * map.Point(current.points[a]).p_map,
                       known.T_camera_map * known_map.Point(known.points[b]).p_map, keypoint1.pixel,
                       keypoint2.pixel, map.Levels().Variance(keypoint1.octave),
                       map.Levels().Variance(keypoint2.octave)});
  }
  return matches;
}

}  // namespace

void PlaceRecognizer::Add(Keyframe& keyframe) {
  if (vocabulary_) {
    keyframe.words =
        std::make_shared<const BagOfWords>(vocabulary_->Transform(keyframe.features->descriptors));
    index_.Add(keyframe.id, *keyframe.words);
  }
}

std::vector<KeyframeId> PlaceRecognizer::Alike(const Map& map, const FrameFeatures& features,
                                               int count) const {
  if (!vocabulary_) {
    return {};
  }
  const BagOfWords words = vocabulary_->Transform(features.descriptors);
  PlaceQuery query;
  query.bow = &words;
  query.max_candidates = count;
  query.exclude = [&map](KeyframeId id) { return !map.HasKeyframe(id); };
  return ToVector(index_.Query(query), &PlaceCandidate::id);
}

std::vector<PlaceCandidate> PlaceRecognizer::FindCandidates(const std::vector<const Map*>& maps,
                                                            const Keyframe& current) const {
  PlaceQuery query;
  query.bow = current.words.get();
  query.max_candidates = options_.max_candidates;
  query.exclude = [&](KeyframeId id) {
    return id == current.id || current.covisibility.contains(id) || MapOf(maps, id) == nullptr;
  };
  query.covisible = [&](KeyframeId id) {
    const Map* map = MapOf(maps, id);
    return map != nullptr ? map->At(id).BestCovisible(kNeighbours) : std::vector<KeyframeId>{};
  };
  // The same place should score no lower than the least similar covisible keyframe (ORB-SLAM VII-A).
  query.min_score = 1.0;
  for (const auto& [id, weight] : current.covisibility) {
    const BagOfWordsPtr& words = maps.front()->At(id).words;
    query.min_score = std::min(query.min_score, words ? Similarity(*current.words, *words) : 0.0);
  }
  query.min_score = current.covisibility.empty() ? 0.0 : query.min_score;
  return index_.Query(query);
}

std::optional<LoopCandidate> PlaceRecognizer::Recognize(const std::vector<const Map*>& maps,
                                                        KeyframeId current) const {
  const Keyframe& keyframe = maps.front()->At(current);
  if (!keyframe.words) {
    return std::nullopt;
  }
  for (const PlaceCandidate& candidate : FindCandidates(maps, keyframe)) {
    const Map& known_map = *MapOf(maps, candidate.id);
    if (auto loop = Verify(*maps.front(), keyframe, known_map, known_map.At(candidate.id))) {
      return loop;
    }
  }
  return std::nullopt;
}

std::optional<LoopCandidate> PlaceRecognizer::Verify(const Map& map, const Keyframe& current,
                                                     const Map& known_map, const Keyframe& known) const {
  const std::vector<Sim3Match> matches = MatchPoints(map, current, known_map, known);
  if (static_cast<int>(matches.size()) < options_.min_matches) {
    return std::nullopt;
  }
  std::optional<Sim3Estimate> estimate = EstimateSim3(camera_, matches, options_.similarity);
  if (!estimate) {
    return std::nullopt;
  }
  LoopCandidate loop{current.id, known.id, estimate->S_camera1_camera2, {}, {}};
  if (RefineSim3(camera_, matches, loop.S_current_known, estimate->inliers) <
      options_.similarity.min_inliers) {
    return std::nullopt;
  }
  std::set<PointId> points = PointsOf(known_map, known.id);
  for (const KeyframeId neighbour : known.BestCovisible(kNeighbours)) {
    points.merge(PointsOf(known_map, neighbour));
  }
  loop.known_points.assign(points.begin(), points.end());
  Confirm(current, known_map, options_.search_radius, loop);
  return static_cast<int>(loop.confirmed.size()) >= options_.min_confirmed ? std::optional(loop)
                                                                           : std::nullopt;
}

// Searches the current keyframe for the points of the known side, with the pose that the similarity implies.
void PlaceRecognizer::Confirm(const Keyframe& current, const Map& known_map, double radius,
                              LoopCandidate& loop) const {
  const Keyframe& known = known_map.At(loop.known);
  const Rigid3d T_current_known_map =
      (loop.S_current_known * Sim3d::FromRigid(known.T_camera_map)).RigidPose();
  ProjectionSearch search;
  search.radius = radius;
  std::vector<bool> taken(current.points.size(), false);
  for (const PointId id : loop.known_points) {
    const int keypoint = FindKeypoint(known_map.Levels(), camera_, T_current_known_map, *current.features,
                                      known_map.Point(id), search);
    if (keypoint >= 0 && !taken[keypoint]) {
      taken[keypoint] = true;
      loop.confirmed.emplace_back(id, keypoint);
    }
  }
}

}  // namespace sqslam
