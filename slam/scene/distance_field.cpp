#include "slam/scene/distance_field.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "slam/io/map_frame.h"
#include "slam/util/atomic_file.h"
#include "slam/util/parallel.h"
#include "slam/util/throw_if.h"

namespace sqslam {
namespace fs = std::filesystem;
namespace {

constexpr double kQuarter = 0.5 * std::numbers::pi;

// The unit superellipse at a polar angle in the first quadrant, with its first two derivatives by the angle.
struct CurvePoint {
  Eigen::Vector2d at, first, second;

  CurvePoint(double angle, double e) {
    constexpr double kTiny = 1e-9;  // where an exponent above 1 has a ridge, its curvature is infinite
    const double p = 2.0 / e;
    const double c = std::max(std::cos(angle), 0.0), s = std::max(std::sin(angle), 0.0);
    // With the larger of both factored out, powers do not underflow together.
    const double larger = std::max(c, s), a = std::max(c / larger, kTiny), b = std::max(s / larger, kTiny);
    const double a2 = std::pow(a, p - 2.0), b2 = std::pow(b, p - 2.0);  // powers of a and b, less two
    const double g = a2 * a * a + b2 * b * b;                           // (c^p + s^p) / larger^p
    const double g1 = p * (b2 * b * a - a2 * a * b);                    // its derivatives over larger^p
    const double g2 = p * ((p - 1.0) * (a2 * b * b + b2 * a * a) - g);
    const double r = std::pow(g, -1.0 / p) / larger;
    const double r1 = -r * g1 / (p * g);
    const double r2 = -(r1 * g1 + r * (g2 - g1 * g1 / g)) / (p * g);
    at = {r * c, r * s};
    first = {r1 * c - r * s, r1 * s + r * c};
    second = {r2 * c - 2.0 * r1 * s - r * c, r2 * s + 2.0 * r1 * c - r * s};
  }
};

// Half the squared distance of a point in the first octant from the surface point at two angles, with
// gradient and Hessian.
struct Approach {
  Eigen::Vector3d surface;
  double cost = 0.0;
  Eigen::Vector2d gradient;
  Eigen::Matrix2d hessian;

