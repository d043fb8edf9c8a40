#include "slam/scene/distance_table.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "slam/util/parallel.h"
#include "slam/util/wide_registers.h"

namespace sqslam {
namespace {

// Four numbers, which GCC and Clang keep in one or two registers of the processor.
using Wide = double __attribute__((vector_size(32)));
using WideBits = std::int64_t __attribute__((vector_size(32)));
constexpr std::size_t kLanes = 4;

// Functions of wide numbers, inlined so that they are compiled for the same processor as their caller.
#define SQSLAM_INLINE __attribute__((always_inline)) inline

SQSLAM_INLINE Wide Larger(Wide a, Wide b) { return a > b ? a : b; }
SQSLAM_INLINE Wide Smaller(Wide a, Wide b) { return a < b ? a : b; }
SQSLAM_INLINE Wide Size(Wide a) { return a < 0.0 ? -a : a; }
SQSLAM_INLINE Wide Root(Wide a) {
  Wide root = a;
  for (std::size_t i = 0; i < kLanes; ++i) {
    root[i] = std::sqrt(a[i]);
  }
  return root;
}

// Natural logarithm of a positive, normal number to 1e-12: of its mantissa by the series of artanh. With
// Eigen's logarithm and exponential, which know two lanes here, a solid takes 1.3 times as long.
SQSLAM_INLINE Wide Log(Wide x) {
  const auto bits = reinterpret_cast<WideBits>(x);
  const Wide two52 = Wide{} + 4503599627370496.0;
  Wide exponent = reinterpret_cast<Wide>((bits >> 52) | reinterpret_cast<WideBits>(two52)) - two52 - 1023.0;
  Wide m = reinterpret_cast<Wide>((bits & 0xFFFFFFFFFFFFF) | 0x3FF0000000000000);
  const WideBits high = m > std::numbers::sqrt2;
  m = high ? 0.5 * m : m;
  exponent = high ? exponent + 1.0 : exponent;
  const Wide s = (m - 1.0) / (m + 1.0), z = s * s;
  const Wide series =
      1.0 + z * (1.0 / 3 + z * (1.0 / 5 + z * (1.0 / 7 + z * (1.0 / 9 + z * (1.0 / 11 + z * (1.0 / 13))))));
  return exponent * std::numbers::ln2 + 2.0 * s * series;
}

// Exponential function to 1e-12, 0 below -700.
SQSLAM_INLINE Wide Exp(Wide x) {
  const Wide bounded = Smaller(Larger(x, Wide{} - 700.0), Wide{} + 700.0);
  const Wide shift = Wide{} + 6755399441055744.0;  // 1.5 * 2^52: adding it rounds to an integer
  const Wide shifted = bounded * std::numbers::log2e + shift;
  const Wide r = bounded - (shifted - shift) * std::numbers::ln2;
  Wide series = Wide{} + 1.0;
  for (int i = 11; i > 0; --i) {
    series = 1.0 + series * r * (1.0 / i);
  }
  const Wide power = reinterpret_cast<Wide>((reinterpret_cast<WideBits>(shifted) + 1023) << 52);
  return x < -700.0 ? Wide{} : series * power;
}

// Cosine and sine of an angle in [0, pi / 2].
SQSLAM_INLINE void CosSin(Wide angle, Wide& c, Wide& s) {
  const Wide t = angle - 0.25 * std::numbers::pi, z = t * t;
  const Wide cosine =
      1.0 - z * (1.0 / 2 - z * (1.0 / 24 - z * (1.0 / 720 - z * (1.0 / 40320 - z * (1.0 / 3628800)))));
  const Wide sine =
      t *
      (1.0 - z * (1.0 / 6 - z * (1.0 / 120 - z * (1.0 / 5040 - z * (1.0 / 362880 - z * (1.0 / 39916800))))));
  constexpr double kHalf = std::numbers::sqrt2 / 2.0;
  c = Larger(kHalf * (cosine - sine), Wide{});
  s = Larger(kHalf * (cosine + sine), Wide{});
}

// CurvePoint of distance_field.cpp for four angles: a point of the unit superellipse and its derivatives.
struct WideCurve {
  Wide x, y, x1, y1, x2, y2;
};

SQSLAM_INLINE WideCurve CurveAt(Wide angle, double e) {
  const double p = 2.0 / e;
  Wide c, s;
  CosSin(angle, c, s);
  const WideBits steep = s > c;
  const Wide larger = steep ? s : c;
  const Wide t = Larger((steep ? c : s) / larger, Wide{} + 1e-9);
  const Wide power = Exp((p - 2.0) * Log(t));  // t^(p - 2)
  const Wide g = 1.0 + power * t * t;
  Wide g1 = p * t * (power - 1.0);
  g1 = steep ? -g1 : g1;
  const Wide g2 = p * ((p - 1.0) * (t * t + power) - g);
  const Wide r = Exp(Log(g) * (-1.0 / p)) / larger;
  const Wide slope = g1 / (p * g), r1 = -r * slope;
  const Wide r2 = -(r1 * g1 + r * (g2 - g1 * g1 / g)) / (p * g);
  return {r * c,
          r * s,
          r1 * c - r * s,
          r1 * s + r * c,
          r2 * c - 2.0 * r1 * s - r * c,
          r2 * s + 2.0 * r1 * c - r * s};
}

struct WideVector {
  Wide x, y, z;
};
SQSLAM_INLINE Wide Dot(const WideVector& a, const WideVector& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

// The last shell of nodes, at 999 half sizes: beyond it only the direction of a point counts.
constexpr double kMaxShell = 0.999;
constexpr double kQuarterTurn = 0.5 * std::numbers::pi;

}  // namespace

// Four points in the first octant, by coordinate, with the angles of their nearest surface points.
struct DistanceTable::Block {
  Wide x, y, z;
  Wide profile, section;
  Wide distance;
  Wide gx, gy, gz;
  WideBits solved;
};

std::size_t DistanceTable::Index(int face, int shell, int first, int second) const {
  return static_cast<std::size_t>(((face * kNodes + shell) * kNodes + first) * kNodes + second);
}

DistanceTable::DistanceTable(const PosedSuperquadric& solid, int threads)
    : solid_(solid), angles_(Index(3, 0, 0, 0)), ambiguous_(angles_.size(), false) {
  const Superquadric& shape = solid.shape;
  std::vector<std::uint8_t> inside(angles_.size());
  ParallelFor(angles_.size(), threads, [&](std::size_t i) {
    const auto digit = [&](std::size_t unit) {
      return static_cast<double>(i / unit % kNodes) / (kNodes - 1);
    };
    const std::size_t face = i / (kNodes * kNodes * kNodes);
    const double share = std::min(digit(kNodes * kNodes), kMaxShell), reach = share / (1.0 - share);
    Eigen::Vector3d unit;
    unit[static_cast<Eigen::Index>(face)] = reach;
    unit[static_cast<Eigen::Index>((face + 1) % 3)] = reach * digit(kNodes);
    unit[static_cast<Eigen::Index>((face + 2) % 3)] = reach * digit(1);
    const Eigen::Vector3d p = unit.cwiseProduct(shape.half_size);
    const Eigen::Vector2d angles = NearestAngles(shape, p);
    angles_[i] = {static_cast<float>(angles[0]), static_cast<float>(angles[1])};
    inside[i] = shape.RadialScale(p) < 1.0 ? 1 : 0;
  });
  const auto corners = [](auto&& visit) {
    for (int k = 0; k < 8; ++k) {
      visit(k >> 2, (k >> 1) & 1, k & 1);
    }
  };
  for (std::size_t i = 0; i < angles_.size(); ++i) {
    const std::size_t side = kNodes, slice = kNodes * kNodes;
    if (i % side + 1 == side || i / side % side + 1 == side || i / slice % side + 1 == side) {
      continue;  // the last nodes begin no cells
    }
    std::array<float, 2> low = angles_[i], high = angles_[i];
    bool within = false;
    corners([&](int a, int b, int c) {
      const std::size_t at = i + slice * static_cast<std::size_t>(a) + side * static_cast<std::size_t>(b) +
                             static_cast<std::size_t>(c);
      within = within || inside[at] != 0;
      for (std::size_t k = 0; k < 2; ++k) {
        low[k] = std::min(low[k], angles_[at][k]);
        high[k] = std::max(high[k], angles_[at][k]);
      }
    });
    constexpr float kMaxSpread = 0.05F;  // radians
    ambiguous_[i] = within && std::max(high[0] - low[0], high[1] - low[1]) > kMaxSpread;
  }
}

void DistanceTable::Begin(const Eigen::Vector3d& p, std::size_t lane, Block& block) const {
  const Eigen::Vector3d unit = p.cwiseQuotient(solid_.shape.half_size);
  Eigen::Index face = 0;
  const double reach = std::max(unit.maxCoeff(&face), 1e-12);
  const auto place = [](double share, int& cell) {
    const double at = share * (kNodes - 1);
    cell = std::min(static_cast<int>(at), kNodes - 2);
    return at - cell;
  };
  int shell = 0, first = 0, second = 0;
  const double u = place(std::min(reach / (1.0 + reach), kMaxShell), shell);
  const double v = place(unit[(face + 1) % 3] / reach, first),
               w = place(unit[(face + 2) % 3] / reach, second);
  const std::size_t at = Index(static_cast<int>(face), shell, first, second);
  double angles[2] = {0.0, 0.0};
  for (std::size_t k = 0; k < 2; ++k) {
    const auto row = [&](std::size_t from) {
      return (1.0 - w) * static_cast<double>(angles_[from][k]) +
             w * static_cast<double>(angles_[from + 1][k]);
    };
    const auto side = [&](std::size_t from) { return (1.0 - v) * row(from) + v * row(from + kNodes); };
    angles[k] = (1.0 - u) * side(at) + u * side(at + kNodes * kNodes);
  }
  block.x[lane] = p.x();
  block.y[lane] = p.y();
  block.z[lane] = p.z();
  block.profile[lane] = angles[0];
  block.section[lane] = angles[1];
  block.solved[lane] = ambiguous_[at] ? 0 : -1;
}

SQSLAM_WIDE_REGISTERS void DistanceTable::Solve(Block& block) const {
  constexpr int kSteps = 6;
  const Superquadric& shape = solid_.shape;
  const double a = shape.half_size.x(), b = shape.half_size.y(), c = shape.half_size.z();
  const double size = shape.half_size.norm(), close = 1e-5 * size;
  const Wide zero{}, quarter = Wide{} + kQuarterTurn, tiny = Wide{} + 1e-14 * size * size;
  WideBits going = block.solved;
  WideBits arrived{};
  for (int step = 0; step < kSteps; ++step) {
    const WideCurve profile = CurveAt(block.profile, shape.e1), section = CurveAt(block.section, shape.e2);
    const WideVector surface{a * profile.x * section.x, b * profile.x * section.y, c * profile.y};
    const WideVector error{surface.x - block.x, surface.y - block.y, surface.z - block.z};
    const WideVector by_profile{a * profile.x1 * section.x, b * profile.x1 * section.y, c * profile.y1};
    const WideVector by_section{a * profile.x * section.x1, b * profile.x * section.y1, zero};
    Wide g0 = Dot(error, by_profile), g1 = Dot(error, by_section);
    const Wide first = Dot(by_profile, by_profile), second = Dot(by_section, by_section);
    Wide h00 = first + Dot(error, {a * profile.x2 * section.x, b * profile.x2 * section.y, c * profile.y2});
    Wide h11 = second + Dot(error, {a * profile.x * section.x2, b * profile.x * section.y2, zero});
    Wide h01 = Dot(by_profile, by_section) +
               Dot(error, {a * profile.x1 * section.x1, b * profile.x1 * section.y1, zero});
    // An angle at its bound that the cost pushes outwards stays there.
    const WideBits hold0 =
        ((block.profile <= zero) & (g0 >= zero)) | ((block.profile >= quarter) & (g0 <= zero));
    const WideBits hold1 =
        ((block.section <= zero) & (g1 >= zero)) | ((block.section >= quarter) & (g1 <= zero));
    g0 = hold0 ? zero : g0;
    g1 = hold1 ? zero : g1;
    h01 = (hold0 | hold1) ? zero : h01;
    h00 = Larger(h00, Larger(0.05 * first, tiny));
    h11 = Larger(h11, Larger(0.05 * second, tiny));
    Wide det = h00 * h11 - h01 * h01;
    const WideBits flat = det < 0.02 * h00 * h11;
    h01 = flat ? zero : h01;
    det = flat ? h00 * h11 : det;
    const Wide before0 = block.profile, before1 = block.section;
    block.profile = Smaller(Larger(before0 - (h11 * g0 - h01 * g1) / det, zero), quarter);
    block.section = Smaller(Larger(before1 - (h00 * g1 - h01 * g0) / det, zero), quarter);
    const Wide d0 = block.profile - before0, d1 = block.section - before1;
    const Wide moved = first * d0 * d0 + second * d1 * d1;  // squared, along the surface
    // The way to the surface point, corrected for the last step, which is so short that its square is
    // nothing.
    const WideVector way{-error.x - by_profile.x * d0 - by_section.x * d1,
                         -error.y - by_profile.y * d0 - by_section.y * d1, -error.z - by_profile.z * d0};
    const Wide length = Root(Dot(way, way));
    const Wide sign = way.x + way.y + way.z < zero ? zero - 1.0 : zero + 1.0;
    const WideBits now = going & (moved < close * close) & (length > close);
    block.distance = now ? sign * length : block.distance;
    block.gx = now ? sign * way.x / length : block.gx;
    block.gy = now ? sign * way.y / length : block.gy;
    block.gz = now ? sign * way.z / length : block.gz;
    arrived |= now;
    going &= ~now;
    if ((going[0] | going[1] | going[2] | going[3]) == 0) {
      break;
    }
  }
  // As the solid is convex, the plane across the way bounds the distance from below: here it must be as far.
  const Wide power2 = Wide{} + 2.0 / (2.0 - shape.e2), power1 = Wide{} + 2.0 / (2.0 - shape.e1);
  const Wide nx = Larger(a * Size(block.gx), tiny), ny = Larger(b * Size(block.gy), tiny);
  const Wide nz = Larger(c * Size(block.gz), tiny);
  const Wide section = Exp(power2 * Log(nx)) + Exp(power2 * Log(ny));
  const Wide profile = Exp(power1 / power2 * Log(section)) + Exp(power1 * Log(nz));
  const Wide extent = Exp(Log(profile) / power1);
  const Wide plane = block.x * block.gx + block.y * block.gy + block.z * block.gz - extent;
  block.solved = arrived & ((block.distance < zero) | (block.distance - plane < 3e-8 * size));
}

// Solves for a point inside the solid from four starts: where the table has it, and at the faces. False if
// one of them did not end.
bool DistanceTable::SolveInside(const Eigen::Vector3d& p, Block& block) const {
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    Eigen::Vector3d toward = p;
    if (lane < 3) {
      const auto axis = static_cast<Eigen::Index>(lane);
      toward[axis] = std::max(toward[axis], solid_.shape.half_size[axis]);
    }
    Begin(toward, lane, block);
    block.x[lane] = p.x();
    block.y[lane] = p.y();
    block.z[lane] = p.z();
    block.solved[lane] = -1;
  }
  Solve(block);
  std::size_t nearest = 0;
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    if (block.solved[lane] == 0 || block.distance[lane] > 0.0) {
      return false;
    }
    nearest = block.distance[lane] > block.distance[nearest] ? lane : nearest;
  }
  block.distance[0] = block.distance[nearest];
  block.gx[0] = block.gx[nearest];
  block.gy[0] = block.gy[nearest];
  block.gz[0] = block.gz[nearest];
  return true;
}

