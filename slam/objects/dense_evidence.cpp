#include "slam/objects/dense_evidence.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <ranges>

#include "slam/objects/landmark_geometry.h"
#include "slam/objects/landmark_outliers.h"
#include "slam/objects/landmark_refinement.h"
#include "slam/util/key_index.h"
#include "slam/util/statistics.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace {

// Marks each point that lies within the boxes of nearly all views.
std::vector<bool> InBoxes(std::span<const SurfacePoint> points, const std::vector<BoxView>& views,
                          const Camera& camera) {
  constexpr double kNearlyAll = 0.85;
  constexpr double kMargin = 0.02;  // of a box
  return ToVector(BoxVotes::Of(ToVector(points, &SurfacePoint::p_map), views, camera, kMargin, true),
                  [](const BoxVotes& v) { return v.seen > 0 && v.inside >= kNearlyAll * v.seen; });
}

using CellKey = KeyIndex<3>::Key;

CellKey CellOf(const Eigen::Vector3d& p, double edge) {
  const Eigen::Array3i k = (p / edge).array().floor().cast<int>();
  return {k.x(), k.y(), k.z()};
}

// A voxel with its points.
struct Cell {
  Eigen::Vector3d p = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  int points = 0;
  int inside = 0;  // of them, within the object's boxes
  int piece = -1;
};

struct Cells {
  std::vector<Cell> all;  // in the order of their first points
  std::vector<CellKey> keys;
  KeyIndex<3> places;
  std::vector<std::size_t> of_point;

  Cells(std::span<const SurfacePoint> points, const std::vector<bool>& inside, double edge) {
    for (std::size_t i = 0; i < points.size(); ++i) {
      const CellKey key = CellOf(points[i].p_map, edge);
      const auto [place, is_new] = places.Insert(key);
      if (is_new) {
        all.emplace_back();
        keys.push_back(key);
      }
      Cell& cell = all[place];
      cell.p += points[i].p_map;
      cell.normal += points[i].normal;
      ++cell.points;
      cell.inside += inside[i] ? 1 : 0;
      of_point.push_back(place);
    }
    for (Cell& cell : all) {
      cell.p /= cell.points;
    }
  }

  // Grows a connected component from `seed` over unassigned neighbours that `joins` accepts.
  std::vector<std::size_t> Grow(std::size_t seed, int piece, const auto& joins) {
    std::vector<std::size_t> grown = {seed};
    all[seed].piece = piece;
    for (std::size_t k = 0; k < grown.size(); ++k) {
      const CellKey key = keys[grown[k]];
      for (int n = 0; n < 27; ++n) {
        const CellKey beside = {key[0] + n % 3 - 1, key[1] + n / 3 % 3 - 1, key[2] + n / 9 - 1};
        const std::uint32_t next = places.Find(KeyIndex<3>::HashOf(beside), beside);
        if (next != KeyIndex<3>::kNone && all[next].piece < 0 && joins(all[next])) {
          all[next].piece = piece;
          grown.push_back(next);
        }
      }
    }
    return grown;
  }
};

// Marks the points of plane patches of which a large part lies outside the object's boxes: a wall behind it,
// a seat under it.
std::vector<bool> OfPlanesThatGoOn(std::span<const SurfacePoint> points, const std::vector<bool>& inside,
                                   double edge) {
  constexpr double kSameNormal = 0.9;  // cosine
  constexpr double kThickness = 0.7;   // of a cell
  constexpr std::size_t kFewest = 8;   // cells
  constexpr double kOutside = 0.4;     // of the cells
  Cells cells(points, inside, edge);
  std::vector<std::size_t> order(cells.all.size());
  for (std::size_t i = 0; i < order.size(); ++i) {
    order[i] = i;
  }
  // The fullest and flattest first.
  std::ranges::stable_sort(order, std::greater(), [&](std::size_t i) { return cells.all[i].normal.norm(); });
  std::vector<bool> goes_on;  // by piece
  for (const std::size_t seed : order) {
    if (cells.all[seed].piece >= 0) {
      continue;
    }
    Eigen::Vector3d normals = cells.all[seed].normal.normalized();
    Eigen::Vector3d places = cells.all[seed].p;
    Eigen::Vector3d normal = normals;
    double count = 1.0;
    const auto grown = cells.Grow(seed, static_cast<int>(goes_on.size()), [&](const Cell& next) {
      if (next.normal.normalized().dot(normal) < kSameNormal ||
          std::abs(normal.dot(next.p - places / count)) > kThickness * edge) {
        return false;
      }
      normals += next.normal.normalized();
      places += next.p;
      normal = normals.normalized();
      count += 1.0;
      return true;
    });
    const auto outside = static_cast<double>(std::ranges::count_if(
        grown, [&](std::size_t i) { return 2 * cells.all[i].inside <= cells.all[i].points; }));
    goes_on.push_back(grown.size() >= kFewest && outside > kOutside * count);
  }
  return ToVector(cells.of_point, [&](const std::size_t cell) -> bool {
    return goes_on[static_cast<std::size_t>(cells.all[cell].piece)];
  });
}

