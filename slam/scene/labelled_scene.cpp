#include "slam/scene/labelled_scene.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "slam/geometry/superquadric_norm.h"

namespace sqslam {
namespace {

constexpr double kSeatLow = 0.3, kSeatHigh = 0.7;  // range of the height of a seat, shares of the hull's

Eigen::Vector2d DirectionAt(int i) {
  const double angle = 2.0 * std::numbers::pi * i / PlacedSolid::kDirections;
  return {std::cos(angle), std::sin(angle)};
}

const std::array<Eigen::Vector2d, PlacedSolid::kDirections>& Directions() {
  static const auto kAll = [] {
    std::array<Eigen::Vector2d, PlacedSolid::kDirections> all;
    for (int i = 0; i < PlacedSolid::kDirections; ++i) {
      all[static_cast<std::size_t>(i)] = DirectionAt(i);
    }
    return all;
  }();
  return kAll;
}

}  // namespace

PlacedSolid::PlacedSolid(const PosedSuperquadric& superquadric, const ObjectClass& class_traits)
    : solid(superquadric), traits(&class_traits) {
  const double z = solid.T_map_object.translation.z();
  bottom = z - SupportExtent(solid, -Eigen::Vector3d::UnitZ());
  top = z + SupportExtent(solid, Eigen::Vector3d::UnitZ());
  std::ranges::transform(Directions(), extent.begin(), [this](const Eigen::Vector2d& n) {
    return SupportExtent(solid, {n.x(), n.y(), 0.0});
  });
}

double PlacedSolid::HalfWidth() const {
  return std::sqrt(solid.shape.half_size.x() * solid.shape.half_size.y());
}

bool PlacedSolid::IsOver(const Eigen::Vector2d& p) const {
  const Eigen::Vector3d centre = solid.T_map_object.translation;
  const Eigen::Vector3d q =
      solid.T_map_object.rotation.conjugate() * Eigen::Vector3d(p.x() - centre.x(), p.y() - centre.y(), 0.0);
  const Eigen::Vector3d& half = solid.shape.half_size;
  return SuperellipseNorm(q.x() / half.x(), q.y() / half.y(), solid.shape.e2) < 1.0;
}

double PlacedSolid::ShareOver(const PlacedSolid& other, double shrunk) const {
  constexpr int kRings = 4, kTurns = 12;
  int inside = 0;
  for (int ring = 0; ring < kRings; ++ring) {
    const double radius = shrunk * std::sqrt((ring + 0.5) / kRings);  // rings of equal area
    for (int i = 0; i < kTurns; ++i) {
      const double omega = 2.0 * std::numbers::pi * (i + 0.5 * (ring % 2)) / kTurns;
      const Eigen::Vector3d p =
          radius * solid.shape.PointAt(0.0, std::remainder(omega, 2.0 * std::numbers::pi));
      inside += other.IsOver((solid.T_map_object * p).head<2>()) ? 1 : 0;
    }
  }
  return static_cast<double>(inside) / (kRings * kTurns);
}

// The distance of two convex sets is the largest one between parallel lines that separate them.
std::pair<double, Eigen::Vector2d> GapAlong(const PlacedSolid& a, const PlacedSolid& b) {
  const Eigen::Vector2d way = b.Centre() - a.Centre();
  std::pair<double, Eigen::Vector2d> widest(-1e300, Eigen::Vector2d::UnitX());
  for (std::size_t i = 0; i < a.extent.size(); ++i) {
    const std::size_t opposite = (i + a.extent.size() / 2) % a.extent.size();
    const double gap = Directions()[i].dot(way) - a.extent[i] - b.extent[opposite];
    if (gap > widest.first) {
      widest = {gap, Directions()[i]};
    }
  }
  return widest;
}

double Gap(const PlacedSolid& a, const PlacedSolid& b) { return GapAlong(a, b).first; }

double Gap(const PlacedSolid& a, const WallLine& wall) {
  const Eigen::Vector2d from = wall.from - a.Centre(), to = wall.to - a.Centre();
  double gap = -1e300;
  for (std::size_t i = 0; i < a.extent.size(); ++i) {
    gap = std::max(gap, std::min(Directions()[i].dot(from), Directions()[i].dot(to)) - a.extent[i]);
  }
  return gap;
}

namespace {

class Labeller {
 public:
  Labeller(const std::vector<PlacedSolid>& solids, const Room& room) : solids_(solids), room_(room) {}

