#include "slam/scene/scene_diff.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "slam/geometry/ray.h"
#include "slam/objects/assignment.h"
#include "slam/util/statistics.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace {

constexpr double kSignificant = 3.4;  // standard deviations in three dimensions: 1 % by chance

const SnapshotObject& At(const MapSnapshot& map, int i) { return map.objects[static_cast<std::size_t>(i)]; }

Eigen::Vector3d CentreOf(const PosedSuperquadric& solid) { return solid.T_map_object.translation; }

// Rates how surely the second map's object is the first one's: overlap above label above nothing; 0:
// impossible.
double Similarity(const SnapshotObject& a, const SnapshotObject& b, const PosedSuperquadric& b_in_first) {
  constexpr double kMaxSizeRatio = 0.5;  // logarithm
  constexpr double kMaxWay = 10.0;       // of an object that moved, half sizes
  const PosedSuperquadric& solid = a.superquadric;
  const double label = a.label == b.label ? 0.5 : 0.0;
  const double ratio =
      std::abs((b_in_first.shape.half_size.array() / solid.shape.half_size.array()).log().mean());
  const double inside =
      1.0 - std::min(solid.shape.RadialScale(solid.T_map_object.Inverse() * CentreOf(b_in_first)),
                     b_in_first.shape.RadialScale(b_in_first.T_map_object.Inverse() * CentreOf(solid)));
  if (inside > 0.0 && ratio < 2.0 * kMaxSizeRatio) {  // one's centre lies within the other
    return 2.0 + inside + label - ratio;
  }
  const double way = (CentreOf(solid) - CentreOf(b_in_first)).norm() / solid.shape.half_size.maxCoeff();
  return label > 0.0 && ratio < kMaxSizeRatio && way < kMaxWay ? 1.0 - way / kMaxWay : 0.0;
}

// Evidence of a view about the place of a solid: rays that pass through it, end in it, or end before it.
struct Sight {
  int through = 0;
  int hit = 0;
  int hidden = 0;
};

// Calls visit(point, exit) for surface points of a solid that face a camera at `eye`, and the points where
// their rays leave the solid.
void VisitFront(const PosedSuperquadric& solid, const Eigen::Vector3d& eye, const auto& visit) {
  constexpr int kRows = 7, kColumns = 14;
  for (int i = 0; i < kRows; ++i) {
    for (int j = 0; j < kColumns; ++j) {
      const double eta = std::numbers::pi * ((i + 0.5) / kRows - 0.5);
      const double omega = std::numbers::pi * (2.0 * (j + 0.5) / kColumns - 1.0);
      const Eigen::Vector3d p = solid.T_map_object * solid.shape.PointAt(eta, omega);
      const Eigen::Vector3d n = solid.T_map_object.rotation * solid.shape.NormalAt(eta, omega);
      const Eigen::Vector3d ray = (p - eye).normalized();
      if (const auto span = n.dot(ray) < -0.1 ? Intersect({eye, ray}, solid) : std::nullopt) {
        visit(p, Eigen::Vector3d(eye + span->second * ray));
      }
    }
  }
}

Sight SightOf(const PosedSuperquadric& solid, const DepthMap& view) {
  constexpr double kDepthError = 0.015;  // share of the depth
  constexpr double kSizeError = 0.2;     // share of the smallest half size
  Sight sight;
  const Rigid3d T_camera_map = view.T_map_camera.Inverse();
  VisitFront(
      solid, view.T_map_camera.translation, [&](const Eigen::Vector3d& p, const Eigen::Vector3d& p_exit) {
        const Eigen::Vector3d q = T_camera_map * p;
        if (q.z() <= 0.0) {
          return;
        }
        const Eigen::Vector2d pixel = view.camera.Project(q);
        const int x = static_cast<int>(std::lround(pixel.x())), y = static_cast<int>(std::lround(pixel.y()));
        if (x < 0 || y < 0 || x >= view.depth.cols || y >= view.depth.rows ||
            view.depth.at<float>(y, x) <= 0.0F) {
          return;
        }
        const double depth = view.depth.at<float>(y, x);
        const double exit = (T_camera_map * p_exit).z();
        const double error = kDepthError * depth + kSizeError * solid.shape.half_size.minCoeff();
        sight.through += depth > exit + error ? 1 : 0;
        sight.hidden += depth < q.z() - error ? 1 : 0;
        sight.hit += depth >= q.z() - error && depth <= exit ? 1 : 0;
      });
  return sight;
}

