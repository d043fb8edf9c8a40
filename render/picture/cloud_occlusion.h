#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <span>

#include "render/scene/cloud_layer.h"
#include "render/solids/solid_image.h"

// Solids behind the surfaces of a dense cloud, for pictures over photographs.
namespace sqslam {

// Returns the depth of the nearest point at each pixel, map units; infinity: none. Each point covers a square
// wider than its distance to its neighbours, so that surfaces close. `newest`: frame of the map; points that
// a later frame showed first are left out.
cv::Mat1f CloudDepth(const CloudLayer& cloud, const Camera& camera, const Rigid3d& T_map_camera,
                     std::int64_t newest);

// Returns 255 at the pixels whose solid lies behind the cloud by more than the error of both: a quarter of
// the solid's mean half size and 2 % of its depth. Gaps and spots of a few pixels are noise of the cloud:
// they are filled and left out.
cv::Mat1b HiddenBehind(const cv::Mat1f& cloud_depth, const SolidImage& image,
                       std::span<const PosedSuperquadric> solids);

}  // namespace sqslam
