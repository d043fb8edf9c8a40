#pragma once

#include <yaml-cpp/yaml.h>

#include <filesystem>

#include "slam/geometry/camera.h"

namespace sqslam {

// A calibration as other programs write it in the names of camera.yaml: Kalibr's camchain (its first camera,
// cam0), EuRoC's sensor.yaml, and ROS' camera_info. What is none of them is returned as it is. Throws
// InputError that begins with `path` for a lens model that is not the radial-tangential one of pinhole
// cameras.
YAML::Node InOwnNames(const YAML::Node& root, const std::filesystem::path& path);

// One camera of KITTI's calib.txt, such as 2 for the line "P2: ..." of 12 numbers, rectified already. `image`
// tells the size. Throws InputError.
Camera ReadKittiCamera(const std::filesystem::path& calib, int number, const std::filesystem::path& image,
                       double fps);

}  // namespace sqslam
