#include "slam/run/detection_feed.h"

#include <fmt/format.h>

#include <chrono>
#include <utility>

#include "slam/util/error.h"

namespace sqslam {
using Clock = std::chrono::steady_clock;

DetectionFeed::DetectionFeed(Detector detector, Options options) : options_(std::move(options)) {
  detector_.emplace(std::move(detector), options_.detection, options_.deterministic);
  writer_.emplace(options_.boxes, options_.settings, options_.file_pixels);
}

TrackingState DetectionFeed::Process(const Frame& given, System& system) {
  if (!detector_) {
    return system.Process(given);
  }
  const Clock::time_point started = Clock::now();
  Frame frame = given;
  frame.detections.clear();
  frame.detections_follow = true;
  detector_->Add(frame);
  const TrackingState state = system.Process(frame);
  Deliver(TakeBoxes(false), system);
  if (options_.frame_interval > 0.0 && !options_.deterministic) {
    detector_->WaitUntilFree(started + std::chrono::duration_cast<Clock::duration>(
                                           std::chrono::duration<double>(options_.frame_interval)));
  }
  return state;
}

void DetectionFeed::Finish(System& system) {
  if (!detector_ || Failed()) {
    return;
  }
  Deliver(TakeBoxes(true), system);
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
    failure_ = fmt::format("the detector fails: {}", e.err);
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

std::vector<FrameBoxes> DetectionFeed::TakeBoxes(bool all) {
  std::vector<FrameBoxes> boxes;
  Attempt([&] { boxes = all ? detector_->Finish() : detector_->Take(); });
  return boxes;
}

void DetectionFeed::Deliver(const std::vector<FrameBoxes>& frames, System& system) {
  for (const FrameBoxes& frame : frames) {
    system.AddDetections(frame.frame_index, frame.detections);
    Attempt([&] { writer_->Add(frame.timestamp, frame.detections); });
  }
}

}  // namespace sqslam
