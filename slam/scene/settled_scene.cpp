#include "slam/scene/settled_scene.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "slam/scene/labelled_scene.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace {

constexpr double kSeatShare = 0.5;  // height of a seat on which nothing lies

double BottomOf(const PosedSuperquadric& solid) {
  return solid.T_map_object.translation.z() - SupportExtent(solid, -Eigen::Vector3d::UnitZ());
}
double TopOf(const PosedSuperquadric& solid) {
  return solid.T_map_object.translation.z() + SupportExtent(solid, Eigen::Vector3d::UnitZ());
}

// Finds for each object what it most likely stands on or in.
std::vector<SettledObject> PlaceObjects(const MapSnapshot& map, const SceneGraph& graph,
                                        const ClassTable& classes) {
  std::vector<SettledObject> objects;
  for (const SnapshotObject& object : map.objects) {
    objects.push_back({object.superquadric});
    objects.back().fixed = classes.Of(object.label).on_floor;
  }
  std::vector<double> best(objects.size(), 0.3);  // less is no place
  for (const SceneRelation& relation : graph.relations) {
    const auto i = static_cast<std::size_t>(relation.subject);
    const bool inside = relation.kind == RelationKind::kIn;
    if ((inside || relation.kind == RelationKind::kOn) && relation.probability > best[i]) {
      best[i] = relation.probability;
      objects[i].place = relation.other;
      objects[i].inside = inside;
    }
  }
  for (SettledObject& object : objects) {
    object.fixed = object.fixed || object.inside || object.place < 0;
  }
  return objects;
}

class Settler {
 public:
  Settler(const MapSnapshot& map, const SceneGraph& graph, const ClassTable& classes, double clearance)
      : graph_(graph), clearance_(clearance), scene_{PlaceObjects(map, graph, classes)} {
    constexpr double kDefault = 1e-3;  // of the size: standard deviation of what has no covariance
    for (const SnapshotObject& object : map.objects) {
      const double sigma = kDefault * object.superquadric.shape.half_size.maxCoeff();
      covariances_.emplace_back(object.fit.covariance.topLeftCorner<3, 3>() +
                                sigma * sigma * Eigen::Matrix3d::Identity());
      traits_.push_back(&classes.Of(object.label));
    }
    shifts_.assign(map.objects.size(), Eigen::Vector3d::Zero());
    start_ = scene_.objects;
  }

  SettledScene Settle() {
    constexpr int kRounds = 60;
    const int count = static_cast<int>(scene_.objects.size());
    for (int round = 0; round < kRounds; ++round) {
      for (int i = 0; i < count; ++i) {
        StandOnPlace(i);
      }
      for (int i = 0; i < count; ++i) {
        for (int j = i + 1; j < count; ++j) {
          Separate(i, j);
        }
      }
    }
    for (int i = 0; i < count; ++i) {
      SettledObject& object = At(i);
      const Eigen::Vector3d& d = shifts_[Index(i)];
      object.shift = d.norm();
      object.sigmas = std::sqrt(d.dot(covariances_[Index(i)].inverse() * d));
    }
    return std::move(scene_);
  }

 private:
  static std::size_t Index(int i) { return static_cast<std::size_t>(i); }
  SettledObject& At(int i) { return scene_.objects[Index(i)]; }
  bool IsObject(int node) const { return node >= 0 && node < static_cast<int>(scene_.objects.size()); }

  void Move(int i, const Eigen::Vector3d& by) {
    shifts_[Index(i)] += by;
    At(i).solid.T_map_object.translation =
        start_[Index(i)].solid.T_map_object.translation + shifts_[Index(i)];
  }

  // Moves one or two bodies by the least Mahalanobis distance that moves them `amount` along `n`, the second
  // against it. -1: a part of the room, which stays.
  void Push(int i, int j, const Eigen::Vector3d& n, double amount) {
    const Eigen::Vector3d a = covariances_[Index(i)] * n;
    const Eigen::Vector3d b =
        IsObject(j) ? Eigen::Vector3d(covariances_[Index(j)] * n) : Eigen::Vector3d::Zero();
    const double lambda = amount / (n.dot(a) + n.dot(b));
    Move(i, lambda * a);
    if (IsObject(j)) {
      Move(j, -lambda * b);
    }
  }

  void StandOnPlace(int i) {
    const int place = At(i).place;
    if (place < 0 || At(i).inside) {
      return;
    }
    double height = 0.0;
    if (!IsObject(place)) {
      height = graph_.nodes[Index(place)].height;
    } else if (traits_[Index(place)]->back) {
      return;  // the seat is where the thing lies
    } else {
      height = TopOf(At(place).solid);
    }
    Push(i, place, Eigen::Vector3d::UnitZ(), height - BottomOf(At(i).solid));
  }

  void Separate(int i, int j) {
    const SettledObject &a = At(i), &b = At(j);
    if ((a.fixed && b.fixed) || a.place == j || b.place == i) {
      return;
    }
    const SolidSpan first = SolidSpanOf(scene_, i, *traits_[Index(i)]);
    const SolidSpan second = SolidSpanOf(scene_, j, *traits_[Index(j)]);
    constexpr double kTouch = 1e-3;  // of the height: one stands on the other
    const double common = std::min(first.top, second.top) - std::max(first.bottom, second.bottom);
    if (common < kTouch * std::max(first.top - first.bottom, second.top - second.bottom)) {
      return;
    }
    const PlacedSolid p(a.solid, *traits_[Index(i)]), q(b.solid, *traits_[Index(j)]);
    const auto [gap, direction] = GapAlong(p, q);
    if (gap < clearance_) {
      Push(i, j, {-direction.x(), -direction.y(), 0.0}, clearance_ - gap);
    }
  }

  const SceneGraph& graph_;
  double clearance_;
  SettledScene scene_;
  std::vector<SettledObject> start_;
  std::vector<Eigen::Matrix3d> covariances_;  // of the centres
  std::vector<const ObjectClass*> traits_;
  std::vector<Eigen::Vector3d> shifts_;
};

}  // namespace

SolidSpan SolidSpanOf(const SettledScene& scene, int object, const ObjectClass& traits) {
  const PosedSuperquadric& solid = scene.objects[static_cast<std::size_t>(object)].solid;
  SolidSpan span{BottomOf(solid), TopOf(solid)};
  if (traits.legs) {
    span.bottom = span.top - kTableTopShare * (span.top - span.bottom);
  } else if (traits.back) {
    double seat = span.bottom + kSeatShare * (span.top - span.bottom);
    bool used = false;
    for (const SettledObject& thing : scene.objects) {
      if (thing.place == object && !thing.inside) {
        seat = used ? std::min(seat, BottomOf(thing.solid)) : BottomOf(thing.solid);
        used = true;
      }
    }
    span.top = seat;
  }
  return span;
}

SettledScene Settle(const MapSnapshot& map, const SceneGraph& graph, const ClassTable& classes,
                    double clearance) {
  return Settler(map, graph, classes, clearance).Settle();
}

}  // namespace sqslam
