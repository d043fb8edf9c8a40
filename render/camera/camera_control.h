#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "render/camera/camera_path.h"
#include "slam/geometry/camera.h"
#include "slam/geometry/ray.h"

namespace sqslam {

// Moving a virtual camera by hand. Pixels have their origin in the window's top-left corner.

// Turns about the focal point: by `pixels` of the mouse, half a turn for the height of the window. Stays one
// degree short of the poles of `up` (map frame).
ViewCamera Orbit(const ViewCamera& camera, const Eigen::Vector2d& pixels, cv::Size window,
                 const Eigen::Vector3d& up);

// Shifts such that what lies at the distance of the focal point follows the mouse.
ViewCamera Pan(const ViewCamera& camera, const Eigen::Vector2d& pixels, cv::Size window);

// To 1/factor of the distance, towards what lies under `pixel` at the distance of the focal point: that stays
// where it is seen.
ViewCamera ZoomTo(const ViewCamera& camera, double factor, const Eigen::Vector2d& pixel, cv::Size window);

// Moves eye and focal point along the camera's own axes (right, up, forward), map units.
ViewCamera Fly(const ViewCamera& camera, const Eigen::Vector3d& right_up_forward);

// Turns the direction of view, the eye stays.
ViewCamera LookAround(const ViewCamera& camera, const Eigen::Vector2d& pixels, cv::Size window,
                      const Eigen::Vector3d& up);

// The view as a pinhole camera of the window's size, whatever it is made of.
Camera PinholeOf(const ViewCamera& camera, cv::Size window);

// Line of sight of a pixel: through the eye, unit direction.
Ray RayOf(const ViewCamera& camera, const Eigen::Vector2d& pixel, cv::Size window);

// A view between two others for a short move from one to the other, `t` in [0, 1].
ViewCamera Between(const ViewCamera& from, const ViewCamera& to, double t);

}  // namespace sqslam
