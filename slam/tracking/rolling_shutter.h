#pragma once

#include <span>

#include "slam/features/frame_features.h"
#include "slam/geometry/box2.h"
#include "slam/geometry/camera.h"
#include "slam/geometry/lie.h"
#include "slam/geometry/rigid3.h"

namespace sqslam {

struct RollingShutterOptions {
  bool estimate = true;  // learn the readout time from the images; off: trust the known one
  // Time from the first to the last row, known or to begin with. 0: the camera's, and where that is unknown,
  // all rows at once.
  double readout_ms = 0.0;
  double min_readout_ms = 5.0;  // a shorter time is taken for no rolling shutter at all
  // Corrects the sides of boxes as well as keypoints. Off: a detector's own errors are larger, and the real
  // kitchen's objects came out worse with it (docs/evaluation.md).
  bool boxes = false;

  void VisitFields(auto&& visit) {
    visit("estimate", estimate);
    visit("readout_ms", readout_ms, -100.0, 100.0);
    visit("min_readout_ms", min_readout_ms, 0.0, 100.0);
    visit("boxes", boxes);
  }
};

// The camera's motion, from two poses: rotation vector and translation per second, in the camera frame.
struct CameraMotion {
  Eigen::Vector3d turn = Eigen::Vector3d::Zero();      // rad/s: p' = turn x p + velocity
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  // map units/s

  static CameraMotion Between(const Rigid3d& T_last_map, const Rigid3d& T_current_map, double seconds);
  // Image motion of a point at p_camera, pixels per second.
  Eigen::Vector2d InImage(const Camera& camera, const Eigen::Vector3d& p_camera) const;
};

// A keypoint of the image and the point it shows.
struct ShutterObservation {
  int keypoint = 0;
  Eigen::Vector3d p_camera;
  double variance = 1.0;  // px^2
};

// Cameras without a global shutter read their image row by row while they move. Over the 20 to 30 ms of a
// phone or webcam a hand-held camera turns by several pixels, many times what a corner's place is uncertain
// by. The keypoints are carried to where they would be had the whole image been taken with its middle row: by
// the row's delay times the motion of the point in the image.
//
// The readout time comes from the images themselves: it is the one factor by which the residuals of tracked
// points follow delay times image motion, once each frame's pose has taken up what it can (linear least
// squares, poses marginalised; old frames are forgotten because the first ones were mapped without
// correction).
class RollingShutter {
 public:
  RollingShutter(const Camera& camera, const RollingShutterOptions& options);

  // Seconds; 0 while there is nothing to correct.
  double Readout() const;

  // The features as seen at once; the same where there is nothing to correct. `motion` is that of the camera
  // at this frame, `observations` tell how deep the scene is (nearby points' mean where a keypoint shows no
  // point).
  FrameFeaturesPtr Correct(const FrameFeaturesPtr& features, const CameraMotion& motion,
                           std::span<const ShutterObservation> observations) const;

  // A box around something `depth` before the camera (map units, 0: far away) as seen at once: each side from
  // the moment of its own row, those of the left and the right side from that of the box's middle.
  Box2d Correct(const Box2d& box, const CameraMotion& motion, double depth) const;

  // Learns from a tracked frame, corrected or not.
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
