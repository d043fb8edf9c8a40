#include "slam/tracking/object_poses.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <random>
#include <ranges>
#include <utility>

#include "slam/estimation/absolute_pose.h"
#include "slam/geometry/lie.h"
#include "slam/objects/assignment.h"
#include "slam/objects/landmark_geometry.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace {

constexpr double kMinIoU = 0.2;           // of a box with the landmark that explains it
constexpr std::size_t kMinExplained = 3;  // boxes, as many as a pose needs

// A box, undistorted, and the landmarks that it may show.
struct SeenBox {
  Box2d box;
  std::array<bool, 4> edge_free{};
  std::vector<int> landmarks;  // of its label
};

struct Explained {
  int box = 0;
  int landmark = 0;
};

struct ObjectPose {
  Rigid3d T_camera_map;
  double agreement = 0.0;  // summed IoU of the explained boxes
  std::vector<Explained> explained;
};

class ObjectPoseSearch {
 public:
  ObjectPoseSearch(const std::vector<BoxCandidate>& boxes, const ObjectMapView& objects, const Camera& camera)
      : camera_(camera) {
    for (const ObjectLandmarkView& landmark : objects.landmarks) {
      if (landmark.shown && landmark.estimated) {
        landmarks_.push_back(&landmark);
      }
    }
    for (const BoxCandidate& candidate : boxes) {
      SeenBox seen{UndistortBox(candidate.detection.box, camera), candidate.edges.Free(), {}};
      for (int j = 0; j < static_cast<int>(landmarks_.size()); ++j) {
        if (landmarks_[j]->label == candidate.detection.label) {
          seen.landmarks.push_back(j);
        }
      }
      if (!seen.landmarks.empty()) {
        boxes_.push_back(std::move(seen));
      }
    }
  }

  std::vector<Rigid3d> Best(int count) const {
    constexpr std::size_t kMaxRefined = 30;
    std::vector<ObjectPose> rough = RoughPoses();
    std::ranges::stable_sort(rough, std::greater<>(), &ObjectPose::agreement);
    rough.resize(std::min(rough.size(), kMaxRefined));
    std::map<std::vector<std::pair<int, int>>, ObjectPose> by_explanation;
    for (ObjectPose& pose : rough) {
      Refine(pose);
      std::vector<std::pair<int, int>> key;
      for (const auto& [box, landmark] : pose.explained) {
        key.emplace_back(box, landmark);
      }
      ObjectPose& best = by_explanation[key];
      if (key.size() >= kMinExplained && pose.agreement > best.agreement) {
        best = std::move(pose);
      }
    }
    std::vector<ObjectPose> best = ToVector(by_explanation | std::views::values);
    std::erase_if(best, [](const ObjectPose& pose) { return pose.agreement == 0.0; });
    std::ranges::stable_sort(best, std::greater<>(), &ObjectPose::agreement);
    return ToVector(best | std::views::take(count), &ObjectPose::T_camera_map);
  }

 private:
  using ExplainedTriple = std::array<Explained, 3>;
  static constexpr std::size_t kMaxSamples = 3000;

  std::vector<ObjectPose> RoughPoses() const {
    std::vector<Explained> pairs;
    for (int i = 0; i < static_cast<int>(boxes_.size()); ++i) {
      const auto& free = boxes_[i].edge_free;
      if ((free[kLeftEdge] && free[kRightEdge]) || (free[kTopEdge] && free[kBottomEdge])) {
        for (const int j : boxes_[i].landmarks) {
          pairs.push_back({i, j});
        }
      }
    }
    std::vector<ObjectPose> poses;
    for (const ExplainedTriple& triple : SampleTriples(pairs)) {
      AddPosesOf(triple, poses);
    }
    return poses;
  }

  // Returns the triples of pairs with three boxes and three landmarks, or random ones if there are many:
  // dozens of boxes and landmarks of one label make billions.
  static std::vector<ExplainedTriple> SampleTriples(const std::vector<Explained>& pairs) {
    std::vector<ExplainedTriple> triples;
    for (std::size_t a = 0; a < pairs.size(); ++a) {
      for (std::size_t b = a + 1; b < pairs.size(); ++b) {
        for (std::size_t c = b + 1; c < pairs.size() && Differ(pairs[a], pairs[b]); ++c) {
          if (Differ(pairs[a], pairs[c]) && Differ(pairs[b], pairs[c])) {
            triples.push_back({pairs[a], pairs[b], pairs[c]});
          }
          if (triples.size() > kMaxSamples) {
            return DrawTriples(pairs);
          }
        }
      }
    }
    return triples;
  }

  static std::vector<ExplainedTriple> DrawTriples(const std::vector<Explained>& pairs) {
    std::mt19937 random(1);
    std::uniform_int_distribution<std::size_t> index(0, pairs.size() - 1);
    std::vector<ExplainedTriple> triples;
    while (triples.size() < kMaxSamples) {
      const ExplainedTriple drawn = {pairs[index(random)], pairs[index(random)], pairs[index(random)]};
      if (Differ(drawn[0], drawn[1]) && Differ(drawn[0], drawn[2]) && Differ(drawn[1], drawn[2])) {
        triples.push_back(drawn);
      }
    }
    return triples;
  }

  static bool Differ(const Explained& a, const Explained& b) {
    return a.box != b.box && a.landmark != b.landmark;
  }

