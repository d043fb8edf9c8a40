#include "slam/run/detection_feed.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <chrono>
#include <utility>

#include "slam/util/error.h"

namespace sqslam::app {
using Clock = std::chrono::steady_clock;

std::optional<NetworkOptions> ChooseNetwork(const DetectionOptions& options, const Sequence& sequence) {
  if (options.network == "none" || (options.network == "auto" && sequence.has_detections)) {
    if (!sequence.has_detections) {
      spdlog::warn("{}: no boxes.txt, no --detections and no --detector, so the map will hold no objects",
                   sequence.path.string());
    }
    return std::nullopt;
  }
  if (options.network != "auto") {
    return LoadNetwork(options.network);
  }
  for (const char* name : {"yolox-nano", "centernet"}) {  // the better one first
    try {
      return LoadNetwork(name);
    } catch (const InputError&) {  // its weights are not there
    }
  }
  spdlog::warn(
      "{}: no boxes and no detector, so the map will hold no objects; scripts/fetch-detector.sh obtains one",
      sequence.path.string());
  return std::nullopt;
}

DetectionFeed::DetectionFeed(Detector detector, Options options)
    : options_(std::move(options)),
      detector_(std::move(detector), options_.detection, options_.deterministic),
      writer_(options_.boxes, options_.settings, options_.file_pixels) {}

TrackingState DetectionFeed::Process(Frame frame, System& system) {
  const Clock::time_point started = Clock::now();
  frame.detections.clear();
  frame.detections_follow = true;
  detector_.Add(frame);
  const TrackingState state = system.Process(frame);
  Deliver(TakeBoxes(false), system);
  if (options_.frame_interval > 0.0 && !options_.deterministic) {
    detector_.WaitUntilFree(started + std::chrono::duration_cast<Clock::duration>(
                                          std::chrono::duration<double>(options_.frame_interval)));
  }
  return state;
}

void DetectionFeed::Finish(System& system) {
  if (Failed()) {
    return;
  }
  Deliver(TakeBoxes(true), system);
  if (!Failed()) {
    try {
      writer_.Finish();
    } catch (const InputError& e) {
      failure_ = e.what();
    }
  }
}

void DetectionFeed::ThrowFailure() const {
  if (Failed()) {
    throw InputError(failure_);
  }
}

std::vector<FrameBoxes> DetectionFeed::TakeBoxes(bool all) {
  try {
    return all ? detector_.Finish() : detector_.Take();
  } catch (const InputError& e) {
    failure_ = e.what();
  } catch (const cv::Exception& e) {
    failure_ = fmt::format("the detector fails: {}", e.err);
  }
  return {};
}

void DetectionFeed::Deliver(const std::vector<FrameBoxes>& frames, System& system) {
  for (const FrameBoxes& frame : frames) {
    system.AddDetections(frame.frame_index, frame.detections);
    try {
      if (!Failed()) {
        writer_.Add(frame.timestamp, frame.detections);
      }
    } catch (const InputError& e) {
      failure_ = e.what();
    }
  }
}

}  // namespace sqslam::app
