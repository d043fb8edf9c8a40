#include "slam/tracking/ignored_regions.h"

#include <algorithm>
#include <cmath>

namespace sqslam {

void IgnoredRegions::See(double timestamp, const std::vector<Detection>& detections) {
  std::vector<Box2d> boxes;
  for (const Detection& detection : detections) {
    if (detection.score >= options_.min_score &&
        std::ranges::find(options_.labels, detection.label) != options_.labels.end()) {
      boxes.push_back(detection.box);
    }
  }
  if (!boxes.empty() && (boxes_.empty() || timestamp > timestamp_)) {  // detectors miss objects now and then
    boxes_ = std::move(boxes);
    timestamp_ = timestamp;
  }
}

cv::Mat IgnoredRegions::In(const Frame& frame) const {
  cv::Mat ignored = frame.ignored.clone();
  if (boxes_.empty() || std::abs(frame.timestamp - timestamp_) > options_.hold) {
    return ignored;
  }
  cv::Mat moving = cv::Mat::zeros(frame.gray.size(), CV_8UC1);
  for (const Box2d& box : boxes_) {
    const double x = options_.margin * box.width;
    const double y = options_.margin * box.height;
    const cv::Point first(static_cast<int>(std::floor(box.x - x)), static_cast<int>(std::floor(box.y - y)));
    const cv::Point end(static_cast<int>(std::ceil(box.x + box.width + x)),
                        static_cast<int>(std::ceil(box.y + box.height + y)));
    moving(cv::Rect(first, end) & cv::Rect({0, 0}, moving.size())).setTo(255);
  }
  if (cv::countNonZero(moving) > options_.max_share * static_cast<double>(moving.total())) {
    return ignored;
  }
  return ignored.empty() ? moving : cv::Mat(ignored | moving);
}

}  // namespace sqslam
