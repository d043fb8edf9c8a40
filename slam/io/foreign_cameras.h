#pragma once

#include <yaml-cpp/yaml.h>

#include <filesystem>

#include "slam/geometry/camera.h"

namespace sqslam {

// Converts another program's calibration to the names of camera.yaml: Kalibr's camchain (its first camera,
// cam0), EuRoC's sensor.yaml, and ROS' camera_info. Anything else is returned unchanged. Throws InputError
// that begins with `path` for lens models other than radial-tangential pinhole cameras.
YAML::Node InOwnNames(const YAML::Node& root, const std::filesystem::path& path);

// Reads a camera of KITTI's calib.txt, such as 2 for the line "P2: ..." of 12 numbers; its images are
// rectified. `image`: gives the size. Throws InputError.
Camera ReadKittiCamera(const std::filesystem::path& calib, int number, const std::filesystem::path& image,
                       double fps);

}  // namespace sqslam
