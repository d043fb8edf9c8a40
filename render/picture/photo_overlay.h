#pragma once

#include <opencv2/core.hpp>

#include "render/picture/picture.h"
#include "slam/snapshot/snapshot.h"

namespace sqslam {

// The image without the distortion of its lens, in the same calibration; what the lens did not show is black.
cv::Mat Undistorted(const cv::Mat& image, const Camera& camera);

// The map over a photograph of it: exact outlines of the objects, their names and, if the style asks for
// them, map points. `photo` (8UC3) is as recorded by map.camera from T_map_camera, distortion included, which
// is taken off first. The picture has the size of the options, the photograph in its middle. Throws
// InputError where the photograph has not the size of the camera's images.
cv::Mat RenderOverPhoto(const MapSnapshot& map, const cv::Mat& photo, const Rigid3d& T_map_camera,
                        const PictureOptions& options);

}  // namespace sqslam