  std::vector<LabelledRelation> Label() {
    const int count = static_cast<int>(solids_.size());
    place_.resize(solids_.size(), -1);
    for (int a = 0; a < count; ++a) {
      FindPlace(a);
    }
    for (int a = 0; a < count; ++a) {
      for (int b = 0; b < count; ++b) {
        if (a != b && IsUnder(a, b)) {
          Add(RelationKind::kUnder, a, b);
        }
        if (a != b && LeansAgainst(a, b)) {
          Add(RelationKind::kLeansAgainst, a, b);
        } else if (a < b && AreNextTo(a, b)) {
          Add(RelationKind::kNextTo, a, b);
        }
      }
      FindWalls(a);
    }
    return std::move(found_);
  }

 private:
  const PlacedSolid& At(int i) const { return solids_[static_cast<std::size_t>(i)]; }
  int SurfaceNode(std::size_t surface) const { return static_cast<int>(solids_.size() + surface); }
  int FloorNode() const { return SurfaceNode(room_.surfaces.size()); }
  int WallNode(std::size_t wall) const {
    return FloorNode() + (room_.floor ? 1 : 0) + static_cast<int>(wall);
  }
  void Add(RelationKind kind, int subject, int other) { found_.push_back({kind, subject, other}); }

  // Error of the height of a solid's bottom over what it stands on.
  double Tolerance(const PlacedSolid& a) const {
    constexpr double kShare = 0.15;  // of the solid's height
    return std::max({2.0 * room_.tolerance, kShare * a.Height(), 3.0 * a.bottom_sigma});
  }

  // Returns the distance of a bottom from the top of `b`, or from the range of its seat.
  double HeightOver(const PlacedSolid& a, const PlacedSolid& b) const {
    if (!b.traits->back || a.traits->on_floor) {
      return a.bottom - b.top;
    }
    const double seat =
        std::clamp(a.bottom, b.bottom + kSeatLow * b.Height(), b.bottom + kSeatHigh * b.Height());
    return a.bottom - seat;
  }

  bool StandsIn(int a, int b) const {
    constexpr double kDepth = 0.25;  // of its height that a thing reaches into a container
    const PlacedSolid &thing = At(a), &container = At(b);
    return (container.traits->hollow || container.traits->holds) && !container.traits->back &&
           !container.traits->legs && thing.HalfWidth() < container.HalfWidth() &&
           thing.bottom > container.bottom - Tolerance(thing) &&
           thing.bottom < container.top - std::max(Tolerance(thing), kDepth * thing.Height()) &&
           container.IsOver(thing.Centre());
  }

  // Finds what a solid stands on or in: the nearest top below its weight.
  void FindPlace(int a) {
    constexpr double kWeight = 0.5;  // the outline shrunk to its half holds the weight
    const PlacedSolid& thing = At(a);
    double nearest = Tolerance(thing);
    int place = -1;
    for (int b = 0; b < static_cast<int>(solids_.size()); ++b) {
      if (b == a || thing.traits->on_floor || Gap(thing, At(b)) >= 0.0) {
        continue;
      }
      if (StandsIn(a, b)) {
        place_[static_cast<std::size_t>(a)] = b;
        Add(RelationKind::kIn, a, b);
        return;
      }
      if (const double gap = std::abs(HeightOver(thing, At(b)));
          gap < nearest && thing.ShareOver(At(b), kWeight) >= 0.5) {
        nearest = gap, place = b;
      }
    }
    for (std::size_t i = 0; place < 0 && i < room_.surfaces.size(); ++i) {
      if (const double gap = std::abs(thing.bottom - room_.surfaces[i]);
          gap < nearest && !thing.traits->on_floor) {
        nearest = gap, place = SurfaceNode(i);
      }
    }
    const bool near_floor = room_.floor && std::abs(thing.bottom - *room_.floor) < nearest;
    if (room_.floor && (thing.traits->on_floor || (place < 0 && near_floor))) {
      place = FloorNode();
    }
    if (place >= 0) {
      place_[static_cast<std::size_t>(a)] = place;
      Add(RelationKind::kOn, a, place);
    }
  }

