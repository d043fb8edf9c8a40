#include "slam/tracking/feature_stage.h"

#include <utility>

namespace sqslam {

FeatureStage::FeatureStage(const Camera& camera, const OrbOptions& orb, const MovingOptions& moving,
                           StageTimes& times)
    : camera_(camera), levels_(orb), orb_(orb), ignored_(moving), times_(times) {}

FeatureStage::~FeatureStage() = default;

FeatureStage::Task FeatureStage::TaskFor(const Frame& frame) {
  if (!frame.detections_follow) {
    ignored_.AddDetections(frame.timestamp, frame.detections);
  }
  return Task([this, gray = frame.gray, bgr = frame.bgr, ignored = ignored_.MaskOf(frame)] {
    const StageTimes::Scope timer(times_, "tracking.features");
    return ExtractedFeatures{
        std::make_shared<const FrameFeatures>(kind_ == FeatureKind::kSift
                                                  ? SiftExtractor({}).Extract(bgr, camera_, levels_, ignored)
                                                  : orb_.Extract(gray, bgr, camera_, ignored)),
        ignored};
  });
}

void FeatureStage::Expect(const Frame& frame) {
  Task task = TaskFor(frame);
  expected_.emplace_back(frame.index, task.get_future());
  const std::lock_guard lock(mutex_);
  tasks_.push_back(std::move(task));
  if (!thread_.joinable()) {
    thread_ = std::jthread([this](const std::stop_token& stop) { Run(stop); });
  }
  changed_.notify_all();
}

ExtractedFeatures FeatureStage::Take(const Frame& frame) {
  if (!expected_.empty() && expected_.front().first == frame.index) {
    std::future<ExtractedFeatures> features = std::move(expected_.front().second);
    expected_.pop_front();
    return features.get();
  }
  Task task = TaskFor(frame);
  task();
  return task.get_future().get();
}

void FeatureStage::Run(const std::stop_token& stop) {
  while (true) {
    std::unique_lock lock(mutex_);
    if (!changed_.wait(lock, stop, [&] { return !tasks_.empty(); })) {
      return;
    }
    Task task = std::move(tasks_.front());
    tasks_.pop_front();
    lock.unlock();
    task();
  }
}

}  // namespace sqslam
