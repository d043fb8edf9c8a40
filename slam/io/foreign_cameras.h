#pragma once

#include <yaml-cpp/yaml.h>

#include <filesystem>

namespace sqslam {

// Reads another program's calibration in the names of camera.yaml: Kalibr's camchain (its first camera,
// cam0), EuRoC's sensor.yaml, ROS' camera_info, OpenCV's calibration (YAML, XML or JSON), ORB-SLAM2 and 3,
// stella_vslam, COLMAP's cameras.txt and cameras.bin, nerfstudio's transforms.json. Others are returned as
// they are. A size that the file does not tell (older files of ORB-SLAM2) is missing in the result. Throws
// InputError that begins with `path` for files that cannot be read, lens models other than radial-tangential
// and fisheye (equidistant), and for several different cameras; YAML::Exception for invalid YAML.
YAML::Node ReadCameraInOwnNames(const std::filesystem::path& path);

}  // namespace sqslam