// Keeps the largest connected component, and those with at least a third of its points.
std::vector<SurfacePoint> LargePieces(const std::vector<SurfacePoint>& points, double edge) {
  Cells cells(points, std::vector<bool>(points.size(), true), edge);
  std::vector<int> sizes;  // points, by piece
  for (std::size_t i = 0; i < cells.all.size(); ++i) {
    if (cells.all[i].piece < 0) {
      int size = 0;
      for (const std::size_t k :
           cells.Grow(i, static_cast<int>(sizes.size()), [](const Cell&) { return true; })) {
        size += cells.all[k].points;
      }
      sizes.push_back(size);
    }
  }
  const int largest = sizes.empty() ? 0 : std::ranges::max(sizes);
  std::vector<SurfacePoint> result;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (3 * sizes[static_cast<std::size_t>(cells.all[cells.of_point[i]].piece)] >= largest) {
      result.push_back(points[i]);
    }
  }
  return result;
}

// Removes points of the support surface, and those closer to the surface of another object.
void EraseForeign(const Landmark& landmark, const EstimationContext& context,
                  std::vector<SurfacePoint>& points) {
  constexpr double kLow = 0.12;    // of the half height
  constexpr double kLevel = 0.7;   // cosine
  constexpr double kGrown = 1.08;  // of another object
  constexpr double kLarger = 3.0;  // volumes: a much larger object may contain this one
  const PosedSuperquadric& solid = landmark.visible;
  if (landmark.support) {
    const double layer = context.supports->Tolerance();
    const double low = std::max(2.0 * layer, kLow * solid.shape.half_size.z());
    std::erase_if(points, [&](const SurfacePoint& point) {
      const double height = point.p_map.z() - *landmark.support;
      return height < layer || (height < low && point.normal.z() > kLevel);
    });
  }
  const Rigid3d T_object_map = solid.T_map_object.Inverse();
  for (const PosedSuperquadric& other : context.surroundings.others) {
    if (other.shape.Volume() > kLarger * solid.shape.Volume()) {
      continue;
    }
    const Rigid3d T_other_map = other.T_map_object.Inverse();
    std::erase_if(points, [&](const SurfacePoint& point) {
      const Eigen::Vector3d q = T_other_map * point.p_map;
      return other.shape.RadialScale(q) < kGrown &&
             std::abs(other.shape.RadialDistance(q)) <
                 std::abs(solid.shape.RadialDistance(T_object_map * point.p_map));
    });
  }
}

// Median distance of the points from the surface, map units.
double MedianDistance(std::span<const SurfacePoint> points, const PosedSuperquadric& solid) {
  const Rigid3d T_object_map = solid.T_map_object.Inverse();
  std::vector<double> distances = ToVector(points, [&](const SurfacePoint& point) {
    return std::abs(solid.shape.RadialDistance(T_object_map * point.p_map));
  });
  return UpperMedian(std::move(distances));
}

}  // namespace

