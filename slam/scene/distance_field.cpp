#include "slam/scene/distance_field.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "slam/io/map_frame.h"
#include "slam/scene/distance_table.h"
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
  Eigen::Vector2d at;  // profile and section
  Eigen::Vector3d surface;
  double cost = 0.0;
  Eigen::Vector2d gradient;
  Eigen::Matrix2d hessian;

  Approach(const Superquadric& shape, const Eigen::Vector3d& p, const Eigen::Vector2d& angles) : at(angles) {
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

// Returns by how much the surface point is at most farther from an outer point than the nearest one. All of a
// convex solid lies behind its support plane across the way: the distance from the plane is a lower bound.
double DualityGap(const Superquadric& shape, const Eigen::Vector3d& p, const Approach& approach) {
  const Eigen::Vector3d way = p - approach.surface;
  const double length = way.norm();
  return length > 0.0 ? length - (way.dot(p) - shape.SupportExtent(way)) / length : 0.0;
}

// Maximises a function of an angle in [0, pi / 2] with one maximum by golden sections. Returns angle and
// value.
std::pair<double, double> MaximumOf(const auto& function) {
  constexpr int kRounds = 44;  // to 1e-9
  constexpr double kGolden = std::numbers::phi - 1.0;
  double low = 0.0, high = kQuarter;
  double a = high - kGolden * (high - low), b = low + kGolden * (high - low);
  double at_a = function(a), at_b = function(b);
  for (int i = 0; i < kRounds; ++i) {
    if (at_a >= at_b) {
      high = b;
      b = a;
      at_b = at_a;
      a = high - kGolden * (high - low);
      at_a = function(a);
    } else {
      low = a;
      a = b;
      at_a = at_b;
      b = low + kGolden * (high - low);
      at_b = function(b);
    }
  }
  return at_a >= at_b ? std::pair(a, at_a) : std::pair(b, at_b);
}

// Returns the surface point nearest to an outer point in the first octant: on the support plane that is
// farthest from it. The distance from the plane has one maximum along every great circle of normals, so that
// nested searches find it, whatever the exponents; slowly.
Eigen::Vector3d ProjectByPlanes(const Superquadric& shape, const Eigen::Vector3d& p) {
  const auto normal = [](double along, double around) {
    return Eigen::Vector3d(std::cos(along) * std::cos(around), std::cos(along) * std::sin(around),
                           std::sin(along));
  };
  const auto best_along = [&](double around) {
    return MaximumOf([&](double along) {
      const Eigen::Vector3d n = normal(along, around);
      return n.dot(p) - shape.SupportExtent(n);
    });
  };
  const double around = MaximumOf([&](double angle) { return best_along(angle).second; }).first;
  const auto [along, distance] = best_along(around);
  return p - distance * normal(along, around);
}

// Returns the nearest surface point of a point in the first octant.
Approach Nearest(const Superquadric& shape, const Eigen::Vector3d& p, bool inside) {
  const Eigen::Vector3d unit = p.cwiseQuotient(shape.half_size);
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
  // A descent may end at an edge or a ridge, where the cost is far from quadratic.
  const auto is_farther = [&] {
    return !inside && DualityGap(shape, p, nearest) > 1e-9 * shape.half_size.norm();
  };
  constexpr int kStarts = 4;
  for (int i = 0; i < kStarts * kStarts && is_farther(); ++i) {
    const Eigen::Vector2d start(i / kStarts + 0.5, i % kStarts + 0.5);
    const Approach found = Descend(shape, p, kQuarter / kStarts * start);
    nearest = found.cost < nearest.cost ? found : nearest;
  }
  if (is_farther()) {
    nearest.surface = ProjectByPlanes(shape, p);
    nearest.at = AnglesOf(nearest.surface.cwiseMax(0.0).cwiseQuotient(shape.half_size), shape.e2);
  }
  return nearest;
}

}  // namespace

Eigen::Vector2d NearestAngles(const Superquadric& shape, const Eigen::Vector3d& p_octant) {
  return Nearest(shape, p_octant, shape.RadialScale(p_octant) < 1.0).at;
}

SurfaceDistance DistanceFrom(const PosedSuperquadric& solid, const Eigen::Vector3d& p_map) {
  const Superquadric& shape = solid.shape;
  const Eigen::Vector3d p_object = solid.T_map_object.Inverse() * p_map;
  const Eigen::Vector3d p = p_object.cwiseAbs();
  const bool inside = shape.RadialScale(p) < 1.0;
  const Approach nearest = Nearest(shape, p, inside);
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
    const Rigid3d T_object_map = object.superquadric.T_map_object.Inverse();
    bodies_.push_back({object.superquadric, T_object_map.rotation.toRotationMatrix(),
                       T_object_map.translation,
                       sigmas * sigmas * object.fit.covariance.topLeftCorner<3, 3>(), 0.0});
    bodies_.back().grown = std::sqrt(std::max(0.0, bodies_.back().covariance.trace()));
  }
}

double DistanceField::LeastDistance(const Body& body, const Eigen::Vector3d& p_map) {
  const Eigen::Vector3d p = body.R_object_map * p_map + body.t_object_map;
  const Eigen::Vector3d past = p.cwiseAbs() - body.solid.shape.half_size;
  return std::min(0.0, past.maxCoeff()) + past.cwiseMax(0.0).norm() - body.grown;
}

