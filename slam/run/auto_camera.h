#pragma once

#include <string>

#include "slam/estimation/bundle_adjustment.h"
#include "slam/io/frame_source.h"
#include "slam/io/sequence.h"
#include "slam/run/run_host.h"
#include "slam/system_options.h"

namespace sqslam {

// A camera that nobody has calibrated, as far as it is known.
struct AutoCamera {
  Camera guess;
  std::string guessed_by;        // in words; empty where the camera is known
  Camera camera;                 // the best known
  double focal_deviation = 0.0;  // px; 0 where nothing was learnt
  bool learnt = false;           // from the images

  bool IsGuessed() const { return !guessed_by.empty(); }  // rather than calibrated

  void Take(const LearntCamera& learnt_camera);  // if it can be trusted

  // For people, one line: guess, what came out, and how sure it is; empty for a calibrated camera.
  std::string Text() const;
};

// Returns the sequence's camera or, where it is a guess, what the images say of it: maps the beginning of the
// sequence again and again without its objects, each time with the focal length and the radial coefficient
// that the map before made the most likely, until these settle. Where the beginning says too little (the
// camera hardly moves, or only forward), more of the sequence is taken. The same input gives the same camera.
AutoCamera LearnCamera(const Sequence& sequence, const FrameRange& range, const SystemOptions& options,
                       RunHost& host);

}  // namespace sqslam
