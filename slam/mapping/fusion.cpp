#include "slam/mapping/fusion.h"

#include <set>

#include "slam/estimation/reprojection_error.h"
#include "slam/mapping/projection_search.h"

namespace sqslam {
namespace {

std::set<KeyframeId> Neighbourhood(const Map& map, KeyframeId id, const FusionOptions& options) {
  std::set<KeyframeId> neighbourhood;
  for (const KeyframeId near : map.At(id).BestCovisible(options.neighbours)) {
    neighbourhood.insert(near);
    for (const KeyframeId further : map.At(near).BestCovisible(options.second_neighbours)) {
      neighbourhood.insert(further);
    }
  }
  neighbourhood.erase(id);
  return neighbourhood;
}

}  // namespace

int FuseWithNeighbours(Map& map, const Camera& camera, KeyframeId id, const FusionOptions& options) {
  const std::set<KeyframeId> neighbourhood = Neighbourhood(map, id, options);
  ProjectionSearch search;
  search.radius = options.radius;
  search.max_squared_error = kChi2TwoDof;
  int fused = 0;
  std::set<PointId> theirs;
  for (const KeyframeId neighbour : neighbourhood) {
    fused += FuseInto(map, camera, PointsOf(map, id), neighbour, search);
    theirs.merge(PointsOf(map, neighbour));
  }
  fused += FuseInto(map, camera, theirs, id, search);
  for (const PointId point : PointsOf(map, id)) {
    map.UpdateAppearance(point);
  }
  map.UpdateCovisibility(id);
  return fused;
}

}  // namespace sqslam
