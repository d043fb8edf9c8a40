#pragma once

#include <string>

#include "slam/estimation/bundle_adjustment.h"
#include "slam/io/frame_source.h"
#include "slam/io/sequence.h"
#include "slam/run/run_host.h"
#include "slam/system_options.h"

namespace sqslam {

// An uncalibrated camera, as far as it is known.
struct AutoCamera {
  Camera guess;
  std::string guessed_by;        // source of the guess, in words; empty for a calibrated camera
  Camera camera;                 // best estimate
  double focal_deviation = 0.0;  // px; 0 if nothing was learnt
  bool learnt = false;           // from the images

  bool IsGuessed() const { return !guessed_by.empty(); }  // rather than calibrated

  void Adopt(const LearntCamera& learnt_camera);  // if it is trusted

  // Returns the same camera in pixels of the images in the files instead of the frames.
  AutoCamera InFiles(const Sequence& sequence) const;

  // Returns one line for people: guess, result and uncertainty. Empty for a calibrated camera.
  std::string Text() const;
};

// Returns the sequence's camera or, if it is a guess, an estimate from the images: maps the beginning of the
// sequence repeatedly without objects, each time with the focal length and radial coefficient that the
// previous map made most likely, until they converge. If the beginning is not enough (the camera hardly
// moves, or only forward), uses more of the sequence. Deterministic.
AutoCamera LearnCamera(const Sequence& sequence, const FrameRange& range, const SystemOptions& options,
                       RunHost& host);

}  // namespace sqslam
