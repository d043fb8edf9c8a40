#pragma once

#include <opencv2/core.hpp>
#include <optional>

#include "slam/geometry/camera.h"
#include "slam/objects/dual_quadric.h"
#include "slam/objects/landmark.h"
#include "slam/objects/landmark_estimation.h"

namespace sqslam {

// Initialises an ellipsoid from one image like SO-SLAM (Liao, Hu, Zhang and Zhang, "SO-SLAM: Semantic Object
// SLAM with Scale Proportional and Symmetrical Texture Constraints", IEEE RA-L 2022): upright on its support,
// with the proportions of its class, and with the yaw at which its texture is symmetric. `gray`: 8UC1,
// distorted as recorded. Tries angles over half a turn; if none shows enough of both sides, takes the one
// that fits the box best. Empty if the box is not seen whole or no ellipsoid on the support fits it.
std::optional<PosedSuperquadric> QuadricFromOneView(const BoxView& view, const cv::Mat& gray,
                                                    const Camera& camera, const ObjectOptions& options,
                                                    const QuadricPriors& priors);

// Estimates the ellipsoid of a landmark from its clearest view and refines it by the boxes of `views` with
// yaw and priors kept. Empty if up, its support or a view of the whole object is unknown.
std::optional<PosedSuperquadric> EstimateQuadricOnSupport(const Landmark& landmark,
                                                          const std::vector<BoxView>& views,
                                                          const EstimationContext& context);

// Returns the mean difference of grey levels (of 255) between visible points of an ellipsoid's surface and
// their mirror images in its x-z plane or in its y-z plane, whichever is less; empty if less than a quarter
// of these points have a visible mirror image.
std::optional<double> TextureAsymmetry(const PosedSuperquadric& ellipsoid, const Rigid3d& T_map_camera,
                                       const Camera& camera, const cv::Mat& gray);

}  // namespace sqslam