// True if the whole solid is in the image of a keyframe, and no other object of its map lies before its
// centre.
bool IsInView(const PosedSuperquadric& solid, const MapSnapshot& map, const Rigid3d& T_map_camera) {
  const Rigid3d T_camera_map = T_map_camera.Inverse();
  bool whole = true;
  VisitFront(solid, T_map_camera.translation, [&](const Eigen::Vector3d& p, const Eigen::Vector3d&) {
    const Eigen::Vector3d q = T_camera_map * p;
    const Eigen::Vector2d pixel = q.z() > 0.0 ? map.camera.Project(q) : Eigen::Vector2d(-1.0, -1.0);
    whole = whole && pixel.x() > 0.0 && pixel.y() > 0.0 && pixel.x() < map.camera.width - 1.0 &&
            pixel.y() < map.camera.height - 1.0;
  });
  constexpr int kSteps = 24;
  for (int i = 1; i < kSteps && whole; ++i) {
    const Eigen::Vector3d p =
        T_map_camera.translation + (CentreOf(solid) - T_map_camera.translation) * i / kSteps;
    whole = std::ranges::none_of(map.objects, [&](const SnapshotObject& other) {
      return other.superquadric.shape.RadialScale(other.superquadric.T_map_object.Inverse() * p) < 1.0;
    });
  }
  return whole;
}

// True if the camera of a scene shows that a place is empty. `solid`: in the frame of the scene's map.
bool IsEmptyPlace(const PosedSuperquadric& solid, const SeenScene& scene) {
  constexpr int kMinRays = 8, kMinViews = 2, kMinKeyframes = 5;
  if (scene.depths.empty()) {
    return std::ranges::count_if(scene.map->keyframes, [&](const SnapshotKeyframe& keyframe) {
             return IsInView(solid, *scene.map, keyframe.T_map_camera);
           }) >= kMinKeyframes;
  }
  int views = 0, through = 0, hit = 0;
  for (const DepthMap& view : scene.depths) {
    const Sight sight = SightOf(solid, view);
    through += sight.through;
    hit += sight.hit;
    views += sight.through >= kMinRays && sight.through > 3 * sight.hit ? 1 : 0;
  }
  return views >= kMinViews && through > 3 * hit;
}

class Comparison {
 public:
  Comparison(const SeenScene& first, const SeenScene& second, const Sim3d& S_first_second)
      : first_(first), second_(second), S_(S_first_second) {}

  std::vector<ObjectChange> Compare() {
    Pair();
    RefineAlignment();
    Pair();
    std::vector<ObjectChange> changes;
    std::vector<bool> paired(second_.map->objects.size());
    for (std::size_t i = 0; i < pairs_.size(); ++i) {
      const int before = static_cast<int>(i), after = pairs_[i];
      if (after >= 0) {
        paired[static_cast<std::size_t>(after)] = true;
        changes.push_back(Judge(before, after));
      } else if (IsReliable(At(*first_.map, before))) {
        const bool empty = IsEmptyPlace(S_.Inverse() * At(*first_.map, before).superquadric, second_);
        changes.push_back({empty ? Change::kGone : Change::kNotSeen, before, -1});
      }
    }
    for (int after = 0; after < static_cast<int>(paired.size()); ++after) {
      if (!paired[static_cast<std::size_t>(after)] && IsReliable(At(*second_.map, after))) {
        const bool empty = IsEmptyPlace(S_ * At(*second_.map, after).superquadric, first_);
        changes.push_back({empty ? Change::kNew : Change::kNotSeen, -1, after});
      }
    }
    return changes;
  }

 private:
  void Pair() {
    const auto& before = first_.map->objects;
    const auto& after = second_.map->objects;
    Eigen::MatrixXd gain(before.size(), after.size());
    for (std::size_t i = 0; i < before.size(); ++i) {
      for (std::size_t j = 0; j < after.size(); ++j) {
        gain(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) =
            Similarity(before[i], after[j], S_ * after[j].superquadric);
      }
    }
    pairs_ = after.empty() ? std::vector<int>(before.size(), -1) : AssignOptimally(gain);
  }

  Eigen::Vector3d ShiftOf(int before, int after) const {
    return CentreOf(S_ * At(*second_.map, after).superquadric) -
           CentreOf(At(*first_.map, before).superquadric);
  }

