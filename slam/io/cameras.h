#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "slam/geometry/camera.h"

namespace sqslam {

// Reads `width height fx fy cx cy distortion: [k1, k2, p1, p2, k3] fps readout_ms`; distortion, fps and
// readout_ms may be missing (none, 30, unknown). Throws InputError that names file and line for a missing
// entry, a focal length that is NaN, zero or negative, a size that is no positive whole number, a principal
// point far outside the image, or a readout time of more than 100 ms.
Camera ReadCamera(const std::filesystem::path& path);

// `comment`: lines that stand above, each behind a #.
void WriteCamera(const std::filesystem::path& path, const Camera& camera, const std::string& comment = "");

// Calibrations that come with the program, configs/cameras/NAME.yaml: their names, sorted.
std::vector<std::string> CameraPresetNames();

// Finds the file that --camera names: a file that exists, a path (with a folder or an extension) as it is,
// and otherwise the preset of that name. Throws UsageError for an unknown name, with the presets and the
// nearest.
std::filesystem::path CameraFile(const std::string& file_or_preset);

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