  Approach(const Superquadric& shape, const Eigen::Vector3d& p, const Eigen::Vector2d& angles) {
    const CurvePoint profile(angles[0], shape.e1), section(angles[1], shape.e2);
    const Eigen::Vector3d& h = shape.half_size;
    const auto point = [&h](const Eigen::Vector2d& along, const Eigen::Vector2d& around) {
      return Eigen::Vector3d(h.x() * along.x() * around.x(), h.y() * along.x() * around.y(),
                             h.z() * along.y());
    };
    const auto flat = [&h](double along, const Eigen::Vector2d& around) {
      return Eigen::Vector3d(h.x() * along * around.x(), h.y() * along * around.y(), 0.0);
    };
    surface = point(profile.at, section.at);
    const Eigen::Vector3d error = surface - p;
    cost = 0.5 * error.squaredNorm();
    const Eigen::Vector3d by_profile = point(profile.first, section.at),
                          by_section = flat(profile.at.x(), section.first);
    gradient = {error.dot(by_profile), error.dot(by_section)};
    hessian(0, 0) = by_profile.squaredNorm() + error.dot(point(profile.second, section.at));
    hessian(1, 1) = by_section.squaredNorm() + error.dot(flat(profile.at.x(), section.second));
    hessian(0, 1) = hessian(1, 0) =
        by_profile.dot(by_section) + error.dot(flat(profile.first.x(), section.first));
  }
};

// Descends to a minimum within the octant by damped Newton steps.
Approach Descend(const Superquadric& shape, const Eigen::Vector3d& p, Eigen::Vector2d angles) {
  constexpr int kSteps = 100;
  Approach best(shape, p, angles);
  double damping = 0.0;
  const double scale = shape.half_size.squaredNorm();
  for (int i = 0; i < kSteps; ++i) {
    Eigen::Matrix2d H = best.hessian;
    Eigen::Vector2d g = best.gradient;
    for (int k = 0; k < 2; ++k) {  // an angle at its bound that the cost pushes outwards stays there
      if ((angles[k] <= 0.0 && g[k] >= 0.0) || (angles[k] >= kQuarter && g[k] <= 0.0)) {
        g[k] = H(0, 1) = H(1, 0) = 0.0;
        H(k, k) = std::max(std::abs(H(k, k)), 1e-12 * scale);
      }
    }
    const double trace = std::max(H.trace(), 1e-12 * scale);
    if (damping > 0.0 || H.determinant() <= 0.0 || H(0, 0) <= 0.0) {
      damping = std::max(damping, 1e-3);
      H = H + damping * std::max(trace, std::abs(H(0, 1))) * Eigen::Matrix2d::Identity();
      if (H.determinant() <= 0.0 || H(0, 0) <= 0.0) {
        damping *= 4.0;
        continue;
      }
    }
    const Eigen::Vector2d next = (angles - H.inverse() * g).cwiseMax(0.0).cwiseMin(kQuarter);
    const Approach there(shape, p, next);
    if (there.cost <= best.cost) {
      const bool done = (next - angles).norm() < 1e-8 ||
                        best.cost - there.cost <= 1e-16 * scale * std::min(1.0, 1e3 * best.cost / scale);
      angles = next;
      best = there;
      damping = damping > 1e-6 ? 0.2 * damping : 0.0;
      if (done) {
        break;
      }
    } else {
      damping = std::max(4.0 * damping, 1e-3);
    }
  }
  return best;
}

// Polar angles of a point in units of the half sizes.
Eigen::Vector2d AnglesOf(const Eigen::Vector3d& unit, double e2) {
  const double section = std::atan2(unit.y(), unit.x());
  const CurvePoint curve(section, e2);
  const double along = unit.head<2>().norm() / curve.at.norm();
  return {std::atan2(unit.z(), along), section};
}

}  // namespace

SurfaceDistance DistanceFrom(const PosedSuperquadric& solid, const Eigen::Vector3d& p_map) {
  const Superquadric& shape = solid.shape;
  const Eigen::Vector3d p_object = solid.T_map_object.Inverse() * p_map;
  const Eigen::Vector3d p = p_object.cwiseAbs();
  const Eigen::Vector3d unit = p.cwiseQuotient(shape.half_size);
  const bool inside = shape.RadialScale(p) < 1.0;
  Approach nearest = Descend(shape, p, AnglesOf(unit, shape.e2));
  if (inside || std::max(shape.e1, shape.e2) > 1.0) {  // one of several faces is nearest, or a ridge
    for (int axis = 0; axis < 3; ++axis) {
      Eigen::Vector3d toward = unit;  // moved along an axis to the face there
      toward[axis] = std::max(1.0, toward[axis]);
      const Approach found = Descend(shape, p, AnglesOf(toward, shape.e2));
      nearest = found.cost < nearest.cost ? found : nearest;
    }
    const Approach middle = Descend(shape, p, AnglesOf(Eigen::Vector3d::Ones(), shape.e2));
    nearest = middle.cost < nearest.cost ? middle : nearest;
  }
  SurfaceDistance result;
  const Eigen::Vector3d way = p - nearest.surface;
  result.distance = (inside ? -1.0 : 1.0) * way.norm();
  Eigen::Vector3d gradient = result.distance / std::max(way.squaredNorm(), 1e-300) * way;
  if (way.norm() < 1e-9 * shape.half_size.norm()) {  // on the surface: its normal
    gradient = shape.RadialDistanceWithGradient(p).by_point.normalized();
  }
  for (int axis = 0; axis < 3; ++axis) {
    gradient[axis] = std::copysign(gradient[axis], p_object[axis] < 0.0 ? -gradient[axis] : gradient[axis]);
  }
  result.gradient = solid.T_map_object.rotation * gradient;
  return result;
}

DistanceField::DistanceField(const MapSnapshot& map, double sigmas) {
  for (const SnapshotObject& object : map.objects) {
    bodies_.push_back({object.superquadric, object.superquadric.shape.half_size.norm(),
                       sigmas * sigmas * object.fit.covariance.topLeftCorner<3, 3>(), 0.0});
    bodies_.back().grown = std::sqrt(std::max(0.0, bodies_.back().covariance.trace()));
  }
}

SurfaceDistance DistanceField::At(const Eigen::Vector3d& p_map) const {
  SurfaceDistance nearest{std::numeric_limits<double>::infinity(), Eigen::Vector3d::UnitZ()};
  // The radial distance bounds that of the nearest body from above, the spheres bound each from below.
  double bound = std::numeric_limits<double>::infinity();
  const auto least_distance = [&](const Body& body) {
    return (p_map - body.solid.T_map_object.translation).norm() - body.radius - body.grown;
  };
  for (const Body& body : bodies_) {
    if (least_distance(body) < bound) {
      const Eigen::Vector3d p = body.solid.T_map_object.Inverse() * p_map;
      bound = std::min(bound, std::max(0.0, body.solid.shape.RadialDistance(p)));
    }
  }
  for (const Body& body : bodies_) {
    const double least = least_distance(body);
    if (least > bound || least >= nearest.distance) {
      continue;
    }
    SurfaceDistance from = DistanceFrom(body.solid, p_map);
    from.distance -= std::sqrt(std::max(0.0, from.gradient.dot(body.covariance * from.gradient)));
    nearest = from.distance < nearest.distance ? from : nearest;
  }
  return nearest;
}

void DistanceField::At(std::span<const Eigen::Vector3d> points, std::span<double> distances,
                       std::span<Eigen::Vector3d> gradients, int threads) const {
  constexpr std::size_t kBlock = 1024;
  const std::size_t blocks = (points.size() + kBlock - 1) / kBlock;
  ParallelFor(blocks, threads, [&](std::size_t block) {
    for (std::size_t i = block * kBlock; i < std::min(points.size(), (block + 1) * kBlock); ++i) {
      const SurfaceDistance at = At(points[i]);
      distances[i] = at.distance;
      if (!gradients.empty()) {
        gradients[i] = at.gradient;
      }
    }
  });
}

DistanceGrid SampleDistances(const MapSnapshot& map, double cell, double margin, double sigmas) {
  constexpr double kMaxCells = 5e7;
  ThrowIf<InputError>(map.objects.empty(), "the map has no objects to measure distances from");
  Eigen::AlignedBox3d extent;
  for (const SnapshotObject& object : map.objects) {
    const Eigen::Vector3d reach =
        Eigen::Vector3d::Constant(object.superquadric.shape.half_size.norm() + margin);
    extent.extend(Eigen::Vector3d(object.superquadric.T_map_object.translation + reach));
    extent.extend(Eigen::Vector3d(object.superquadric.T_map_object.translation - reach));
  }
  DistanceGrid grid{extent.min(), cell, {}, {}};
  const Eigen::Array3d cells = (extent.sizes().array() / cell).ceil();
  ThrowIf<UsageError>(cells.prod() > kMaxCells,
                      "a grid of {:.0f} x {:.0f} x {:.0f} cells, expected a larger cell", cells.x(),
                      cells.y(), cells.z());
  for (std::size_t i = 0; i < 3; ++i) {
    grid.size[i] = static_cast<int>(cells[static_cast<Eigen::Index>(i)]);
  }
  std::vector<Eigen::Vector3d> centres;
  for (int z = 0; z < grid.size[2]; ++z) {
    for (int y = 0; y < grid.size[1]; ++y) {
      for (int x = 0; x < grid.size[0]; ++x) {
        centres.emplace_back(grid.origin + cell * Eigen::Vector3d(x + 0.5, y + 0.5, z + 0.5));
      }
    }
  }
  std::vector<double> distances(centres.size());
  DistanceField(map, sigmas).At(centres, distances, {});
  grid.distances.assign(distances.begin(), distances.end());
  return grid;
}

void WriteDistanceGrid(const fs::path& path, const DistanceGrid& grid, const MapSnapshot& map) {
  std::string header = fmt::format("{{'descr': '<f4', 'fortran_order': False, 'shape': ({}, {}, {}), }}",
                                   grid.size[2], grid.size[1], grid.size[0]);
  constexpr std::size_t kPrefix = 10, kAlignment = 64;
  header.append(kAlignment - (kPrefix + header.size() + 1) % kAlignment, ' ');
  header += '\n';
  std::string file = "\x93NUMPY";
  file += std::string("\x01\x00", 2);
  file += static_cast<char>(header.size() & 0xFF);
  file += static_cast<char>(header.size() >> 8);
  file += header;
  file.append(reinterpret_cast<const char*>(grid.distances.data()), sizeof(float) * grid.distances.size());
  WriteFileAtomically(path, file);
  WriteFileAtomically(
      fs::path(path).replace_extension(".yaml"),
      fmt::format("distances: {}\norigin: [{:.9g}, {:.9g}, {:.9g}]\ncell: {:.9g}\nsize: [{}, {}, {}]\n"
                  "unit: {}\nframe: map\n",
                  path.filename().string(), grid.origin.x(), grid.origin.y(), grid.origin.z(), grid.cell,
                  grid.size[0], grid.size[1], grid.size[2], FrameOf(map).Unit()));
}

void WriteOccupancyPlan(const fs::path& path, const DistanceGrid& grid) {
  const auto [columns, rows, levels] = grid.size;
  std::string image = fmt::format("P5\n{} {}\n255\n", columns, rows);
  for (int y = rows - 1; y >= 0; --y) {  // the first row of the image is the farthest
    for (int x = 0; x < columns; ++x) {
      bool occupied = false;
      for (int z = 0; z < levels; ++z) {
        occupied = occupied || grid.distances[static_cast<std::size_t>((z * rows + y) * columns + x)] < 0.0F;
      }
      image += static_cast<char>(occupied ? 0 : 254);
    }
  }
  WriteFileAtomically(path, image);
  WriteFileAtomically(fs::path(path).replace_extension(".yaml"),
                      fmt::format("image: {}\nresolution: {:.9g}\norigin: [{:.9g}, {:.9g}, 0]\nnegate: 0\n"
                                  "occupied_thresh: 0.65\nfree_thresh: 0.196\n",
                                  path.filename().string(), grid.cell, grid.origin.x(), grid.origin.y()));
}

}  // namespace sqslam
