#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <unordered_set>
#include <vector>

#include "slam/geometry/box2.h"
#include "slam/geometry/camera.h"

namespace sqslam {

// Boxes of a whole sequence, as read: one list for each of the given frames.
//
// `path` is a file or a folder in one of the formats of BoxFormat, told apart by their content.
// frame_timestamps rise; image_names are the file names of the images, empty for a video.
//
// Boxes are clipped to the image, those wholly outside dropped. Warns (spdlog), at most once per kind or
// label, of boxes outside, boxes of frames that are not there, and labels that no list knows. Throws
// InputError that names file and line for a broken line.
std::vector<std::vector<Detection>> ReadDetections(const std::filesystem::path& path, const Camera& camera,
                                                   const std::vector<double>& frame_timestamps,
                                                   const std::vector<std::string>& image_names = {});

// Oddities among the boxes of a sequence, worth a look. Places are FILE:LINE.
struct DetectionReport {
  int boxes = 0;                                                   // in the file, those left out included
  std::map<std::string, int> labels;                               // and how often they occur
  std::map<std::string, std::vector<std::string>> unknown_labels;  // those of no list
  std::vector<std::string> no_frame;                               // of frames that are not there: left out
  std::vector<std::string> outside;                                // boxes wholly outside the image: left out
  std::vector<std::string> clipped;  // those that reach more than two pixels out of the image

  // Boxes that a run leaves out or cuts.
  bool HasErrors() const { return !no_frame.empty() || !outside.empty() || !clipped.empty(); }
};

struct CheckedDetections {
  std::vector<std::vector<Detection>> frames;  // as ReadDetections gives them
  DetectionReport report;
};

// ReadDetections with a report instead of warnings.
CheckedDetections CheckDetections(const std::filesystem::path& path, const Camera& camera,
                                  const std::vector<double>& frame_timestamps,
                                  const std::vector<std::string>& image_names = {});

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

// The lines of boxes.txt that belong to the `count` objects with the most boxes: by object ids where every
// line has one, else by labels. The comments stay.
std::string LimitBoxes(const std::filesystem::path& boxes, int count);

}  // namespace sqslam
