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

// Feeds frames to a system and, a little later, the boxes that a detector finds in them, which it also keeps
// in a file. Without a detector frames are passed on with the boxes that they have.
class DetectionFeed {
 public:
  struct Options {
    DetectionOptions detection;
    DetectionPace pace = DetectionPace::kEveryNth;
    std::filesystem::path boxes;            // boxes.txt to write
    std::string sequence;                   // what the boxes are of, for its first line
    Eigen::Vector2d file_pixels{1.0, 1.0};  // see FilePixels()
  };

  DetectionFeed() = default;
  DetectionFeed(std::shared_ptr<ObjectDetector> detector, Options options);

  TrackingState Process(const Frame& frame, System& system);

  // Waits for the boxes of the last frames, and gives the file its name.
  void Finish(System& system);

  // The network or the disk failed: nothing more will come. What was mapped is to be saved first; then
  // ThrowFailure throws InputError where there was one.
  bool Failed() const { return !failure_.empty(); }
  void ThrowFailure() const;

  std::map<std::string, StageTimes::Summary> Times() const;
  int Seen() const { return seen_; }  // frames that the network itself has looked at

 private:
  void Attempt(const auto& work);  // unless something has failed; keeps what fails now
  void Deliver(const std::vector<FrameBoxes>& frames, System& system);

  Options options_;
  std::optional<BackgroundDetector> detector_;
  std::optional<DetectionWriter> writer_;
  std::string failure_;
  int seen_ = 0;
};

}  // namespace sqslam
