#pragma once

#include <filesystem>
#include <functional>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "slam/geometry/camera.h"

namespace sqslam {

// Reads `width height fx fy cx cy distortion: [k1, k2, p1, p2, k3] fps readout_ms`; distortion, fps and
// readout_ms are optional (none, 30, unknown). Also reads calibrations of other programs
// (ReadCameraInOwnNames). `images`: returns their size if the file has none, as those of ORB-SLAM2; empty: it
// must have one. Throws InputError that names file and line for a missing entry, a focal length that is NaN,
// zero or negative, a side that is not a whole number of pixels from kMinImageSide to kMaxImageSide, a
// principal point far outside the image, or a readout time above 100 ms.
Camera ReadCamera(const std::filesystem::path& path, const std::function<cv::Size()>& images = {});

// `comment`: lines written at the top, each behind a #.
void WriteCamera(const std::filesystem::path& path, const Camera& camera, const std::string& comment = "");

// Returns the sorted names of the calibrations that come with the program, configs/cameras/NAME.yaml.
std::vector<std::string> CameraPresetNames();

// Returns the file that --camera names: an existing file, a path (with folder or extension) as it is, or else
// the preset of that name. Throws UsageError for an unknown name; its message lists the presets and the most
// similar one.
std::filesystem::path CameraFile(const std::string& file_or_preset);

// A guess for an uncalibrated camera: square pixels, no distortion, principal point in the middle.
struct CameraGuess {
  Camera camera;
  std::string source;      // source of the focal length, in words
  double deviation = 0.0;  // standard deviation of the log focal length
};

// Assumes a field of view of 60 degrees along the longer side, between that of a webcam and of a phone.
CameraGuess GuessCamera(int width, int height, double fps);

// Takes the focal length from a photograph's EXIF, or guesses as above without it. Returns nothing if the
// image cannot be read.
std::optional<CameraGuess> GuessCamera(const std::filesystem::path& image, double fps);

}  // namespace sqslam