  // Takes out the median shift, which is an error of the alignment if most objects stayed.
  void RefineAlignment() {
    constexpr std::size_t kMinPairs = 4;
    std::vector<Eigen::Vector3d> shifts;
    for (std::size_t i = 0; i < pairs_.size(); ++i) {
      if (pairs_[i] >= 0) {
        shifts.push_back(ShiftOf(static_cast<int>(i), pairs_[i]));
      }
    }
    if (shifts.size() < kMinPairs) {
      return;
    }
    double variance = 0.0;
    for (int axis = 0; axis < 3; ++axis) {
      const double median =
          MeanMedian(ToVector(shifts, [axis](const Eigen::Vector3d& s) { return s[axis]; }));
      const double deviation =
          1.4826 *
          MeanMedian(ToVector(shifts, [&](const Eigen::Vector3d& s) { return std::abs(s[axis] - median); }));
      S_.translation[axis] -= median;
      variance += deviation * deviation / 3.0;
    }
    alignment_variance_ = variance;
  }

  double DistanceFromCameras(const Eigen::Vector3d& p) const {
    const auto& keyframes = first_.map->keyframes;
    return keyframes.empty() ? 0.0 : MeanMedian(ToVector(keyframes, [&](const SnapshotKeyframe& keyframe) {
      return (keyframe.T_map_camera.translation - p).norm();
    }));
  }

  ObjectChange Judge(int before, int after) const {
    constexpr double kShapeError = 0.04;  // of a centre, share of the largest half size
    constexpr double kSizeError = 0.1;    // of the logarithm of a size
    constexpr double kMinShift = 0.01;    // share of the distance from the cameras
    constexpr double kMinResize = 0.2;    // logarithm
    const SnapshotObject &a = At(*first_.map, before), &b = At(*second_.map, after);
    const PosedSuperquadric moved = S_ * b.superquadric;
    ObjectChange change{Change::kStayed, before, after, ShiftOf(before, after)};
    const Eigen::Array3d ratio =
        (moved.shape.half_size.array() / a.superquadric.shape.half_size.array()).log();
    change.size_ratio = std::exp(ratio.mean());
    if (!IsReliable(a) || !IsReliable(b)) {  // of a doubtful object, its place alone counts
      const bool there = change.shift.norm() < a.superquadric.shape.half_size.maxCoeff();
      change.change = there ? Change::kStayed : Change::kNotSeen;
      return change;
    }
    const Eigen::Matrix3d R = S_.scale * S_.rotation.toRotationMatrix();
    const double shape = kShapeError * a.superquadric.shape.half_size.maxCoeff();
    const Eigen::Matrix3d C = a.fit.covariance.topLeftCorner<3, 3>() +
                              R * b.fit.covariance.topLeftCorner<3, 3>() * R.transpose() +
                              (alignment_variance_ + shape * shape) * Eigen::Matrix3d::Identity();
    const double shift_sigmas = std::sqrt(change.shift.dot(C.inverse() * change.shift));
    const auto log_variance = [](const SnapshotObject& object) {
      return (object.fit.covariance.diagonal().segment<3>(3).array() /
              object.superquadric.shape.half_size.array().square())
                 .mean() /
             3.0;
    };
    const double size_sigmas =
        std::abs(ratio.mean()) / std::sqrt(log_variance(a) + log_variance(b) + kSizeError * kSizeError);
    if (shift_sigmas > kSignificant &&
        change.shift.norm() > kMinShift * DistanceFromCameras(CentreOf(a.superquadric))) {
      change.change = Change::kMoved;
    } else if (size_sigmas > kSignificant && std::abs(ratio.mean()) > kMinResize) {
      change.change = Change::kResized;
    }
    change.significance = change.change == Change::kResized ? size_sigmas : shift_sigmas;
    return change;
  }

  const SeenScene& first_;
  const SeenScene& second_;
  Sim3d S_;
  std::vector<int> pairs_;           // of the first map's objects: index in the second, or -1
  double alignment_variance_ = 0.0;  // of a coordinate
};

}  // namespace

std::vector<ObjectChange> CompareScenes(const SeenScene& first, const SeenScene& second,
                                        const Sim3d& S_first_second) {
  return Comparison(first, second, S_first_second).Compare();
}

}  // namespace sqslam
