#include "slam/detection/box_tracking.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>
#include <optional>
#include <utility>

#include "slam/util/statistics.h"

namespace sqslam {
namespace {

constexpr int kMinCorners = 4;   // consistent corners needed to carry a box
constexpr int kMaxCorners = 24;  // in a box
constexpr int kLevels = 3;       // pyramid levels above the image itself
const cv::Size kWindow(13, 13);  // pixels

using Pyramid = std::vector<cv::Mat>;

Pyramid MakePyramid(const cv::Mat& image) {
  Pyramid pyramid;
  cv::buildOpticalFlowPyramid(image, pyramid, kWindow, kLevels);
  return pyramid;
}

std::vector<cv::Point2f> CornersIn(const cv::Mat& image, const Box2d& box) {
  constexpr double kMinQuality = 0.02;  // of a corner, relative to the best one
  const cv::Rect rect = cv::Rect(cv::Point(std::lround(box.x), std::lround(box.y)),
                                 cv::Point(std::lround(box.x + box.width), std::lround(box.y + box.height))) &
                        cv::Rect({}, image.size());
  std::vector<cv::Point2f> corners;
  if (rect.width > kWindow.width && rect.height > kWindow.height) {
    const double distance = std::max(3.0, std::sqrt(rect.area() / static_cast<double>(kMaxCorners)) / 2.0);
    cv::goodFeaturesToTrack(image(rect), corners, kMaxCorners, kMinQuality, distance);
  }
  for (cv::Point2f& corner : corners) {
    corner += cv::Point2f(rect.tl());
  }
  return corners;
}

// Returns the box moved by the median growth and shift of its corners; nothing if the corners are unreliable.
std::optional<Box2d> MoveByCorners(const Box2d& box,
                                   const std::vector<std::pair<cv::Point2f, cv::Point2f>>& corners) {
  constexpr double kMinDistance = 4.0;  // px, between corners used for the growth
  constexpr double kMaxGrowth = 1.25;   // from one image to the next
  if (corners.size() < kMinCorners) {
    return std::nullopt;
  }
  std::vector<double> growths;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      const double before = cv::norm(corners[i].first - corners[j].first);
      if (before > kMinDistance) {
        growths.push_back(cv::norm(corners[i].second - corners[j].second) / before);
      }
    }
  }
  const double growth = growths.empty() ? 1.0 : UpperMedian(growths);
  if (growth > kMaxGrowth || growth < 1.0 / kMaxGrowth) {
    return std::nullopt;
  }
  std::vector<double> x;
  std::vector<double> y;
  for (const auto& [from, to] : corners) {
    x.push_back(to.x - growth * from.x);
    y.push_back(to.y - growth * from.y);
  }
  return Box2d{growth * box.x + UpperMedian(x), growth * box.y + UpperMedian(y), growth * box.width,
               growth * box.height};
}

// Returns the boxes in the next image; empty entries for lost ones.
std::vector<std::optional<Box2d>> TrackToNext(const cv::Mat& image, const Pyramid& from, const Pyramid& to,
                                              const std::vector<std::optional<Box2d>>& boxes) {
  constexpr float kMaxReturnError = 0.7F;  // px, forward-backward error of a corner
  std::vector<cv::Point2f> corners;
  std::vector<std::size_t> box_of;
  for (std::size_t b = 0; b < boxes.size(); ++b) {
    if (boxes[b]) {
      const std::vector<cv::Point2f> inside = CornersIn(image, *boxes[b]);
      corners.insert(corners.end(), inside.begin(), inside.end());
      box_of.resize(corners.size(), b);
    }
  }
  std::vector<cv::Point2f> tracked;
  std::vector<cv::Point2f> back = corners;
  std::vector<unsigned char> found;
  std::vector<unsigned char> found_back;
  std::vector<float> error;
  if (!corners.empty()) {
    cv::calcOpticalFlowPyrLK(from, to, corners, tracked, found, error, kWindow, kLevels);
    cv::calcOpticalFlowPyrLK(to, from, tracked, back, found_back, error, kWindow, kLevels,
                             {cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 30, 0.01},
                             cv::OPTFLOW_USE_INITIAL_FLOW);
  }
  std::vector<std::vector<std::pair<cv::Point2f, cv::Point2f>>> moves(boxes.size());
  for (std::size_t i = 0; i < corners.size(); ++i) {
    if (found[i] != 0 && found_back[i] != 0 && cv::norm(back[i] - corners[i]) < kMaxReturnError) {
      moves[box_of[i]].emplace_back(corners[i], tracked[i]);
    }
  }
  std::vector<std::optional<Box2d>> moved(boxes.size());
  for (std::size_t b = 0; b < boxes.size(); ++b) {
    if (boxes[b]) {
      moved[b] = MoveByCorners(*boxes[b], moves[b]);
    }
  }
  return moved;
}

