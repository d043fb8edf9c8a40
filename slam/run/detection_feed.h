#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>

#include "slam/detection/background_detector.h"
#include "slam/detection/network_options.h"
#include "slam/io/detection_writer.h"
#include "slam/io/sequence.h"
#include "slam/system.h"

namespace sqslam::app {

// The network that is to find the boxes of a sequence; empty where they come with it, or where there is none
// (a warning then says what would help). Throws as LoadNetwork does.
std::optional<NetworkOptions> ChooseNetwork(const DetectionOptions& options, const Sequence& sequence);

// Feeds frames to a system and, a little later, the boxes that a detector finds in them; keeps the boxes in a
// file.
class DetectionFeed {
 public:
  struct Options {
    DetectionOptions detection;
    bool deterministic = false;
    // A recording is read no faster than the camera took it while the network is at work, so that most
    // objects are seen. 0: whoever delivers the frames keeps the time.
    double frame_interval = 0.0;            // s
    std::filesystem::path boxes;            // boxes.txt to write
    std::string settings;                   // what the boxes are made with, its first line
    Eigen::Vector2d file_pixels{1.0, 1.0};  // see FilePixels()
  };

  DetectionFeed(Detector detector, Options options);

  TrackingState Process(Frame frame, System& system);

  // Waits for the boxes of the last frames, and gives the file its name.
  void Finish(System& system);

  // The network or the disk failed: nothing more will come. What was mapped is to be saved first; then
  // ThrowFailure throws InputError where there was one.
  bool Failed() const { return !failure_.empty(); }
  void ThrowFailure() const;

  std::map<std::string, StageTimes::Summary> Times() const { return detector_.Times(); }

 private:
  std::vector<FrameBoxes> TakeBoxes(bool all);
  void Deliver(const std::vector<FrameBoxes>& frames, System& system);

  Options options_;
  BackgroundDetector detector_;
  DetectionWriter writer_;
  std::string failure_;
};

}  // namespace sqslam::app
