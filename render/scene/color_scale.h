#pragma once

#include <Eigen/Core>

namespace sqslam {

// Matplotlib's viridis (van der Walt and Smith, 2015) for values in [0, 1], clamped. It is perceptually
// uniform, also for colour-blind people and in greyscale.
Eigen::Vector3d Viridis(double value);

}  // namespace sqslam
