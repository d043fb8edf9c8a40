#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "slam/geometry/camera.h"

namespace sqslam {

// A guess at a camera without a calibration: square pixels, no distortion, the principal point in the middle.
struct CameraGuess {
  Camera camera;
  std::string source;  // in words, what the focal length is taken from
};

// Assumes a field of view of 60 degrees along the longer side, the middle between a webcam's and a phone's.
CameraGuess GuessCamera(int width, int height, double fps);

// Takes the focal length from a photograph's EXIF, or guesses as above without it. Empty where the image
// cannot be read.
std::optional<CameraGuess> GuessCamera(const std::filesystem::path& image, double fps);

}  // namespace sqslam
