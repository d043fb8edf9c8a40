#pragma once

#include <optional>
#include <span>

#include "slam/features/frame_features.h"
#include "slam/geometry/box2.h"
#include "slam/geometry/camera.h"
#include "slam/geometry/lie.h"
#include "slam/geometry/rigid3.h"

namespace sqslam {

struct RollingShutterOptions {
  bool estimate = true;  // estimate the readout time from the images; off: use the known one
  // Time from the first to the last row, known or as an initial value. 0: the camera's, or a global shutter
  // if that is unknown.
  double readout_ms = 0.0;
  // Corrects bounding boxes as well as keypoints. Off: a detector's own errors are larger, and the
  // correction made the real kitchen's objects worse (docs/evaluation.md).
  bool boxes = false;

  void VisitFields(auto&& visit) {
    visit("estimate", estimate);
    visit("readout_ms", readout_ms, -100.0, 100.0);
    visit("boxes", boxes);
  }
};

// Camera motion between two poses: rotation vector and translation per second, in the camera frame.
struct CameraMotion {
  Eigen::Vector3d turn = Eigen::Vector3d::Zero();      // rad/s: p' = turn x p + velocity
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  // map units/s

  static CameraMotion Between(const Rigid3d& T_last_map, const Rigid3d& T_current_map, double seconds);
  // Image motion of a point at p_camera, pixels per second.
  Eigen::Vector2d InImage(const Camera& camera, const Eigen::Vector3d& p_camera) const;
};

// A keypoint and the position of its map point.
struct ShutterObservation {
  int keypoint = 0;
  Eigen::Vector3d p_camera;
  double variance = 1.0;  // px^2
};

// Corrects keypoints for a rolling shutter. Phones and webcams read an image row by row in 20 to 30 ms, in
// which a hand-held camera turns by several pixels: many times the uncertainty of a corner. Keypoints are
// moved to where they would be if all rows had been taken with the middle one: by the row's delay times the
// point's image motion.
//
// The readout time is estimated from the images: it is the factor by which the residuals of tracked points
// follow delay times image motion, after each frame's pose has absorbed its part (linear least squares,
// poses marginalised). Old frames are forgotten because the first ones were mapped without correction.
class RollingShutter {
 public:
  RollingShutter(const Camera& camera, const RollingShutterOptions& options);

  // Returns the readout time in seconds; 0 if there is nothing to correct.
  double Readout() const;

  // Returns the camera's motion between two frames; nothing if they are too far apart in time for one motion,
  // or, because of wrong timestamps, so close that it would be mostly the error of the poses.
  std::optional<CameraMotion> Motion(const Rigid3d& T_last_map, const Rigid3d& T_current_map,
                                     double seconds) const;

  // Returns the features as if all rows were taken at once, or the same features if there is nothing to
  // correct. `motion`: of the camera at this frame. `observations` give the depth; keypoints without one take
  // the mean of nearby points.
  FrameFeaturesPtr Correct(const FrameFeaturesPtr& features, const CameraMotion& motion,
                           std::span<const ShutterObservation> observations) const;

  // Returns the bounding box of an object at `depth` (map units, 0: far away) as if all rows were taken at
  // once: top and bottom by the delay of their rows, left and right by that of the centre.
  Box2d Correct(const Box2d& box, const CameraMotion& motion, double depth) const;

  // Updates the readout time from a tracked frame, corrected or not.
  void Learn(const FrameFeatures& features, const CameraMotion& motion,
             std::span<const ShutterObservation> observations);

 private:
  double RowDelay(double raw_row) const;  // in units of the readout time, -0.5 to 0.5

  Camera camera_;
  RollingShutterOptions options_;
  double known_readout_ = 0.0;  // s
  double information_ = 0.0;    // 1/s^2
  double evidence_ = 0.0;       // information times readout time
};

}  // namespace sqslam
