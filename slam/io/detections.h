#pragma once

#include <cstddef>
#include <filesystem>
#include <fstream>
#include <map>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_set>
#include <vector>

#include "slam/geometry/box2.h"
#include "slam/util/file_lock.h"

namespace sqslam {

// Reads the boxes of a whole sequence: one list for each of the given frames.
//
// `path`: a file or folder in one of the formats of BoxFormat, detected by content. `frame_timestamps`:
// ascending. `images`: sizes of the images (px), to which boxes refer, one for each frame or one for all.
// `image_names`: paths of the images in the sequence's folder (ImageNames), empty for a video. Boxes are
// matched by path, or by the name without extension if only one image has it. Times are in seconds or, if
// more of them meet a frame then, in another unit of kTimeUnits or frame numbers.
//
// Clips boxes to the image and drops those fully outside. Warns (spdlog), at most once per kind or label,
// about boxes outside, boxes of missing frames, and unknown labels. Throws InputError that names file and
// line for a broken line.
std::vector<std::vector<Detection>> ReadDetections(const std::filesystem::path& path,
                                                   const std::vector<cv::Size>& images,
                                                   const std::vector<double>& frame_timestamps,
                                                   const std::vector<std::string>& image_names = {});

// Problems with the boxes of a sequence. Places are FILE:LINE.
struct DetectionReport {
  int boxes = 0;                                                   // in the file, including dropped ones
  std::map<std::string, int> labels;                               // with the number of their boxes
  std::map<std::string, std::vector<std::string>> unknown_labels;  // in neither list of coco.h
  std::vector<std::string> no_frame;                               // of missing frames: dropped
  std::vector<std::string> outside;                                // fully outside the image: dropped
  std::vector<std::string> clipped;                                // more than two pixels outside the image

  // Returns true if a run drops or clips any box.
  bool HasErrors() const { return !no_frame.empty() || !outside.empty() || !clipped.empty(); }
};

struct CheckedDetections {
  std::vector<std::vector<Detection>> frames;  // as ReadDetections returns them
  DetectionReport report;
};

// Like ReadDetections, with a report instead of warnings.
CheckedDetections CheckDetections(const std::filesystem::path& path, const std::vector<cv::Size>& images,
                                  const std::vector<double>& frame_timestamps,
                                  const std::vector<std::string>& image_names = {});

// Writes boxes.txt frame by frame. Until Finish(), the lines are in FILE.part, which marks each frame that is
// complete: an interrupted job resumes from there. The part is locked, since two writers would lose frames.
class DetectionWriter {
 public:
  // `settings`: how the boxes were made, one line; a part file with other settings is started over. Throws
  // InputError if the file cannot be written, or if another writer has it.
  DetectionWriter(std::filesystem::path path, std::string settings);

  // Returns true if an earlier job has done the frame of this time.
  bool IsDone(double timestamp) const;
  int Frames() const { return frames_; }  // done, by earlier jobs and this one
  int Boxes() const { return boxes_; }    // in them

  // `detections`: in pixels of the image in the file. Throws InputError on a full disk; frames added before
  // stay.
  void Add(double timestamp, const std::vector<Detection>& detections);

  // Completes the file and gives it its final name. Throws InputError if another program changed the part.
  void Finish();

 private:
  void Append(std::string_view text);  // throws InputError on a full disk

  std::filesystem::path path_;
  std::filesystem::path part_;
  std::optional<FileLock> lock_;  // on the part
  std::string settings_;
  std::unordered_set<std::string> done_;  // times, as written, of the frames that earlier jobs have done
  int frames_ = 0;
  int boxes_ = 0;
  std::size_t bytes_ = 0;  // of the part
  std::ofstream out_;
};

// Writes the boxes of all frames to a new boxes.txt. `boxes`: of each frame, in pixels of the image in the
// file.
void WriteBoxes(const std::filesystem::path& path, const std::string& settings,
                const std::vector<double>& timestamps, const std::vector<std::vector<Detection>>& boxes);

// Returns the lines of boxes.txt of the `count` objects with the most boxes, told apart by object ids if
// every line has one, otherwise by labels.
std::string LimitBoxes(const std::filesystem::path& boxes, int count);

}  // namespace sqslam
