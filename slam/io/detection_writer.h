#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <fstream>
#include <string>
#include <unordered_set>
#include <vector>

#include "slam/geometry/detection.h"

namespace sqslam {

// boxes.txt, frame by frame. Until Finish() the lines stand in FILE.part, which says after each frame that it
// is complete: a job that was stopped goes on from there.
class DetectionWriter {
 public:
  // `file_pixels`: by what boxes are multiplied, see FilePixels(). `settings`: what they were made with, one
  // line. A part file of other settings is begun anew. Throws InputError where the file cannot be written.
  DetectionWriter(std::filesystem::path path, std::string settings,
                  const Eigen::Vector2d& file_pixels = {1.0, 1.0});

  // True where an earlier job has done the frame of this time.
  bool IsDone(double timestamp) const;
  int Frames() const { return static_cast<int>(done_.size()); }  // done, by earlier jobs and this one
  int Boxes() const { return boxes_; }                           // in them

  // Throws InputError on a full disk; what was added before stays.
  void Add(double timestamp, const std::vector<Detection>& detections);

  // Gives the file its name, whole.
  void Finish();

 private:
  std::filesystem::path path_;
  std::filesystem::path part_;
  std::string settings_;
  Eigen::Vector2d file_pixels_;
  std::unordered_set<std::string> done_;  // times as written
  int boxes_ = 0;
  std::ofstream out_;
};

}  // namespace sqslam
