#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "slam/detection/background_detector.h"
#include "slam/io/detections.h"
#include "slam/system.h"

namespace sqslam {

// Feeds frames to a system and, a few frames later, the boxes that a detector finds in them, which it also
// writes to a file. Without a detector, frames keep the boxes they have.
class DetectionFeed {
 public:
  struct Options {
    DetectionOptions detection;
    DetectionPace pace = DetectionPace::kEveryNth;
    std::filesystem::path boxes;  // boxes.txt to write
    std::string sequence;         // name of the sequence, for the first line of the file
    cv::Size frame;               // size of the frames, px
    cv::Size file;                // see FileSize()
  };

  DetectionFeed() = default;
  DetectionFeed(std::shared_ptr<ObjectDetector> detector, Options options);

  TrackingState Process(const Frame& frame, System& system);

  // Waits for the boxes of the last frames and completes the file.
  void Finish(System& system);

  // Returns true if network or disk failed: no more boxes will come. Callers save the map first, then call
  // ThrowFailure, which throws InputError if anything failed.
  bool Failed() const { return !failure_.empty(); }
  void ThrowFailure() const;

  std::map<std::string, StageTimes::Summary> Times() const;
  int Seen() const { return seen_; }  // frames that the detector itself has processed

 private:
  void Attempt(const auto& work);  // does nothing after a failure; keeps the first failure
  void Deliver(const std::vector<FrameBoxes>& frames, System& system);

  Options options_;
  std::optional<BackgroundDetector> detector_;
  std::optional<DetectionWriter> writer_;
  std::string failure_;
  int seen_ = 0;
};

}  // namespace sqslam
