#include "slam/dense/image_feed.h"

#include <algorithm>
#include <numeric>
#include <opencv2/imgproc.hpp>

#include "slam/io/image_files.h"

namespace sqslam {
namespace {

std::vector<std::int64_t> FramesToRead(const Sequence& sequence,
                                       const std::vector<std::vector<std::int64_t>>& jobs) {
  std::vector<std::int64_t> frames;
  if (!sequence.video_path.empty()) {
    frames.resize(sequence.frames.size());
    std::iota(frames.begin(), frames.end(), 0);
    return frames;
  }
  std::set<std::int64_t> needed;
  for (const std::vector<std::int64_t>& job : jobs) {
    needed.insert(job.begin(), job.end());
  }
  return {needed.begin(), needed.end()};
}

}  // namespace

Sequence WithFrames(const Sequence& sequence, const std::vector<std::int64_t>& frames) {
  Sequence some = sequence;
  some.frames.clear();
  for (const std::int64_t frame : frames) {
    some.frames.push_back(sequence.frames[static_cast<std::size_t>(frame)]);
  }
  return some;
}

ImageFeed::ImageFeed(const Sequence& sequence, const Camera& camera, const ShutterCorrection& shutter,
                     const std::vector<std::vector<std::int64_t>>& jobs)
    : jobs_(jobs),
      frames_(FramesToRead(sequence, jobs)),
      camera_(camera),
      shutter_(shutter),
      source_(WithFrames(sequence, frames_)) {
  for (const std::vector<std::int64_t>& job : jobs_) {
    for (const std::int64_t frame : job) {
      ++uses_[frame];
    }
    if (!job.empty()) {
      keyframes_.insert(job.front());
    }
  }
  const Camera recorded = ResizedCamera(sequence.camera, camera.width, camera.height);
  if (!recorded.HasDistortion()) {
    return;
  }
  places_x_.create(camera.height, camera.width, CV_32F);
  places_y_.create(camera.height, camera.width, CV_32F);
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const Eigen::Vector2d place =
          recorded.ProjectDistorted(camera.Unproject({static_cast<double>(x), static_cast<double>(y)}));
      places_x_.at<float>(y, x) = static_cast<float>(place.x());
      places_y_.at<float>(y, x) = static_cast<float>(place.y());
    }
  }
}

DenseImage ImageFeed::Prepare(std::int64_t index, const Frame& frame) const {
  const auto straight = [this, index](const cv::Mat& image) {
    cv::Mat result = Resized(image, {camera_.width, camera_.height});
    if (!places_x_.empty()) {
      cv::remap(cv::Mat(result), result, places_x_, places_y_, cv::INTER_LINEAR, cv::BORDER_REPLICATE);
    }
    return shutter_.Apply(index, result);
  };
  return {keyframes_.contains(index) ? straight(frame.bgr) : cv::Mat(), straight(frame.gray)};
}

std::optional<ImageFeed::Job> ImageFeed::Next() {
  const std::lock_guard lock(mutex_);
  if (next_ == jobs_.size()) {
    return std::nullopt;
  }
  Job job{next_++, {}};
  const std::vector<std::int64_t>& needed = jobs_[job.index];
  const std::int64_t last = needed.empty() ? -1 : *std::ranges::max_element(needed);
  while (read_ < last) {
    const std::optional<Frame> frame = source_.Next();
    if (!frame) {
      break;
    }
    read_ = frames_[static_cast<std::size_t>(frame->index)];
    if (const auto uses = uses_.find(read_); uses != uses_.end() && uses->second > 0) {
      images_.emplace(read_, Prepare(read_, *frame));
    }
  }
  for (const std::int64_t frame : needed) {
    const auto image = images_.find(frame);
    if (image != images_.end()) {
      job.images.insert(*image);
    }
    if (--uses_[frame] == 0) {
      images_.erase(frame);
    }
  }
  return job;
}

}  // namespace sqslam
