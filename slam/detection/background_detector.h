#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <exception>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "slam/detection/detector.h"
#include "slam/io/frame.h"
#include "slam/util/stage_times.h"

namespace sqslam {

// Detection of boxes while the images are mapped.
struct DetectionOptions {
  // Name of a file in configs/detectors, or a YAML file; auto: the boxes of the sequence, or if it has none,
  // the first network with existing weights; none.
  std::string network = "auto";
  // Interval of frames that the network sees. 0: every third of a recording, which waits for the network; for
  // a live camera, the newest frame whenever the network is free.
  int interval = 0;

  void VisitFields(auto&& visit) {
    visit("network", network);
    visit("interval", interval, 0, 90);  // above this, boxes are not carried
  }
};

// The boxes of one frame, detected or carried from its neighbours.
struct FrameBoxes {
  std::int64_t frame_index = 0;
  double timestamp = 0.0;
  std::vector<Detection> detections;
  bool seen = false;      // true if the network processed the frame
  int quarter_turns = 0;  // of the frame
};

// Frames that a detector on its own thread processes.
enum class DetectionPace {
  kNewest,    // the newest one whenever the detector is free: nothing waits (live cameras)
  kEveryNth,  // the same ones on any machine: frames wait for the detector (recordings)
};

// Runs a detector on its own thread. Frames between two processed ones get their boxes by TrackBoxes, or none
// if too many frames lie between.
//
//   BackgroundDetector detector(std::make_shared<Detector>(network), options, DetectionPace::kEveryNth);
//   for each frame { for (const FrameBoxes& boxes : detector.Add(frame)) ... }
//   for (const FrameBoxes& boxes : detector.Finish()) ...
class BackgroundDetector {
 public:
  BackgroundDetector(std::shared_ptr<ObjectDetector> detector, const DetectionOptions& options,
                     DetectionPace pace);
  ~BackgroundDetector();  // drops unprocessed frames

  // Returns the boxes of earlier frames, in order, each once. At pace kEveryNth they are returned only when
  // the network is due, so that results don't depend on timing. Shares the frame's images, which must not
  // change any more. Rethrows errors of the network, as Finish does.
  std::vector<FrameBoxes> Add(const Frame& frame);
  std::vector<FrameBoxes> Finish();  // boxes of all remaining frames; the network always sees the last one

  // Stages `detection` (the network on one image) and `detection.following` (box tracking between two
  // images).
  std::map<std::string, StageTimes::Summary> Times() const { return times_.Summaries(); }

 private:
  void Work();
  // Returns the number of waiting frames to work on, the last of them by the network; 0: none is due.
  std::size_t Due() const;
  bool IsForNetwork(std::int64_t frame) const { return frame % interval_ == 0; }  // counted by Add
  std::vector<FrameBoxes> BoxesOf(const std::vector<Frame>& batch);  // the network sees the last frame only
  std::vector<FrameBoxes> TakeReady();

  std::shared_ptr<ObjectDetector> detector_;
  std::int64_t interval_;
  DetectionPace pace_;
  StageTimes times_;

  cv::Mat last_image_;                 // the latest one that the network has seen
  std::vector<Detection> last_boxes_;  // in it

  std::mutex mutex_;  // guards the following
  std::condition_variable changed_;
  std::deque<Frame> waiting_;
  std::vector<FrameBoxes> ready_;
  std::int64_t taken_ = 0;  // number of frames removed from `waiting_`
  bool busy_ = false;
  bool finishing_ = false;
  bool stopped_ = false;
  std::exception_ptr failure_;
  std::thread thread_;  // last: uses the other members
};

}  // namespace sqslam
