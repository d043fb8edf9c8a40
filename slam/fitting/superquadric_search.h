#pragma once

#include <Eigen/Core>
#include <vector>

#include "slam/fitting/fit_options.h"
#include "slam/fitting/mixture_fit.h"

namespace sqslam {

struct SearchResult {
  PosedSuperquadric superquadric;
  MixtureModel model;
  double cost = 0.0;  // negative log likelihood, up to a constant of the cloud
};

// Fits one superquadric to points in their canonical frame (origin inside, size about 1): many starts over
// orientation, shape and axis of symmetry on a few points, the best refined on all of them, similar shapes
// tried from there (see SimilarShapes), the likeliest taken.
SearchResult SearchSuperquadric(const std::vector<Eigen::Vector3d>& points, const FitOptions& options);

// Orientations for a search over boxes, whose three axes may be swapped: `count` rotations spread evenly over
// SO(3) modulo the 24 rotations of a cube (about the z axis only: over a quarter turn).
std::vector<Eigen::Quaterniond> SpreadRotations(int count, bool upright, std::uint64_t seed);

// Other descriptions of nearly the same solid, from which a fit that is stuck gets free (the "switching" of
// Liu et al., Robust and Accurate Superquadric Recovery, CVPR 2022): the axis of e1 swapped, and square
// sections turned by 45 degrees, where e becomes 2 - e.
std::vector<PosedSuperquadric> SimilarShapes(const PosedSuperquadric& superquadric, bool upright);

}  // namespace sqslam
