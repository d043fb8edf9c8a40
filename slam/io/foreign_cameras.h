#pragma once

#include <yaml-cpp/yaml.h>

#include <filesystem>
#include <string>

namespace sqslam {

// Converts the text of another program's calibration to the names of camera.yaml: Kalibr's camchain (its
// first camera, cam0), EuRoC's sensor.yaml, ROS' camera_info, OpenCV's calibration (YAML or JSON), ORB-SLAM2
// and 3, stella_vslam, COLMAP's cameras.txt and nerfstudio's transforms.json. Others are returned as they
// are. A size that the file does not tell (older files of ORB-SLAM2) is missing in the result. Throws
// InputError that begins with `path` for lens models other than radial-tangential and fisheye (equidistant),
// and for several different cameras; YAML::Exception for invalid YAML.
YAML::Node CameraInOwnNames(const std::string& text, const std::filesystem::path& path);

}  // namespace sqslam
