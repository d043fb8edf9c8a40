#include "slam/estimation/bundle_adjustment.h"

#include <ceres/ceres.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <set>

#include "slam/estimation/pose_optimization.h"
#include "slam/estimation/reprojection_cost.h"

namespace sqslam {
namespace {

class Interrupter final : public ceres::IterationCallback {
 public:
  explicit Interrupter(const std::function<bool()>& interrupt) : interrupt_(interrupt) {}
  ceres::CallbackReturnType operator()(const ceres::IterationSummary&) override {
    interrupted_ = interrupted_ || (interrupt_ && interrupt_());
    return interrupted_ ? ceres::SOLVER_TERMINATE_SUCCESSFULLY : ceres::SOLVER_CONTINUE;
  }
  bool Interrupted() const { return interrupted_; }

 private:
  const std::function<bool()>& interrupt_;
  bool interrupted_ = false;
};

// One bundle adjustment: which keyframes move, which hold, and the parameter blocks. The blocks lie in
// vectors, in the order of ids, because Ceres orders them by address: only so are two runs bit-identical.
class Adjustment {
 public:
  Adjustment(Map& map, const Camera& camera, const std::vector<KeyframeId>& free,
             const std::vector<KeyframeId>& fixed)
      : map_(map), camera_(camera), num_free_(free.size()) {
    std::set<PointId> points;
    for (const KeyframeId id : free) {
      poses_[id] = {};
      for (const PointId point : map.At(id).points) {
        if (point != kNoPoint) {
          points.insert(point);
        }
      }
    }
    for (const KeyframeId id : fixed) {
      poses_[id].fixed = true;
    }
    for (auto& [id, pose] : poses_) {
      pose.index = pose_blocks_.size();
      pose_blocks_.push_back(ToBlock(map.At(id).T_camera_map));
    }
    for (const PointId id : points) {
      points_.push_back({id, map.Point(id).p_map});
    }
  }

  // Returns false where the solver was interrupted.
  bool Solve(int iterations, bool robust, int threads, const std::function<bool()>& interrupt) {
    ceres::Problem::Options problem_options;
    problem_options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    problem_options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    ceres::HuberLoss huber(std::sqrt(kChi2TwoDof));
    PoseManifold manifold;
    ceres::Problem problem(problem_options);
    ceres::Solver::Options options;
    options.linear_solver_ordering = AddParameterBlocks(problem, manifold);
    AddResiduals(problem, robust ? &huber : nullptr);
    options.linear_solver_type = num_free_ < 40 ? ceres::DENSE_SCHUR : ceres::SPARSE_SCHUR;
    options.max_num_iterations = iterations;
    options.num_threads = threads;
    options.function_tolerance = 1e-5;
    options.logging_type = ceres::SILENT;
    Interrupter interrupter(interrupt);
    options.callbacks.push_back(&interrupter);
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem, &summary);
    return !interrupter.Interrupted();
  }

  // Writes poses and points back, then removes observations that don't fit; returns their number.
  int Apply() {
    for (const auto& [id, pose] : poses_) {
      if (!pose.fixed) {
        map_.At(id).T_camera_map = FromBlock(pose_blocks_[pose.index].data());
      }
    }
    for (const PointBlock& point : points_) {
      map_.Point(point.id).p_map = point.p_map;
    }
    return RemoveOutliers();
  }

  void FinishPoints() {
    for (const PointBlock& point : points_) {
      map_.UpdateNormalAndRange(point.id);
    }
  }

  BundleAdjustmentReport Report() const {
    BundleAdjustmentReport report;
    report.keyframes = static_cast<int>(num_free_);
    report.fixed_keyframes = static_cast<int>(poses_.size() - num_free_);
    report.points = static_cast<int>(points_.size());
    report.observations = observations_;
    return report;
  }

 private:
  struct PoseEntry {
    std::size_t index = 0;  // into pose_blocks_
    bool fixed = false;
  };
  struct PointBlock {
    PointId id = kNoPoint;
    Eigen::Vector3d p_map;
  };

  std::shared_ptr<ceres::ParameterBlockOrdering> AddParameterBlocks(ceres::Problem& problem,
                                                                    PoseManifold& manifold) {
    auto ordering = std::make_shared<ceres::ParameterBlockOrdering>();
    for (const auto& [id, pose] : poses_) {
      double* block = pose_blocks_[pose.index].data();
      problem.AddParameterBlock(block, 7, &manifold);
      ordering->AddElementToGroup(block, 1);
      if (pose.fixed) {
        problem.SetParameterBlockConstant(block);
      }
    }
    for (PointBlock& point : points_) {
      problem.AddParameterBlock(point.p_map.data(), 3);
      ordering->AddElementToGroup(point.p_map.data(), 0);
    }
    return ordering;
  }

