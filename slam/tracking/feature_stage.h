#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <future>
#include <memory>
#include <mutex>
#include <opencv2/core.hpp>
#include <thread>

#include "slam/features/sift_extractor.h"
#include "slam/io/frame.h"
#include "slam/tracking/ignored_regions.h"
#include "slam/util/stage_times.h"

namespace sqslam {

// A frame's features, and the mask of the pixels where none were taken (8UC1, nonzero there; may be empty).
struct ExtractedFeatures {
  std::shared_ptr<const FrameFeatures> features;
  cv::Mat ignored;
};

// Extracts the features of frames: of those that are expected on a thread of its own, ahead of tracking. The
// features do not depend on it.
class FeatureStage {
 public:
  FeatureStage(const Camera& camera, const OrbOptions& orb, const MovingOptions& moving, StageTimes& times);
  ~FeatureStage();  // frames that were expected but never taken are left out
  FeatureStage(const FeatureStage&) = delete;
  FeatureStage& operator=(const FeatureStage&) = delete;

  void SetKind(FeatureKind kind) { kind_ = kind; }  // call before the first frame
  FeatureKind Kind() const { return kind_; }

  // Begins to extract the features of a frame that Take() gets later, in the same order.
  void Expect(const Frame& frame);
  ExtractedFeatures Take(const Frame& frame);

  // Takes boxes that a detector found in a frame after it was tracked.
  void AddDetections(double timestamp, const std::vector<Detection>& detections) {
    ignored_.AddDetections(timestamp, detections);
  }

 private:
  using Task = std::packaged_task<ExtractedFeatures()>;

  Task TaskFor(const Frame& frame);
  void Run(const std::stop_token& stop);

  Camera camera_;
  ScaleLevels levels_;
  OrbExtractor orb_;  // used by one task at a time
  FeatureKind kind_ = FeatureKind::kOrb;
  IgnoredRegions ignored_;
  StageTimes& times_;
  std::deque<std::pair<std::int64_t, std::future<ExtractedFeatures>>> expected_;  // by index of the frame
  std::mutex mutex_;
  std::condition_variable_any changed_;
  std::deque<Task> tasks_;  // guarded by mutex_
  std::jthread thread_;     // runs from the first expected frame on; last: joined before the rest goes
};

}  // namespace sqslam