  void AddPosesOf(const ExplainedTriple& triple, std::vector<ObjectPose>& poses) const {
    std::array<Eigen::Vector3d, 3> centres;
    std::array<Eigen::Vector2d, 3> pixels;
    for (std::size_t k = 0; k < 3; ++k) {
      centres[k] = landmarks_[triple[k].landmark]->superquadric.T_map_object.translation;
      pixels[k] = boxes_[triple[k].box].box.Center();
    }
    for (const Rigid3d& T_camera_map : SolveP3P(camera_, centres, pixels)) {
      const bool overlap = std::ranges::all_of(
          triple, [&](const Explained& pair) { return Agreement(T_camera_map.Inverse(), pair) > kMinIoU; });
      if (overlap) {
        poses.push_back(Explain(T_camera_map));
      }
    }
  }

  // Returns the IoU of a box with its landmark's projection, which may extend beyond hidden edges of the box.
  double Agreement(const Rigid3d& T_map_camera, const Explained& pair) const {
    const SeenBox& seen = boxes_[pair.box];
    const auto projected = ProjectToBox(landmarks_[pair.landmark]->superquadric, T_map_camera, camera_);
    return projected ? IoU(*projected, Continued(seen.box, seen.edge_free, *projected)) : 0.0;
  }

  ObjectPose Explain(const Rigid3d& T_camera_map) const {
    Eigen::MatrixXd gain = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(boxes_.size()),
                                                 static_cast<Eigen::Index>(landmarks_.size()));
    const Rigid3d T_map_camera = T_camera_map.Inverse();
    for (int i = 0; i < static_cast<int>(boxes_.size()); ++i) {
      for (const int j : boxes_[i].landmarks) {
        const double iou = Agreement(T_map_camera, {i, j});
        gain(i, j) = iou >= kMinIoU ? iou : 0.0;
      }
    }
    ObjectPose pose{T_camera_map, 0.0, {}};
    const std::vector<int> assigned = AssignOptimally(gain);
    for (int i = 0; i < static_cast<int>(assigned.size()); ++i) {
      if (assigned[i] >= 0) {
        pose.agreement += gain(i, assigned[i]);
        pose.explained.push_back({i, assigned[i]});
      }
    }
    return pose;
  }

  // Returns the differences of the visible edges, in units of the boxes' sizes; 0 for hidden edges.
  Eigen::VectorXd Residuals(const std::vector<Explained>& explained, const Rigid3d& T_camera_map) const {
    Eigen::VectorXd residuals = Eigen::VectorXd::Zero(4 * static_cast<Eigen::Index>(explained.size()));
    for (std::size_t k = 0; k < explained.size(); ++k) {
      const SeenBox& seen = boxes_[explained[k].box];
      const auto projected =
          ProjectToBox(landmarks_[explained[k].landmark]->superquadric, T_camera_map.Inverse(), camera_);
      const double size = std::sqrt(std::max(1.0, seen.box.Area()));
      const std::array<double, 4> target = Edges(seen.box);
      const std::array<double, 4> edges = projected ? Edges(*projected) : target;
      for (std::size_t e = 0; e < 4; ++e) {
        residuals[static_cast<Eigen::Index>(4 * k + e)] =
            seen.edge_free[e] ? (edges[e] - target[e]) / size : 0.0;
      }
    }
    return residuals;
  }

  static std::array<double, 4> Edges(const Box2d& box) {
    return {box.x, box.y, box.x + box.width, box.y + box.height};
  }

  // Gauss-Newton steps on the edges of the explained boxes with Huber's weights, damped since few edges may
  // leave a direction open; keeps the pose of the best agreement.
  void Refine(ObjectPose& best) const {
    constexpr int kMaxSteps = 8;
    constexpr double kHuber = 0.1;
    constexpr double kDamping = 1e-3;
    constexpr double kDelta = 1e-5;
    ObjectPose pose = best;
    for (int step = 0; step < kMaxSteps && pose.explained.size() >= kMinExplained; ++step) {
      const Eigen::VectorXd residuals = Residuals(pose.explained, pose.T_camera_map);
      Eigen::MatrixXd jacobian(residuals.size(), 6);
      for (int axis = 0; axis < 6; ++axis) {
        const Vector6d delta = kDelta * Vector6d::Unit(axis);
        jacobian.col(axis) =
            (Residuals(pose.explained, Perturb(pose.T_camera_map, delta)) - residuals) / kDelta;
      }
      const Eigen::VectorXd weights =
          residuals.unaryExpr([](double r) { return std::min(1.0, kHuber / std::max(1e-12, std::abs(r))); });
      const Matrix6d normal = jacobian.transpose() * weights.asDiagonal() * jacobian;
      const Vector6d gradient = jacobian.transpose() * weights.asDiagonal() * residuals;
      const Matrix6d damped = normal + kDamping * Matrix6d(normal.diagonal().asDiagonal());
      const Vector6d step_taken = damped.ldlt().solve(-gradient);
      if (!step_taken.allFinite()) {
        return;
      }
      pose = Explain(Perturb(pose.T_camera_map, step_taken));
      if (pose.agreement > best.agreement) {
        best = pose;
      }
    }
  }

  Camera camera_;
  std::vector<SeenBox> boxes_;
  std::vector<const ObjectLandmarkView*> landmarks_;
};

}  // namespace

std::vector<Rigid3d> PosesFromObjects(const std::vector<BoxCandidate>& boxes, const ObjectMapView& objects,
                                      const Camera& camera, int count) {
  return ObjectPoseSearch(boxes, objects, camera).Best(count);
}

}  // namespace sqslam