  void AddResiduals(ceres::Problem& problem, ceres::LossFunction* loss) {
    observations_ = 0;
    for (PointBlock& point : points_) {
      for (const Observation& o : map_.Point(point.id).observations) {
        const auto pose = poses_.find(o.keyframe);
        if (pose == poses_.end() || !IsInFront(pose->second.index, point.p_map)) {
          // Behind the camera there is no reprojection; RemoveOutliers() takes the observation away.
          continue;
        }
        const Keypoint& keypoint =
            map_.At(o.keyframe).features->keypoints[static_cast<std::size_t>(o.keypoint)];
        problem.AddResidualBlock(
            new ReprojectionCost(camera_, keypoint.pixel, map_.Levels().Scale(keypoint.octave)), loss,
            pose_blocks_[pose->second.index].data(), point.p_map.data());
        ++observations_;
      }
    }
  }

  bool IsInFront(std::size_t pose_index, const Eigen::Vector3d& p_map) const {
    constexpr double kMinDepth = 1e-5;
    return (FromBlock(pose_blocks_[pose_index].data()) * p_map).z() > kMinDepth;
  }

  int RemoveOutliers() {
    std::vector<std::pair<PointId, KeyframeId>> outliers;
    for (const PointBlock& point : points_) {
      for (const Observation& o : map_.Point(point.id).observations) {
        if (!poses_.contains(o.keyframe)) {
          continue;
        }
        const Keyframe& keyframe = map_.At(o.keyframe);
        const Keypoint& keypoint = keyframe.features->keypoints[static_cast<std::size_t>(o.keypoint)];
        const Eigen::Vector3d p_camera = keyframe.T_camera_map * point.p_map;
        if (p_camera.z() <= 0.0 || (camera_.Project(p_camera) - keypoint.pixel).squaredNorm() >
                                       kChi2TwoDof * map_.Levels().Variance(keypoint.octave)) {
          outliers.emplace_back(point.id, o.keyframe);
        }
      }
    }
    for (const auto& [point, keyframe] : outliers) {
      map_.RemoveObservation(point, keyframe);
    }
    std::erase_if(points_, [&](const PointBlock& point) { return !map_.IsAlive(point.id); });
    return static_cast<int>(outliers.size());
  }

  Map& map_;
  const Camera& camera_;
  std::size_t num_free_;
  std::map<KeyframeId, PoseEntry> poses_;
  std::vector<PoseBlock> pose_blocks_;
  std::vector<PointBlock> points_;  // by id
  int observations_ = 0;
};

BundleAdjustmentReport Run(Adjustment& adjustment, int first, int second, int threads,
                           const std::function<bool()>& interrupt) {
  const bool whole = adjustment.Solve(first, true, threads, interrupt);
  int outliers = adjustment.Apply();
  bool finished = whole;
  if (whole) {
    finished = adjustment.Solve(second, false, threads, interrupt);
    outliers += adjustment.Apply();
  }
  adjustment.FinishPoints();
  BundleAdjustmentReport report = adjustment.Report();
  report.outliers = outliers;
  report.interrupted = !finished;
  return report;
}

}  // namespace

BundleAdjustmentReport LocalBundleAdjustment(Map& map, const Camera& camera, KeyframeId center,
                                             const BundleAdjustmentOptions& options,
                                             const std::function<bool()>& interrupt) {
  std::vector<KeyframeId> free = map.At(center).BestCovisible(options.max_keyframes - 1);
  free.push_back(center);
  std::set<KeyframeId> inside(free.begin(), free.end());
  std::map<KeyframeId, int> outside;  // keyframe -> observations of the points in question
  for (const KeyframeId id : free) {
    for (const PointId point : map.At(id).points) {
      if (point != kNoPoint) {
        for (const Observation& o : map.Point(point).observations) {
          if (!inside.contains(o.keyframe)) {
            ++outside[o.keyframe];
          }
        }
      }
    }
  }
  std::vector<std::pair<int, KeyframeId>> ranked;
  for (const auto& [id, count] : outside) {
    ranked.emplace_back(count, id);
  }
  std::sort(ranked.begin(), ranked.end(), std::greater<>());
  std::vector<KeyframeId> fixed;
  for (const auto& [count, id] : ranked) {
    if (static_cast<int>(fixed.size()) < options.max_fixed) {
      fixed.push_back(id);
    }
  }
  // The gauge (pose and scale) needs two fixed keyframes: while the map is small, its two oldest.
  std::sort(free.begin(), free.end());
  while (fixed.size() < 2 && free.size() > 1) {
    fixed.push_back(free.front());
    free.erase(free.begin());
  }
  Adjustment adjustment(map, camera, free, fixed);
  return Run(adjustment, options.iterations, options.final_iterations, options.threads, interrupt);
}

BundleAdjustmentReport GlobalBundleAdjustment(Map& map, const Camera& camera, int iterations,
                                              const BundleAdjustmentOptions& options) {
  std::vector<KeyframeId> free;
  for (const auto& [id, keyframe] : map.Keyframes()) {
    free.push_back(id);
  }
  const std::vector<KeyframeId> fixed{free.front()};
  free.erase(free.begin());
  Adjustment adjustment(map, camera, free, fixed);
  return Run(adjustment, iterations, iterations, options.threads, {});
}

}  // namespace sqslam
