#include "slam/objects/landmark_outliers.h"

#include <algorithm>
#include <limits>
#include <map>
#include <optional>
#include <ranges>

#include "slam/objects/isolation_forest.h"
#include "slam/objects/landmark_geometry.h"
#include "slam/objects/support_hypotheses.h"
#include "slam/util/largest.h"
#include "slam/util/statistics.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace {

NamedPoints Keep(const NamedPoints& points, const std::vector<bool>& keep) {
  NamedPoints kept;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (keep[i]) {
      kept.push_back(points[i]);
    }
  }
  return kept;
}

// The positions of a landmark's points with votes, by id.
using VotedPositions = std::map<std::int64_t, Eigen::Vector3d>;

// Looks up every point with votes; merges the votes of fused points and drops culled points.
VotedPositions ResolveVotes(Landmark& landmark, const PointLookup& lookup) {
  std::map<std::int64_t, Landmark::PointVotes> votes;
  VotedPositions positions;
  for (const auto& [old_id, vote] : landmark.votes) {
    std::int64_t id = old_id;
    if (const std::optional<Eigen::Vector3d> p = lookup(id)) {
      // Hinted, because nearly all keep their ids and thus their order.
      votes.try_emplace(votes.end(), id)->second.Merge(vote);
      positions.try_emplace(positions.end(), id, *p);
    }
  }
  landmark.votes = std::move(votes);
  return positions;
}

// Returns the points that the votes take for the landmark's.
NamedPoints ResolvePoints(Landmark& landmark, const PointLookup& lookup, const OutlierOptions& options) {
  const VotedPositions positions = ResolveVotes(landmark, lookup);
  const int min_votes = landmark.views.size() >= 5 ? options.min_votes : 1;
  NamedPoints points;
  for (const auto& [id, p] : positions) {
    const Landmark::PointVotes& vote = landmark.votes.at(id);
    const double share = static_cast<double>(vote.inside) / std::max(1, vote.inside + vote.outside);
    const bool inside = options.newest_box_decides && options.reprojection != ReprojectionVotes::kNone
                            ? vote.newest_inside
                            : vote.inside >= min_votes && share >= options.min_inside_share;
    if (inside) {
      points.emplace_back(id, p);
    }
  }
  return points;
}

// Votes of the views on a map point.
struct BoxVotes {
  int inside = 0;  // views whose box contains the point
  int seen = 0;    // views that can tell
};

// Adds the vote of a view on each point in its image. Beyond a box edge that is hidden or cut off, the object
// may continue, so the view has no vote there. `margin`: of the box, share of its size.
void AddVotes(const BoxView& view, const NamedPoints& points, const Camera& camera, double margin,
              std::vector<BoxVotes>& votes) {
  const Rigid3d T_camera_map = view.T_map_camera.Inverse();
  const double pixels = 1.0 + margin * std::max(view.box.width, view.box.height);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3d p = T_camera_map * points[i].second;
    if (p.z() <= 0.0) {
      continue;
    }
    const Eigen::Vector2d pixel = camera.ProjectDistorted(p);
    if (!camera.InImage(pixel)) {
      continue;
    }
    const bool in_box = view.box.Contains(pixel, pixels);
    votes[i].inside += in_box ? 1 : 0;
    votes[i].seen += in_box || IsBeyondEdge(view.box, view.edge_free, pixel, pixels) ? 1 : 0;
  }
}

// Reprojection with a vote (section "Reprojection"): a point of the object lies in its boxes in all views. A
// single miss may be the detector's error, so a share of the views decides.
std::vector<bool> InsideBoxes(const NamedPoints& points, const std::vector<BoxView>& views,
                              const EstimationContext& context) {
  const OutlierOptions& options = context.options->outliers;
  std::vector<BoxVotes> votes(points.size());
  for (const BoxView& view : views) {
    AddVotes(view, points, context.camera, options.box_margin, votes);
  }
  return ToVector(votes,
                  [&](const BoxVotes& vote) { return vote.inside >= options.min_inside_share * vote.seen; });
}

