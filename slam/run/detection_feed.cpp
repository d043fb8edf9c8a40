#include "slam/run/detection_feed.h"

#include <fmt/format.h>

#include <exception>
#include <utility>

#include "slam/io/sequence.h"
#include "slam/util/error.h"

namespace sqslam {

DetectionFeed::DetectionFeed(std::shared_ptr<ObjectDetector> detector, Options options)
    : options_(std::move(options)) {
  const std::string settings = fmt::format("boxes of {}, {}", options_.sequence, detector->Settings());
  detector_.emplace(std::move(detector), options_.detection, options_.pace);
  writer_.emplace(options_.boxes, settings);
}

TrackingState DetectionFeed::Process(const Frame& given, System& system) {
  if (!detector_) {
    return system.Process(given);
  }
  Frame frame = given;
  frame.detections.clear();
  frame.detections_follow = true;
  std::vector<FrameBoxes> boxes;
  Attempt([&] { boxes = detector_->Add(frame); });
  Deliver(boxes, system);
  return system.Process(frame);
}

void DetectionFeed::Finish(System& system) {
  if (!detector_ || Failed()) {
    return;
  }
  std::vector<FrameBoxes> boxes;
  Attempt([&] { boxes = detector_->Finish(); });
  Deliver(boxes, system);
  Attempt([this] { writer_->Finish(); });
}

void DetectionFeed::Attempt(const auto& work) {
  try {
    if (!Failed()) {
      work();
    }
  } catch (const InputError& e) {
    failure_ = e.what();
  } catch (const cv::Exception& e) {
    failure_ = fmt::format("the detector failed: {}", e.err);
  } catch (const std::exception& e) {  // a detector of the embedding program may throw anything
    failure_ = fmt::format("the detector failed: {}", e.what());
  }
}

void DetectionFeed::ThrowFailure() const {
  if (Failed()) {
    throw InputError(failure_);
  }
}

std::map<std::string, StageTimes::Summary> DetectionFeed::Times() const {
  return detector_ ? detector_->Times() : std::map<std::string, StageTimes::Summary>{};
}

void DetectionFeed::Deliver(const std::vector<FrameBoxes>& frames, System& system) {
  for (const FrameBoxes& frame : frames) {
    seen_ += frame.seen ? 1 : 0;
    system.AddDetections(frame.frame_index, frame.detections);
    Attempt([&] {
      writer_->Add(frame.timestamp,
                   InFilePixels(frame.detections, options_.frame, options_.file, frame.quarter_turns));
    });
  }
}

}  // namespace sqslam
