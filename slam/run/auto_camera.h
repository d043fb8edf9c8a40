#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "slam/estimation/bundle_adjustment.h"
#include "slam/io/frame_source.h"
#include "slam/io/sequence.h"
#include "slam/system_options.h"

namespace sqslam::app {

// Where a camera nobody has calibrated stands.
struct AutoCamera {
  Camera guess;
  std::string guessed_by;        // in words; empty where the camera is known
  Camera camera;                 // the best known
  double focal_deviation = 0.0;  // px; 0 where nothing was learnt
  bool learnt = false;           // whether the images said what it is

  // Whether nobody knew it before the run.
  bool IsGuessed() const { return !guessed_by.empty(); }

  // What the images say of it, better than what was known.
  void Take(const LearntCamera& learnt_camera);

  // For people, one line: guess, what came out, and how sure it is.
  std::string Text() const;
};

// Maps the beginning of a sequence again and again without its objects, each time with the focal length and
// the radial coefficient that the map before made the most likely, until these settle. Where the beginning
// says too little (the camera hardly moves, or only forward), more of the sequence is taken. The same input
// gives the same camera. `stop` ends it early.
AutoCamera EstimateCamera(const Sequence& sequence, const FrameRange& range, const SystemOptions& options,
                          bool quiet, const std::function<bool()>& stop);

// camera.yaml of a result: the camera that was used in the end, with a comment on where it comes from.
void WriteUsedCamera(const std::filesystem::path& result, const Camera& camera,
                     const AutoCamera* automatic = nullptr);

}  // namespace sqslam::app
