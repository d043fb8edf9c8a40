#pragma once

#include <opencv2/core.hpp>
#include <optional>

#include "slam/geometry/camera.h"
#include "slam/objects/dual_quadric.h"
#include "slam/objects/landmark.h"
#include "slam/objects/landmark_estimation.h"

namespace sqslam {

// An ellipsoid from one image, as SO-SLAM begins its objects (Liao, Hu, Zhang and Zhang, "SO-SLAM: Semantic
// Object SLAM with Scale Proportional and Symmetrical Texture Constraints", IEEE RA-L 2022): upright on its
// support, with the proportions of its class, and with the yaw at which its texture is the same on both
// sides. `gray`: 8UC1, distorted as recorded. Angles are tried over half a turn; where none shows enough of
// both sides the one that fits the box best is taken. Empty where the box is not seen whole or is no
// ellipsoid on the support.
std::optional<PosedSuperquadric> QuadricFromOneView(const BoxView& view, const cv::Mat& gray,
                                                    const Camera& camera, const ObjectOptions& options,
                                                    QuadricPriors priors);

// The ellipsoid of a landmark by its clearest view, refined by the boxes of `views` with yaw and priors kept.
// Empty where up, its support or a view of the whole are not known.
std::optional<PosedSuperquadric> EstimateQuadricOnSupport(const Landmark& landmark,
                                                          const std::vector<BoxView>& views,
                                                          const EstimationContext& context);

// Mean difference of grey levels (of 255) between points of an ellipsoid's surface that the image shows and
// their mirror images in its x-z plane or in its y-z plane, whichever is less; empty where less than a
// quarter of the surface is shown with its mirror image.
std::optional<double> TextureAsymmetry(const PosedSuperquadric& ellipsoid, const Rigid3d& T_map_camera,
                                       const Camera& camera, const cv::Mat& gray);

}  // namespace sqslam