// Drops points of a support surface, which lie in every box that looks down on the object, if enough of the
// object rises above it.
NamedPoints WithoutSurface(const NamedPoints& points, double height) {
  const double top = Largest(points, -std::numeric_limits<double>::infinity(),
                             [](const auto& point) { return point.second.z(); });
  const double tolerance = 0.06 * std::max(0.0, top - height);
  std::vector<bool> above = ToVector(points | std::views::values,
                                     [&](const Eigen::Vector3d& p) { return p.z() > height + tolerance; });
  const auto count = static_cast<std::size_t>(std::ranges::count(above, true));
  return 2 * count >= points.size() && count >= 6 ? Keep(points, above) : points;
}

// Drops points inside smaller objects: a cup in front of a screen lies in the screen's box as well.
NamedPoints WithoutSmallerObjects(const NamedPoints& points, const std::vector<PosedSuperquadric>& others) {
  constexpr double kGrown = 1.1;
  std::vector<bool> keep(points.size(), true);
  for (const PosedSuperquadric& other : others) {
    const Rigid3d T_other_map = other.T_map_object.Inverse();
    for (std::size_t i = 0; i < points.size(); ++i) {
      keep[i] = keep[i] && other.shape.RadialScale(T_other_map * points[i].second) > kGrown;
    }
  }
  const auto kept = static_cast<std::size_t>(std::ranges::count(keep, true));
  return 4 * kept >= points.size() ? Keep(points, keep) : points;
}

// Returns a verdict on every point that was seen in a box. `judged`: the points that the forest scored, both
// in the order of ids.
std::vector<PointVerdict> Verdicts(const Landmark& landmark, const NamedPoints& judged,
                                   const std::vector<double>& scores, double threshold) {
  std::vector<PointVerdict> verdicts;
  std::size_t next = 0;
  for (const auto& [id, vote] : landmark.votes) {
    PointVerdict verdict{id, vote.inside, 0.0, false};
    if (next < judged.size() && judged[next].first == id) {
      verdict.anomaly = scores.empty() ? 0.0 : scores[next];
      verdict.kept = verdict.anomaly <= threshold;
      ++next;
    }
    if (verdict.sightings > 0) {
      verdicts.push_back(verdict);
    }
  }
  return verdicts;
}

}  // namespace

std::vector<Eigen::Vector3d> Positions(const NamedPoints& points) {
  return ToVector(points | std::views::values);
}

void ForgetGonePoints(Landmark& landmark, const PointLookup& lookup) {
  constexpr std::size_t kMany = 1000;
  constexpr std::size_t kFarMore = 3;
  if (landmark.votes.size() > kMany + kFarMore * landmark.verdicts.size()) {
    ResolveVotes(landmark, lookup);
  }
}

NamedPoints RemoveOutliers(Landmark& landmark, const std::vector<BoxView>& views,
                           const EstimationContext& context) {
  const ObjectOptions& options = *context.options;
  NamedPoints points = ResolvePoints(landmark, *context.points, options.outliers);
  const bool refined = options.refinement.enabled;
  if (refined && options.outliers.reprojection != ReprojectionVotes::kNone) {
    points = Keep(points, InsideBoxes(points, views, context));
  }
  if (refined) {
    for (const double height : PossibleSupports(points, context).near) {
      points = WithoutSurface(points, height);
    }
    points = WithoutSmallerObjects(points, context.surroundings.smaller);
  }
  const std::uint64_t seed = context.seed + static_cast<std::uint64_t>(landmark.id) * 7919u;
  const IsolationForestOptions& forest = options.outliers.isolation_forest;
  const std::vector<double> scores = AnomalyScores(Positions(points), forest, seed);
  landmark.verdicts = Verdicts(landmark, points, scores, forest.threshold);
  std::vector<bool> keep(points.size(), true);
  for (std::size_t i = 0; i < scores.size(); ++i) {
    keep[i] = scores[i] <= forest.threshold;
  }
  return Keep(points, keep);
}

}  // namespace sqslam