// A tracked box of the first image and the box of the last image where it ends.
struct Pair {
  std::size_t first;
  std::size_t last;
  double iou;
};

// Pairs tracked boxes with overlapping boxes of their class in the last image, best first, each box once.
std::vector<Pair> PairWithLast(const std::vector<Box2d>& ends, const std::vector<Detection>& first,
                               const std::vector<Detection>& last) {
  constexpr double kMinIoU = 0.5;
  std::vector<Pair> candidates;
  for (std::size_t i = 0; i < first.size(); ++i) {
    for (std::size_t j = 0; j < last.size(); ++j) {
      const double iou = IoU(ends[i], last[j].box);
      if (first[i].label == last[j].label && iou >= kMinIoU) {
        candidates.push_back({i, j, iou});
      }
    }
  }
  std::ranges::stable_sort(candidates, std::greater{}, &Pair::iou);
  std::vector<Pair> chosen;
  for (const Pair& c : candidates) {
    if (std::ranges::none_of(
            chosen, [&](const Pair& other) { return other.first == c.first || other.last == c.last; })) {
      chosen.push_back(c);
    }
  }
  std::ranges::sort(chosen, {}, &Pair::first);
  return chosen;
}

Box2d Clipped(const Box2d& box, cv::Size size) {
  const double left = std::max(box.x, 0.0);
  const double top = std::max(box.y, 0.0);
  return {left, top, std::min(box.x + box.width, static_cast<double>(size.width)) - left,
          std::min(box.y + box.height, static_cast<double>(size.height)) - top};
}

}  // namespace

std::vector<std::vector<Detection>> TrackBoxes(const std::vector<cv::Mat>& images,
                                               const std::vector<Detection>& first,
                                               const std::vector<Detection>& last) {
  if (images.size() < 3) {
    return {};
  }
  const std::size_t steps = images.size() - 1;
  std::vector<std::vector<std::optional<Box2d>>> tracks(1);  // by image, then by box
  for (const Detection& detection : first) {
    tracks[0].push_back(detection.box);
  }
  Pyramid from = MakePyramid(images[0]);
  for (std::size_t i = 0; i < steps; ++i) {
    Pyramid to = MakePyramid(images[i + 1]);
    tracks.push_back(TrackToNext(images[i], from, to, tracks[i]));
    from = std::move(to);
  }
  std::vector<Box2d> ends;
  for (std::size_t b = 0; b < first.size(); ++b) {
    ends.push_back(tracks[steps][b].value_or(first[b].box));
  }
  std::vector<std::vector<Detection>> between(steps - 1);
  for (const Pair& pair : PairWithLast(ends, first, last)) {
    const Detection& start = first[pair.first];
    const Detection& end = last[pair.last];
    const bool is_tracked = tracks[steps][pair.first].has_value();
    for (std::size_t i = 1; i < steps; ++i) {
      const double t = static_cast<double>(i) / static_cast<double>(steps);
      // Spreads the error in the last image over the images.
      const Box2d moved = is_tracked ? *tracks[i][pair.first] : start.box;
      const Box2d& target = end.box;
      const Box2d& reached = ends[pair.first];
      const Box2d box = {moved.x + t * (target.x - reached.x), moved.y + t * (target.y - reached.y),
                         moved.width + t * (target.width - reached.width),
                         moved.height + t * (target.height - reached.height)};
      const Box2d clipped = Clipped(box, images[0].size());
      if (clipped.width >= 1.0 && clipped.height >= 1.0) {
        between[i - 1].push_back({start.label, start.score + t * (end.score - start.score), clipped});
      }
    }
  }
  return between;
}

}  // namespace sqslam