  bool StandsOnOrIn(int a, int b) const { return place_[static_cast<std::size_t>(a)] == b; }

  bool IsUnder(int a, int b) const {
    constexpr double kMinShare = 0.3;  // of the outline
    const PlacedSolid &below = At(a), &above = At(b);
    if (StandsOnOrIn(a, b) || StandsOnOrIn(b, a) || Gap(below, above) >= 0.0) {
      return false;
    }
    // A chair may be higher than the table that it is pushed under: its middle counts.
    const double underside = above.traits->legs   ? above.top - kTableTopShare * above.Height()
                             : above.traits->back ? above.bottom + kSeatLow * above.Height()
                                                  : above.bottom + room_.tolerance;
    const double level = above.traits->legs ? 0.5 * (below.bottom + below.top) : below.top;
    return level < underside && below.bottom < above.top - Tolerance(below) &&
           below.HalfWidth() < 2.0 * above.HalfWidth() && below.ShareOver(above, 1.0) >= kMinShare;
  }

  // True if what one of the two touches is as high as a good part of the other.
  static bool ShareHeight(const PlacedSolid& a, const PlacedSolid& b) {
    constexpr double kShare = 0.3;
    const double common = std::min(a.top, b.top) - std::max(a.bottom, b.bottom);
    return common > kShare * std::min(a.Height(), b.Height());
  }

  bool AreNextTo(int a, int b) const {
    const PlacedSolid &first = At(a), &second = At(b);
    const int place = place_[static_cast<std::size_t>(a)];
    const bool same_place = place >= 0 && place == place_[static_cast<std::size_t>(b)];
    if (StandsOnOrIn(a, b) || StandsOnOrIn(b, a) || IsUnder(a, b) || IsUnder(b, a) || LeansAgainst(b, a) ||
        !(same_place || ShareHeight(first, second))) {
      return false;
    }
    return Gap(first, second) <= std::sqrt(first.HalfWidth() * second.HalfWidth());
  }

  // True for a thing of which a push at its top moves the weight beyond its foot: higher than five times its
  // depth.
  static bool IsSlender(const PlacedSolid& a) {
    constexpr double kSlender = 5.0;
    return !a.traits->on_floor && a.Height() > kSlender * 2.0 * a.solid.shape.half_size.head<2>().minCoeff();
  }

  bool LeansAgainst(int a, int b) const {
    constexpr double kReach = 0.4;  // of the thing's height that the other must reach up
    const PlacedSolid &thing = At(a), &other = At(b);
    return IsSlender(thing) && other.solid.shape.Volume() > thing.solid.shape.Volume() &&
           !StandsOnOrIn(a, b) && !StandsOnOrIn(b, a) && other.top > thing.bottom + kReach * thing.Height() &&
           other.bottom < thing.top && ShareHeight(thing, other) && Gap(thing, other) < Touch(thing);
  }

  // Greatest gap of two solids that touch.
  double Touch(const PlacedSolid& a) const {
    constexpr double kShare = 0.5;  // of the thickness
    return std::max(room_.tolerance, kShare * a.solid.shape.half_size.head<2>().minCoeff());
  }

  void FindWalls(int a) {
    const PlacedSolid& thing = At(a);
    for (std::size_t i = 0; i < room_.walls.size(); ++i) {
      const double gap = Gap(thing, room_.walls[i]);
      if (IsSlender(thing) && gap < Touch(thing)) {
        Add(RelationKind::kLeansAgainst, a, WallNode(i));
      } else if (gap < thing.HalfWidth()) {
        Add(RelationKind::kNextTo, a, WallNode(i));
      }
    }
  }

  const std::vector<PlacedSolid>& solids_;
  const Room& room_;
  std::vector<int> place_;  // of each solid: what it stands on or in; -1: unknown
  std::vector<LabelledRelation> found_;
};

}  // namespace

std::vector<LabelledRelation> LabelRelations(const std::vector<PlacedSolid>& solids, const Room& room) {
  return Labeller(solids, room).Label();
}

}  // namespace sqslam
