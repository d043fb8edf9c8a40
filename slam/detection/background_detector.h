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

// Boxes that are found while the images are mapped.
struct DetectionOptions {
  // Name of a file in configs/detectors or a YAML file; auto: the boxes of the sequence, and where there are
  // none the first network whose weights are there; none.
  std::string network = "auto";
  // Frames from one that the network sees to the next. 0: every third of a recording, which waits for the
  // network; of a live camera the newest, whenever it is free.
  int interval = 0;
  bool follow = true;  // carry boxes through the frames between by the corners in them

  void VisitFields(auto&& visit) {
    visit("network", network);
    visit("interval", interval, 0, 90);  // farther, nothing is carried
    visit("follow", follow);
  }
};

// The boxes of one frame, found or carried there from its neighbours.
struct FrameBoxes {
  std::int64_t frame_index = 0;
  double timestamp = 0.0;
  std::vector<Detection> detections;
  bool seen = false;  // by the network itself
};

// Frames that a detector on a thread of its own looks at.
enum class DetectionPace {
  kNewest,    // the newest one whenever it is free: nothing waits for it (live cameras)
  kEveryNth,  // the same ones on a fast and on a slow machine: the frames wait for it (recordings)
};

// A detector on a thread of its own. The frames between two that it has seen get their boxes by TrackBoxes,
// or none where the detector is too slow for that.
//
//   BackgroundDetector detector(std::make_shared<Detector>(network), options, DetectionPace::kEveryNth);
//   for each frame { for (const FrameBoxes& boxes : detector.Add(frame)) ... }
//   for (const FrameBoxes& boxes : detector.Finish()) ...
class BackgroundDetector {
 public:
  BackgroundDetector(std::shared_ptr<ObjectDetector> detector, const DetectionOptions& options,
                     DetectionPace pace);
  ~BackgroundDetector();  // drops what has not been looked at

  // Copies nothing: the frame's images must not change any more. Returns the boxes of earlier frames, in
  // their order, each once. At pace kEveryNth these are those up to the last frame that the network was
  // given, once it is to be given the next, and none in between, so that they depend on no clock. Throws what
  // the network threw; so does Finish.
  std::vector<FrameBoxes> Add(const Frame& frame);
  std::vector<FrameBoxes> Finish();  // those of all others; the network sees the last frame in any case

  // Stages `detection` (the network on one image) and `detection.following` (box tracking through the frames
  // between two).
  std::map<std::string, StageTimes::Summary> Times() const { return times_.Summaries(); }

 private:
  void Work();
  // Returns the number of waiting frames to work on, the last of them by the network; 0: none is due.
  std::size_t Due() const;
  bool IsForNetwork(std::int64_t frame) const { return frame % interval_ == 0; }  // counted by Add
  std::vector<FrameBoxes> BoxesOf(const std::vector<Frame>& batch);  // the network sees the last frame
  std::vector<FrameBoxes> TakeReady();

  std::shared_ptr<ObjectDetector> detector_;
  bool follow_;
  std::int64_t interval_;
  DetectionPace pace_;
  StageTimes times_;

  cv::Mat last_image_;                 // the newest that the network has seen
  std::vector<Detection> last_boxes_;  // in it

  std::mutex mutex_;  // guards all below
  std::condition_variable changed_;
  std::deque<Frame> waiting_;
  std::vector<FrameBoxes> ready_;
  std::int64_t taken_ = 0;  // frames, out of `waiting_`
  bool busy_ = false;
  bool finishing_ = false;
  bool stopped_ = false;
  std::exception_ptr failure_;
  std::thread thread_;  // last: it uses the rest
};

}  // namespace sqslam
