#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "slam/geometry/camera.h"

namespace sqslam {

// What is odd about a file of boxes.
struct DetectionReport {
  int boxes = 0;
  int frames_with_boxes = 0;
  std::vector<double> frames_without;         // times of frames that have none
  std::map<std::string, int> labels;          // and how often they occur
  std::map<std::string, int> unknown_labels;  // those of no list
  std::vector<int> no_frame;                  // lines whose time is no frame's
  std::vector<int> outside;                   // lines whose box reaches more than 2 pixels out of the image

  // Boxes that a run would leave out or cut.
  bool HasErrors() const { return !no_frame.empty() || !outside.empty(); }
};

// `path` is a boxes.txt (ReadDetections says what is in it); frame_timestamps rise. Throws InputError that
// names file and line for a broken line.
DetectionReport CheckDetections(const std::filesystem::path& path, const Camera& camera,
                                const std::vector<double>& frame_timestamps);

}  // namespace sqslam
