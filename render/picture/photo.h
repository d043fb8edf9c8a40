#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "render/picture/picture.h"
#include "render/scene/style.h"
#include "slam/geometry/camera.h"
#include "slam/geometry/rigid3.h"
#include "slam/snapshot/snapshot.h"

// Photographs beneath pictures of maps.
namespace sqslam {

// Removes the lens distortion, keeping the calibration; pixels that the lens did not show are black.
cv::Mat Undistorted(const cv::Mat& image, const Camera& camera);

// A picture with an undistorted photograph in its middle, as large as possible.
struct PlacedPhoto {
  cv::Mat picture;  // 8UC3
  cv::Rect area;    // of the photograph
};

// Throws InputError if `photo` (8UC3, with lens distortion) does not have the camera's image size.
PlacedPhoto PlacePhoto(const cv::Mat& photo, const Camera& camera, cv::Size picture,
                       const Eigen::Vector3d& background);

// Hides or makes transparent what would cover a photograph beneath the map.
SceneStyle StyleOverPhoto(SceneStyle style);

// Draws the map, as its camera at T_map_camera sees it, over the photograph taken there. Framing and colours
// are those of `framed`.
cv::Mat RenderOnPhoto(const MapSnapshot& framed, const MapSnapshot& map, const cv::Mat& photo,
                      const Rigid3d& T_map_camera, PictureOptions options);

}  // namespace sqslam
