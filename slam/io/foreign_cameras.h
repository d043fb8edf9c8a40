#pragma once

#include <yaml-cpp/yaml.h>

#include <filesystem>

#include "slam/geometry/camera.h"
#include "slam/geometry/rigid3.h"

namespace sqslam {

// Converts another program's calibration to the names of camera.yaml: Kalibr's camchain (its first camera,
// cam0), EuRoC's sensor.yaml, and ROS' camera_info. Anything else is returned unchanged. Throws InputError
// that begins with `path` for lens models other than radial-tangential and fisheye (equidistant).
YAML::Node InOwnNames(const YAML::Node& root, const std::filesystem::path& path);

// Reads a camera of KITTI's calib.txt, such as 2 for the line "P2: ..." of 12 numbers; its images are
// rectified. `image`: gives the size. Throws InputError.
Camera ReadKittiCamera(const std::filesystem::path& calib, int number, const std::filesystem::path& image,
                       double fps);

// Returns T_body_camera of EuRoC's sensor.yaml (its T_BS). Throws InputError.
Rigid3d ReadEurocExtrinsics(const std::filesystem::path& sensor);

// Returns T_camera0_camera of a camera in KITTI's calib.txt: its centre in the frame of camera 0, in metres;
// the images are rectified to one orientation. Throws InputError.
Rigid3d ReadKittiExtrinsics(const std::filesystem::path& calib, int number);

}  // namespace sqslam
