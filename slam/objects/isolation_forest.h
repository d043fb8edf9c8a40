#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "slam/objects/object_options.h"

namespace sqslam {

// c(n) = 2 H(n-1) - 2 (n-1)/n: mean depth of an unsuccessful search in a binary tree of n points; 0 for n
// < 2.
double MeanIsolationDepth(int n);

// Extended Isolation Forest (Hariri et al. 2019; section "Extended Isolation Forest"): branches are planes
// x . n <= p with an isotropic normal n ~ N(0, I) and an intercept p uniform over the branch's data. The
// score of a point is s = 2^(-E(h) / c(sample size)) in (0, 1): about 0.5 for an ordinary point, towards 1
// for an isolated one.
class IsolationForest {
 public:
  IsolationForest(std::span<const Eigen::Vector3d> points, const IsolationForestOptions& options,
                  std::uint64_t seed);

  double Score(const Eigen::Vector3d& p) const;  // in (0, 1); 0.5 if the cloud has fewer than two points

 private:
  struct Node {
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();
    double intercept = 0.0;
    int left = -1;  // child nodes; -1: a leaf
    int right = -1;
    double depth = 0.0;  // of a leaf: its depth + c(points left in it)
  };

  template <typename Generator>
  int Grow(std::span<Eigen::Vector3d> points, int depth, Generator& generator);

  std::vector<Node> nodes_;
  std::vector<int> roots_;
  int max_depth_ = 0;
  double normalisation_ = 0.0;
};

// Scores each point in the forest of all points; empty if there are fewer than options.min_points or the
// forest is disabled.
std::vector<double> AnomalyScores(std::span<const Eigen::Vector3d> points,
                                  const IsolationForestOptions& options, std::uint64_t seed);

}  // namespace sqslam
