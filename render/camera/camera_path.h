#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <numbers>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "slam/geometry/camera.h"
#include "slam/geometry/ray.h"
#include "slam/geometry/rigid3.h"
#include "slam/snapshot/snapshot.h"

namespace sqslam {

// Orthographic: parallel lines stay parallel, and all depths have the same scale.
enum class Projection { kPerspective, kOrthographic };
constexpr auto EnumNames(Projection) { return std::array{"perspective", "orthographic"}; }

// A virtual camera in the map frame.
struct ViewCamera {
  Eigen::Vector3d position = Eigen::Vector3d(0.0, -5.0, 3.0);
  Eigen::Vector3d focal_point = Eigen::Vector3d::Zero();
  Eigen::Vector3d view_up = Eigen::Vector3d::UnitZ();
  double view_angle = 30.0;  // vertical, degrees
  // Calibration of a real camera at this pose, its y axis opposite to view_up. The picture then shows exactly
  // what that camera sees, without distortion, at any size; view_angle is ignored.
  std::optional<Camera> pinhole;
  // An orthographic view has the scale of the perspective one at its focal point. No pinhole.
  Projection projection = Projection::kPerspective;

  bool IsOrthographic() const { return projection == Projection::kOrthographic; }
  double Distance() const { return (position - focal_point).norm(); }

  // Returns the focal length in pixels for a picture of this height. Ignores `pinhole`.
  double FocalLength(double height) const {
    return 0.5 * height / std::tan(0.5 * view_angle * std::numbers::pi / 180.0);
  }

  // Returns the height of the picture at the focal point, map units.
  double PictureHeight() const { return Distance() / FocalLength(1.0); }
};

// The camera's axes in the map frame, unit length; `back` is opposite to the viewing direction.
struct ViewAxes {
  Eigen::Vector3d right, up, back;
};
ViewAxes AxesOf(const ViewCamera& camera);

// Returns a perspective view of what an orthographic one shows, from so far away that it differs by less than
// a ten-thousandth of the picture. Leaves other views unchanged.
ViewCamera FromAfar(const ViewCamera& camera);

// Turns the camera around its focal point about view_up, counter-clockwise seen from above (degrees).
ViewCamera Azimuth(const ViewCamera& camera, double degrees);

// Raises the camera above the horizon of view_up (degrees); stops 1 degree short of the poles.
ViewCamera Elevation(const ViewCamera& camera, double degrees);

// Moves the camera to 1/factor of its distance.
ViewCamera Zoom(const ViewCamera& camera, double factor);

// Returns one full turn about `up` in `frames` steps, starting at `first`. view_up turns with it, which
// matters for a view from above.
std::vector<ViewCamera> OrbitPath(const ViewCamera& first, int frames, const Eigen::Vector3d& up);

// Returns a swing of `sweep` degrees about `up` from one side of `middle` to the other, at rest at both ends.
std::vector<ViewCamera> SwingPath(const ViewCamera& middle, int frames, const Eigen::Vector3d& up,
                                  double sweep = 40.0);

// Converts a posed camera (map frame) to a view of exactly what it sees, principal point included, and back.
// PoseOf and PinholeOf see an orthographic view FromAfar.
ViewCamera ThroughCamera(const Rigid3d& T_map_camera, const Camera& camera);
Rigid3d PoseOf(const ViewCamera& view);

// Returns the corners of a camera's frustum, map frame: its centre, then those of the undistorted image,
// clockwise from the top left, where the image is `height` high (map units). A map without a camera gets 4:3.
std::array<Eigen::Vector3d, 5> FrustumCorners(const Rigid3d& T_map_camera, const Camera& camera,
                                              double height);

// Returns a view from a posed camera (map frame) with its vertical field of view.
ViewCamera FirstPerson(const Rigid3d& T_map_camera, const Camera& camera, double scene_depth);

// Returns a view from behind and above a posed camera, in its direction; `distance` in map units.
ViewCamera Behind(const Rigid3d& T_map_camera, const Eigen::Vector3d& up, double distance);

// Smooths with a Gaussian over neighbouring frames; `radius` is its standard deviation in frames.
std::vector<ViewCamera> Smooth(const std::vector<ViewCamera>& path, double radius);

// Interpolates `count` poses at equal steps of the keyframe index.
std::vector<Rigid3d> PosesAlongKeyframes(const MapSnapshot& map, int count);

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
