#pragma once

#include <string>

#include "slam/estimation/camera_learning.h"
#include "slam/io/frame_source.h"
#include "slam/io/sequence.h"
#include "slam/run/run_host.h"
#include "slam/system_options.h"

namespace sqslam {

// An uncalibrated camera, as far as it is known.
struct AutoCamera {
  Camera guess;
  std::string guessed_by;        // source of the guess, in words; empty for a calibrated camera
  double guess_deviation = 0.0;  // standard deviation of the log focal length
  Camera camera;                 // best estimate
  double deviation = 0.0;        // standard deviation of the log focal length
  bool learnt = false;           // from the images

  bool IsGuessed() const { return !guessed_by.empty(); }  // rather than calibrated
  bool IsVague() const;  // the focal length is known to a few percent at best

  void Adopt(const LearntCamera& learnt_camera);  // if it is trusted

  // Returns the same camera in pixels of the images in the files instead of the frames.
  AutoCamera InFiles(const Sequence& sequence) const;

  // Returns one line for people: guess, result and its 95 % interval. Empty for a calibrated camera.
  std::string Text() const;
};

// The frames that LearnCamera() maps: those of `first` to find out which lens the camera has, then those of
// `second`, which begin at the same frame, again and again.
struct LearningFrames {
  FrameRange first;
  FrameRange second;
  std::int64_t most = 0;  // in all

  // Returns true if those of `second` can be mapped once more.
  bool Allow(std::int64_t played) const { return played + second.count <= most; }
};

// Returns the first minute of a film, thinned, and its first seconds. Of short sequences and of photographs
// all. `available`: frames in `range`.
LearningFrames ChooseLearningFrames(const FrameRange& range, std::int64_t available, double fps);

// Returns the guess with a fisheye lens instead.
AutoCamera WithFisheyeLens(AutoCamera camera);

// Returns the guess with a wider lens instead.
AutoCamera WithWideLens(AutoCamera camera);

// Returns true if rays through the border of the image moved so little that another map would move them by
// less than the focal length's deviation. A map that was made with a wrong camera holds back the estimate.
bool IsSettled(const AutoCamera& before, const AutoCamera& after);

// Returns the sequence's camera or, if it is a guess, an estimate from the images: maps some frames without
// objects, first with the usual and with a fisheye lens if nothing is known about it, then again with the
// focal length and coefficients that the last map made most likely, until they settle or the film's time is
// over. What is still vague is tried once more from a wider guess. Deterministic.
AutoCamera LearnCamera(const Sequence& sequence, const FrameRange& range, const SystemOptions& options,
                       RunHost& host);

}  // namespace sqslam