void DistanceTable::At(std::span<const Eigen::Vector3d> points, std::span<SurfaceDistance> found) const {
  const Rigid3d T_object_map = solid_.T_map_object.Inverse();
  const Eigen::Matrix3d R_object_map = T_object_map.rotation.toRotationMatrix();
  const Eigen::Matrix3d R_map_object = R_object_map.transpose();
  Block block{}, inside{};
  Eigen::Vector3d p_object[kLanes];
  const auto set = [&](const Block& solved, std::size_t from, const Eigen::Vector3d& p,
                       SurfaceDistance& result) {
    result.distance = solved.distance[from];
    result.gradient = R_map_object * Eigen::Vector3d(std::copysign(1.0, p.x()) * solved.gx[from],
                                                     std::copysign(1.0, p.y()) * solved.gy[from],
                                                     std::copysign(1.0, p.z()) * solved.gz[from]);
  };
  for (std::size_t i = 0; i < points.size(); i += kLanes) {
    const std::size_t count = std::min(kLanes, points.size() - i);
    bool ambiguous[kLanes] = {};
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      p_object[lane] = R_object_map * points[i + std::min(lane, count - 1)] + T_object_map.translation;
      Begin(p_object[lane].cwiseAbs(), lane, block);
      ambiguous[lane] = block.solved[lane] == 0;
    }
    Solve(block);
    for (std::size_t lane = 0; lane < count; ++lane) {
      if (block.solved[lane] != 0) {
        set(block, lane, p_object[lane], found[i + lane]);
      } else if (ambiguous[lane] && SolveInside(p_object[lane].cwiseAbs(), inside)) {
        set(inside, 0, p_object[lane], found[i + lane]);
      } else {
        found[i + lane] = DistanceFrom(solid_, points[i + lane]);
      }
    }
  }
}

#undef SQSLAM_INLINE

}  // namespace sqslam
