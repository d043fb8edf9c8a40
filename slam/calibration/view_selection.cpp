#include "slam/calibration/view_selection.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "slam/util/statistics.h"

namespace sqslam {
namespace {

// Place of the whole board in the image, and how it leans.
using Descriptor = std::array<double, 6>;

Descriptor Describe(const BoardView& view, const std::vector<cv::Point3f>& board, cv::Size image) {
  std::vector<cv::Point2f> flat;
  for (const int id : view.ids) {
    const cv::Point3f& corner = board[static_cast<std::size_t>(id)];
    flat.emplace_back(corner.x, corner.y);
  }
  std::vector<cv::Point2f> all;
  for (const cv::Point3f& corner : board) {
    all.emplace_back(corner.x, corner.y);
  }
  const cv::Rect2f around = cv::boundingRect(all);
  std::vector<cv::Point2f> outline = {
      around.tl(), {around.br().x, around.y}, around.br(), {around.x, around.br().y}};
  const cv::Mat homography = cv::findHomography(flat, view.corners);
  if (homography.empty()) {
    return {};
  }
  std::vector<cv::Point2f> quad;
  cv::perspectiveTransform(outline, quad, homography);
  const auto side = [&](std::size_t a, std::size_t b) { return std::max(1e-3, cv::norm(quad[a] - quad[b])); };
  const cv::Point2f center = 0.25F * (quad[0] + quad[1] + quad[2] + quad[3]);
  const double area = std::max(1.0, cv::contourArea(quad));
  constexpr double kTilt =
      2.0;  // a tilt that makes one side a third longer counts like half the image's width
  return {center.x / image.width,
          center.y / image.height,
          0.5 * std::log(area / image.area()),
          kTilt * std::log(side(0, 3) / side(1, 2)),
          kTilt * std::log(side(0, 1) / side(3, 2)),
          0.5 * std::log(side(0, 1) / side(0, 3))};
}

double Distance(const Descriptor& a, const Descriptor& b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    sum += (a[i] - b[i]) * (a[i] - b[i]);
  }
  return std::sqrt(sum);
}

}  // namespace

std::vector<int> SelectViews(const std::vector<BoardView>& views, const CalibrationBoard& board,
                             cv::Size image, int count) {
  constexpr double kSame = 0.03;         // distance below which a view adds nothing
  constexpr double kMinSharpness = 0.6;  // of the sharp ones
  if (views.empty()) {
    return {};
  }
  const std::vector<cv::Point3f> corners = BoardCorners(board);
  std::vector<Descriptor> descriptors;
  std::vector<double> sharpness;
  for (const BoardView& view : views) {
    descriptors.push_back(Describe(view, corners, image));
    sharpness.push_back(view.sharpness);
  }
  const double reference = std::max(1e-6, LowerQuantile(std::move(sharpness), 0.8));
  std::vector<double> gain(views.size(), 1e3);  // to be the first, only sharpness counts
  std::vector<int> chosen;
  while (static_cast<int>(chosen.size()) < count) {
    int best = -1;
    double best_gain = kSame;
    for (std::size_t i = 0; i < views.size(); ++i) {
      const double relative = std::min(1.0, views[i].sharpness / reference);
      if (relative >= kMinSharpness && gain[i] * relative > best_gain) {
        best = static_cast<int>(i);
        best_gain = gain[i] * relative;
      }
    }
    if (best < 0) {
      break;
    }
    chosen.push_back(best);
    for (std::size_t i = 0; i < views.size(); ++i) {
      gain[i] = std::min(gain[i], Distance(descriptors[i], descriptors[static_cast<std::size_t>(best)]));
    }
  }
  std::sort(chosen.begin(), chosen.end());
  return chosen;
}

}  // namespace sqslam
