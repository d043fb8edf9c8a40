#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "render/camera/camera_path.h"
#include "slam/geometry/camera.h"
#include "slam/geometry/ray.h"

namespace sqslam {

// Mouse and keyboard control of a virtual camera. The origin of pixels is the window's top-left corner.

// Orbits the focal point by a mouse movement of `pixels`; the window's height is half a turn. Stays one
// degree short of the poles of `up` (map frame).
ViewCamera Orbit(const ViewCamera& camera, const Eigen::Vector2d& pixels, cv::Size window,
                 const Eigen::Vector3d& up);

// Pans so that points at the distance of the focal point follow the mouse.
ViewCamera Pan(const ViewCamera& camera, const Eigen::Vector2d& pixels, cv::Size window);

// Moves to 1/factor of the distance. The point under `pixel` at the distance of the focal point stays in
// place.
ViewCamera ZoomTo(const ViewCamera& camera, double factor, const Eigen::Vector2d& pixel, cv::Size window);

// Moves eye and focal point along the camera's own axes (right, up, forward), map units.
ViewCamera Fly(const ViewCamera& camera, const Eigen::Vector3d& right_up_forward);

// Turns the viewing direction about the eye.
ViewCamera LookAround(const ViewCamera& camera, const Eigen::Vector2d& pixels, cv::Size window,
                      const Eigen::Vector3d& up);

// Returns the view as a pinhole camera of the window's size.
Camera PinholeOf(const ViewCamera& camera, cv::Size window);

// Returns the viewing ray of a pixel in the map frame, with unit direction.
Ray RayOf(const ViewCamera& camera, const Eigen::Vector2d& pixel, cv::Size window);

// Interpolates between two views for a short transition, `t` in [0, 1].
ViewCamera Between(const ViewCamera& from, const ViewCamera& to, double t);

}  // namespace sqslam
