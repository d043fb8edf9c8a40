#pragma once

#include <Eigen/Core>
#include <cmath>
#include <numbers>
#include <optional>
#include <vector>

#include "slam/geometry/rigid3.h"
#include "slam/snapshot/snapshot.h"

namespace sqslam {

// A virtual camera in the map frame.
struct ViewCamera {
  Eigen::Vector3d position = Eigen::Vector3d(0.0, -5.0, 3.0);
  Eigen::Vector3d focal_point = Eigen::Vector3d::Zero();
  Eigen::Vector3d view_up = Eigen::Vector3d::UnitZ();
  double view_angle = 30.0;  // vertical, degrees
  // A real camera at this place, its y axis opposite to view_up: the picture, of any size, is then just what
  // that camera sees (without distortion), and view_angle has no say.
  std::optional<Camera> pinhole;

  double Distance() const { return (position - focal_point).norm(); }

  // In pixels of a picture of this height; without a pinhole.
  double FocalLength(double height) const {
    return 0.5 * height / std::tan(0.5 * view_angle * std::numbers::pi / 180.0);
  }
};

// The camera's axes in the map frame, unit length; `back` is against the line of sight.
struct ViewAxes {
  Eigen::Vector3d right, up, back;
};
ViewAxes AxesOf(const ViewCamera& camera);

// Turns the camera around its focal point about view_up, counter-clockwise seen from above (degrees).
ViewCamera Azimuth(const ViewCamera& camera, double degrees);

// Raises the camera above the horizon of view_up, kept 1 degree short of the poles (degrees).
ViewCamera Elevation(const ViewCamera& camera, double degrees);

// Moves the camera to 1/factor of its distance.
ViewCamera Zoom(const ViewCamera& camera, double factor);

// One full turn about `up` in `frames` steps that starts at `first` and closes smoothly. (A view from above
// has its own view_up: that turns with it.)
std::vector<ViewCamera> OrbitPath(const ViewCamera& first, int frames, const Eigen::Vector3d& up);

// A slow swing about `up` from one side of `middle` to the other (`sweep` degrees in all), at rest at both
// ends.
std::vector<ViewCamera> SwingPath(const ViewCamera& middle, int frames, const Eigen::Vector3d& up,
                                  double sweep = 40.0);

// Exactly what a posed camera sees (map frame), principal point included, and the pose of such a view.
ViewCamera ThroughCamera(const Rigid3d& T_map_camera, const Camera& camera);
Rigid3d PoseOf(const ViewCamera& view);

// Through the eyes of a posed camera (map frame), with its vertical field of view.
ViewCamera FirstPerson(const Rigid3d& T_map_camera, const Camera& camera, double scene_depth);

// Behind and above a posed camera, looking where it looks; `distance` in map units.
ViewCamera Behind(const Rigid3d& T_map_camera, const Eigen::Vector3d& up, double distance);

// Gaussian smoothing over neighbouring frames; `radius` is the standard deviation in frames.
std::vector<ViewCamera> Smooth(const std::vector<ViewCamera>& path, double radius);

// `count` poses at equal steps of keyframe number along the keyframes, between them interpolated.
std::vector<Rigid3d> AlongKeyframes(const MapSnapshot& map, int count);

}  // namespace sqslam
