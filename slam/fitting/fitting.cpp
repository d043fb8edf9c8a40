#include "slam/fitting/fitting.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include "slam/fitting/cloud_preparation.h"
#include "slam/fitting/surface_measures.h"
#include "slam/util/error.h"

namespace sqslam {
namespace {

using Eigen::Vector3d;

// Every n-th of the sorted points, so that at most `count` are left.
std::vector<Vector3d> Thinned(const std::vector<Vector3d>& points, int count) {
  const std::size_t step = (points.size() + count - 1) / count;
  std::vector<Vector3d> thinned;
  for (std::size_t i = 0; i < points.size(); i += step) {
    thinned.push_back(points[i]);
  }
  return thinned;
}

}  // namespace

SuperquadricFit FitSuperquadric(std::span<const Vector3d> cloud, const FitOptions& options) {
  const CanonicalCloud canonical = ToCanonicalFrame(cloud, options.upright);
  const SearchResult found = SearchSuperquadric(Thinned(canonical.points, options.max_points), options);
  SuperquadricFit fit;
  fit.superquadric = canonical.S_map_canonical * found.superquadric;
  fit.noise = canonical.S_map_canonical.scale * found.model.sigma;
  fit.cost = found.cost;
  fit.points = static_cast<int>(cloud.size());
  fit.inlier.resize(cloud.size());
  const SurfaceDistance distance(found.superquadric.shape);
  const Rigid3d T_object_canonical = found.superquadric.T_map_object.Inverse();
  double squares = 0.0;
  int inliers = 0;
  for (std::size_t i = 0; i < canonical.points.size(); ++i) {
    const Vector3d p = T_object_canonical * canonical.points[i];
    if (found.model.InlierProbability(distance(p)) > 0.5) {
      const double radial = found.superquadric.shape.RadialDistance(p);
      squares += radial * radial;
      ++inliers;
      fit.inlier[canonical.source[i]] = true;
    }
  }
  fit.rms = canonical.S_map_canonical.scale * std::sqrt(squares / std::max(inliers, 1));
  fit.inlier_share = static_cast<double>(inliers) / static_cast<double>(cloud.size());
  return fit;
}

std::vector<SuperquadricFit> FitSuperquadrics(std::span<const Vector3d> cloud,
                                              const MultiFitOptions& options) {
  const CanonicalCloud canonical = ToCanonicalFrame(cloud, options.fit.upright);
  std::vector<std::size_t> kept(canonical.points.size());  // indices of canonical points
  std::iota(kept.begin(), kept.end(), std::size_t{0});
  if (options.remove_plane) {
    const std::optional<Plane> plane =
        FindLargestPlane(canonical.points, options.plane_distance, options.fit.upright, options.fit.seed);
    std::erase_if(kept, [&](std::size_t i) {
      return plane && std::abs(plane->Distance(canonical.points[i])) < options.plane_distance;
    });
  }
  std::vector<std::vector<std::size_t>> clusters = {kept};
  if (options.clusters != 1) {
    clusters = ClusterPoints(canonical.points, kept, options.cluster_distance);
    if (options.clusters > 0) {
      clusters.resize(std::min(clusters.size(), static_cast<std::size_t>(options.clusters)));
    }
    std::erase_if(clusters, [&](const auto& cluster) {
      return cluster.size() < static_cast<std::size_t>(options.min_cluster_points);
    });
  }
  if (clusters.empty()) {
    throw InputError(fmt::format("no cluster has {} points or more, expected at least one object",
                                 options.min_cluster_points));
  }
  std::vector<SuperquadricFit> fits;
  for (const std::vector<std::size_t>& cluster : clusters) {
    std::vector<Vector3d> part;
    for (const std::size_t i : cluster) {
      part.push_back(cloud[canonical.source[i]]);
    }
    SuperquadricFit fit = FitSuperquadric(part, options.fit);
    std::vector<bool> inlier(cloud.size(), false);
    for (std::size_t k = 0; k < cluster.size(); ++k) {
      inlier[canonical.source[cluster[k]]] = fit.inlier[k];
    }
    fit.inlier = std::move(inlier);
    fits.push_back(std::move(fit));
  }
  return fits;
}

}  // namespace sqslam
