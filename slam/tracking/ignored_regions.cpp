#include "slam/tracking/ignored_regions.h"

#include <algorithm>
#include <cmath>

namespace sqslam {

void IgnoredRegions::AddDetections(double timestamp, const std::vector<Detection>& detections) {
  constexpr double kMinScore = 0.25;
  std::vector<Box2d> boxes;
  for (const Detection& detection : detections) {
    if (detection.score >= kMinScore && std::ranges::find(labels_, detection.label) != labels_.end()) {
      boxes.push_back(detection.box);
    }
  }
  if (!boxes.empty() && (boxes_.empty() || timestamp > timestamp_)) {
    boxes_ = std::move(boxes);
    timestamp_ = timestamp;
  }
}

cv::Mat IgnoredRegions::MaskOf(const Frame& frame) const {
  constexpr double kMaxAge = 0.3;   // s, between a frame and the boxes that apply to it
  constexpr double kMargin = 0.05;  // of a box's width and height, added on each side
  // Share of the image above which boxes are ignored: they hide more than they help, or the object is the
  // subject of the video (somebody walks around a parked car).
  constexpr double kMaxShare = 0.6;
  cv::Mat ignored = frame.ignored.clone();
  if (boxes_.empty() || std::abs(frame.timestamp - timestamp_) > kMaxAge) {
    return ignored;
  }
  cv::Mat moving = cv::Mat::zeros(frame.gray.size(), CV_8UC1);
  for (const Box2d& box : boxes_) {
    const double x = kMargin * box.width;
    const double y = kMargin * box.height;
    const cv::Point first(static_cast<int>(std::floor(box.x - x)), static_cast<int>(std::floor(box.y - y)));
    const cv::Point end(static_cast<int>(std::ceil(box.x + box.width + x)),
                        static_cast<int>(std::ceil(box.y + box.height + y)));
    moving(cv::Rect(first, end) & cv::Rect({0, 0}, moving.size())).setTo(255);
  }
  if (cv::countNonZero(moving) > kMaxShare * static_cast<double>(moving.total())) {
    return ignored;
  }
  return ignored.empty() ? moving : cv::Mat(ignored | moving);
}

}  // namespace sqslam