// Returns a table for each body that is probably the nearest or next to it for enough points.
std::vector<std::unique_ptr<DistanceTable>> DistanceField::MakeTables(std::span<const Eigen::Vector3d> points,
                                                                      int threads) const {
  constexpr std::size_t kMinPoints = 20'000, kSamples = 1000;
  std::vector<std::unique_ptr<DistanceTable>> tables(bodies_.size());
  if (points.size() < kMinPoints) {
    return tables;
  }
  std::vector<std::size_t> samples(bodies_.size(), 0);
  for (std::size_t i = 0; i < kSamples && !bodies_.empty(); ++i) {
    const Eigen::Vector3d& p = points[i * points.size() / kSamples];
    std::array<std::pair<double, std::size_t>, 2> least;
    least.fill({std::numeric_limits<double>::infinity(), 0});
    for (std::size_t b = 0; b < bodies_.size(); ++b) {
      const std::pair candidate(LeastDistance(bodies_[b], p), b);
      least[1] = std::min(least[1], std::max(candidate, least[0]));
      least[0] = std::min(least[0], candidate);
    }
    for (const auto& [distance, b] : least) {
      samples[b] += std::isinf(distance) ? 0 : 1;
    }
  }
  for (std::size_t b = 0; b < bodies_.size(); ++b) {
    const Superquadric& shape = bodies_[b].solid.shape;
    if (std::max(shape.e1, shape.e2) <= 1.0 && samples[b] * points.size() / kSamples >= kMinPoints) {
      tables[b] = std::make_unique<DistanceTable>(bodies_[b].solid, threads);
    }
  }
  return tables;
}

// A part of the points, and what is known of them so far.
struct DistanceField::Part {
  std::span<const Eigen::Vector3d> points;
  std::vector<double> least;             // of each body: lower bounds of the distances
  std::vector<SurfaceDistance> nearest;  // of the bodies asked so far
  std::vector<std::size_t> asked;        // points of the present body
  std::vector<Eigen::Vector3d> asked_points;
  std::vector<SurfaceDistance> answers;
};

void DistanceField::Ask(std::size_t body_index, const DistanceTable* table, Part& part) const {
  const Body& body = bodies_[body_index];
  part.asked_points.clear();
  for (const std::size_t i : part.asked) {
    part.asked_points.push_back(part.points[i]);
  }
  part.answers.resize(part.asked.size());
  if (table != nullptr) {
    table->At(part.asked_points, part.answers);
  } else {
    std::ranges::transform(part.asked_points, part.answers.begin(),
                           [&body](const Eigen::Vector3d& p) { return DistanceFrom(body.solid, p); });
  }
  for (std::size_t k = 0; k < part.asked.size(); ++k) {
    SurfaceDistance& from = part.answers[k];
    if (body.grown > 0.0) {
      from.distance -= std::sqrt(std::max(0.0, from.gradient.dot(body.covariance * from.gradient)));
    }
    SurfaceDistance& nearest = part.nearest[part.asked[k]];
    nearest = from.distance < nearest.distance ? from : nearest;
  }
}

void DistanceField::Solve(const std::vector<std::unique_ptr<DistanceTable>>& tables, Part& part) const {
  const std::size_t count = part.points.size();
  part.least.resize(bodies_.size() * count);
  part.nearest.assign(count, {std::numeric_limits<double>::infinity(), Eigen::Vector3d::UnitZ()});
  std::vector<std::size_t> first(count, 0);  // the body with the least bound
  for (std::size_t b = 0; b < bodies_.size(); ++b) {
    for (std::size_t i = 0; i < count; ++i) {
      part.least[b * count + i] = LeastDistance(bodies_[b], part.points[i]);
      first[i] = part.least[b * count + i] < part.least[first[i] * count + i] ? b : first[i];
    }
  }
  for (const bool others : {false, true}) {  // then those that may be nearer yet
    for (std::size_t b = 0; b < bodies_.size(); ++b) {
      part.asked.clear();
      for (std::size_t i = 0; i < count; ++i) {
        if (others ? first[i] != b && part.least[b * count + i] < part.nearest[i].distance : first[i] == b) {
          part.asked.push_back(i);
        }
      }
      Ask(b, tables[b].get(), part);
    }
  }
}

SurfaceDistance DistanceField::At(const Eigen::Vector3d& p_map) const {
  SurfaceDistance nearest;
  At({&p_map, 1}, {&nearest.distance, 1}, {&nearest.gradient, 1}, 1);
  return nearest;
}

void DistanceField::At(std::span<const Eigen::Vector3d> points, std::span<double> distances,
                       std::span<Eigen::Vector3d> gradients, int threads) const {
  constexpr std::size_t kBlock = 1024;
  const std::vector<std::unique_ptr<DistanceTable>> tables = MakeTables(points, threads);
  ParallelFor((points.size() + kBlock - 1) / kBlock, threads, [&](std::size_t block) {
    const std::size_t begin = block * kBlock;
    Part part{points.subspan(begin, std::min(kBlock, points.size() - begin)), {}, {}, {}, {}, {}};
    Solve(tables, part);
    for (std::size_t i = 0; i < part.nearest.size(); ++i) {
      distances[begin + i] = part.nearest[i].distance;
      if (!gradients.empty()) {
        gradients[begin + i] = part.nearest[i].gradient;
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