std::vector<SurfacePoint> SurfaceOf(const Landmark& landmark, std::span<const SurfacePoint> cloud,
                                    const EstimationContext& context) {
  constexpr int kViews = 40;
  constexpr double kGrown = 1.2;   // of the estimate
  constexpr double kAround = 1.6;  // how far planes are followed
  constexpr double kPatch = 0.06;  // edges of cells, of the mean size
  constexpr double kPiece = 0.12;
  const std::vector<BoxView> views = SpreadViews(landmark.views, kViews);
  const PosedSuperquadric& solid = landmark.visible;
  const Eigen::Vector3d& centre = solid.T_map_object.translation;
  const double radius =
      std::max(kGrown * solid.shape.half_size.norm(), LargestShown(views, centre, context.camera));
  const double size = 2.0 * std::cbrt(solid.shape.half_size.prod());
  std::vector<SurfacePoint> around;
  for (const SurfacePoint& point : cloud) {
    if ((point.p_map - centre).norm() < kAround * radius) {
      around.push_back(point);
    }
  }
  const std::vector<bool> inside = InBoxes(around, views, context.camera);
  const std::vector<bool> goes_on = OfPlanesThatGoOn(around, inside, kPatch * size);
  std::vector<SurfacePoint> points;
  for (std::size_t i = 0; i < around.size(); ++i) {
    if (inside[i] && !goes_on[i] && (around[i].p_map - centre).norm() < radius) {
      points.push_back(around[i]);
    }
  }
  EraseForeign(landmark, context, points);
  return LargePieces(points, kPiece * size);
}

bool EstimateWithSurface(Landmark& landmark, std::span<const SurfacePoint> surface,
                         const EstimationContext& context) {
  constexpr std::size_t kFewest = 50;
  constexpr double kPrecise = 0.8;    // standard deviations of dense depth, median
  constexpr double kBetter = 0.8;     // of the old estimate's median distance
  constexpr double kMayLose = 0.035;  // of the mean IoU: fits to boxes alone adopt the detector's bias
  const RefinementOptions& options = context.options->refinement;
  if (surface.size() < kFewest || !landmark.estimated) {
    return false;
  }
  std::vector<BoxView> views = SpreadViews(landmark.views, options.max_views);
  MarkHiddenEdges(landmark, context, views);
  std::vector<double> depths = ToVector(views, [&](const BoxView& view) {
    return (view.T_map_camera.Inverse() * landmark.visible.T_map_object.translation).z();
  });
  const double sigma = options.dense_sigma_share * UpperMedian(std::move(depths));
  const StandingFit fit = RefineLandmarkWithSurface(landmark, views, surface, sigma, context);
  const double before = MedianDistance(surface, landmark.visible);
  const double after = MedianDistance(surface, fit.superquadric);
  if (after > kPrecise * sigma || after > kBetter * before) {
    return false;
  }
  std::vector<BoxView> held_out = HeldOutViews(landmark.views, views, 2 * views.size());
  MarkHiddenEdges(landmark, context, held_out);
  if (BoxAgreement(fit.superquadric, held_out, context.camera) <
      BoxAgreement(landmark.visible, held_out, context.camera) - kMayLose) {
    return false;
  }
  TakeFit(landmark, fit, views, context);
  return true;
}

std::vector<int> EstimateWithCloud(std::map<int, Landmark>& landmarks, std::span<const SurfacePoint> cloud,
                                   EstimationContext context) {
  std::vector<int> changed;
  const std::vector<int> ids = ToVector(landmarks | std::views::keys);
  std::vector<const Landmark*> all;
  for (const auto& [id, landmark] : landmarks) {
    all.push_back(&landmark);
  }
  const ClassPriors& classes = *context.classes;
  for (const int id : LargestFirst(landmarks, ids, classes, ScaleWithout({}, SizedAmong(all, classes)))) {
    Landmark& landmark = landmarks.at(id);
    context.surroundings = SurroundingsOf(landmark, all, classes);
    context.scale = ScaleWithout(id, SizedAmong(all, classes));
    if (EstimateWithSurface(landmark, SurfaceOf(landmark, cloud, context), context)) {
      changed.push_back(id);
    }
  }
  return changed;
}

}  // namespace sqslam
