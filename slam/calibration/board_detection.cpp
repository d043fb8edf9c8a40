#include "slam/calibration/board_detection.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <opencv2/aruco.hpp>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "slam/calibration/charuco.h"
#include "slam/util/statistics.h"

namespace sqslam {
namespace {

constexpr int kMinCorners = 8;  // of a view

// Distance to the nearest other corner: how much room there is around one.
double Spacing(const std::vector<cv::Point2f>& corners) {
  std::vector<double> nearest;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < corners.size(); ++k) {
      if (i != k) {
        least = std::min(least, cv::norm(corners[i] - corners[k]));
      }
    }
    nearest.push_back(least);
  }
  return *std::min_element(nearest.begin(), nearest.end());
}

// `room`: around a corner to the next thing that is none of its edges, in squares.
void Refine(const cv::Mat& gray, double room, std::vector<cv::Point2f>& corners) {
  constexpr int kMaxWindow = 11;  // px, half
  const int window = std::clamp(static_cast<int>(room * Spacing(corners)), 2, kMaxWindow);
  cv::cornerSubPix(gray, corners, {window, window}, {-1, -1},
                   {cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 50, 1e-3});
}

// The search runs on a smaller image, which is much faster and blind to noise; corners are refined in the
// whole one.
bool FindChessboard(const cv::Mat& gray, const CalibrationBoard& board, BoardView& view) {
  constexpr int kSearched = 960;  // px, longer side
  constexpr int kFlags =
      cv::CALIB_CB_ADAPTIVE_THRESH | cv::CALIB_CB_NORMALIZE_IMAGE | cv::CALIB_CB_FAST_CHECK;
  const double scale = std::min(1.0, static_cast<double>(kSearched) / std::max(gray.cols, gray.rows));
  cv::Mat searched = gray;
  if (scale < 1.0) {
    cv::resize(gray, searched, {}, scale, scale, cv::INTER_AREA);
  }
  const cv::Size inner(board.columns - 1, board.rows - 1);
  if (!cv::findChessboardCorners(searched, inner, view.corners, kFlags)) {
    return false;
  }
  for (cv::Point2f& corner : view.corners) {
    corner = {static_cast<float>((corner.x + 0.5) / scale - 0.5),
              static_cast<float>((corner.y + 0.5) / scale - 0.5)};
  }
  Refine(gray, 0.35, view.corners);
  view.ids.resize(view.corners.size());
  std::iota(view.ids.begin(), view.ids.end(), 0);
  return true;
}

bool FindCharuco(const cv::Mat& gray, const CalibrationBoard& board, BoardView& view) {
  const cv::Ptr<cv::aruco::CharucoBoard> charuco = MakeCharucoBoard(board);
  std::vector<std::vector<cv::Point2f>> markers;
  std::vector<int> marker_ids;
  cv::aruco::detectMarkers(gray, charuco->dictionary, markers, marker_ids);
  if (marker_ids.empty()) {
    return false;
  }
  cv::aruco::interpolateCornersCharuco(markers, marker_ids, gray, charuco, view.corners, view.ids);
  if (view.corners.size() > 1) {
    constexpr double kShare = 0.8;  // of the way to the nearest marker
    Refine(gray, kShare * 0.5 * (1.0 - board.marker_mm / board.square_mm), view.corners);
  }
  return true;
}

// Takes away corners that lie nowhere near where the others have them: but for the lens, the board is flat.
void DropStrays(const CalibrationBoard& board, BoardView& view) {
  constexpr double kSlack = 0.15;  // squares; lenses bend a board by less
  const std::vector<cv::Point3f> all = BoardCorners(board);
  std::vector<cv::Point2f> flat;
  for (const int id : view.ids) {
    const cv::Point3f& corner = all[static_cast<std::size_t>(id)];
    flat.emplace_back(corner.x, corner.y);
  }
  cv::Mat good;
  if (flat.size() < 4 ||
      cv::findHomography(view.corners, flat, cv::RANSAC, kSlack * board.square_mm, good).empty()) {
    view = {};
    return;
  }
  BoardView kept;
  for (int i = 0; i < good.rows; ++i) {
    if (good.at<std::uint8_t>(i) != 0) {
      kept.ids.push_back(view.ids[static_cast<std::size_t>(i)]);
      kept.corners.push_back(view.corners[static_cast<std::size_t>(i)]);
    }
  }
  view = kept;
}

// Corners on one line tell no pose.
bool SpansAnArea(const std::vector<cv::Point2f>& corners) {
  constexpr double kMinSide = 10.0;  // px
  const cv::RotatedRect around = cv::minAreaRect(corners);
  return std::min(around.size.width, around.size.height) >= kMinSide;
}

double Sharpness(const cv::Mat& gray, const std::vector<cv::Point2f>& corners) {
  constexpr int kReach = 5;  // px
  std::vector<double> steepness;
  for (const cv::Point2f& corner : corners) {
    const cv::Rect patch =
        cv::Rect(cvRound(corner.x) - kReach, cvRound(corner.y) - kReach, 2 * kReach + 1, 2 * kReach + 1) &
        cv::Rect(0, 0, gray.cols, gray.rows);
    cv::Mat x;
    cv::Mat y;
    cv::Sobel(gray(patch), x, CV_32F, 1, 0, 3, 1.0 / 8.0);
    cv::Sobel(gray(patch), y, CV_32F, 0, 1, 3, 1.0 / 8.0);
    cv::Mat length;
    cv::magnitude(x, y, length);
    double steepest = 0.0;
    double darkest = 0.0;
    double brightest = 0.0;
    cv::minMaxLoc(length, nullptr, &steepest);
    cv::minMaxLoc(gray(patch), &darkest, &brightest);
    steepness.push_back(steepest / std::max(1.0, brightest - darkest));
  }
  return UpperMedian(std::move(steepness));
}

}  // namespace

std::optional<BoardView> FindBoard(const cv::Mat& gray, const CalibrationBoard& board) {
  BoardView view;
  const bool found = board.kind == CalibrationBoard::Kind::kChessboard ? FindChessboard(gray, board, view)
                                                                       : FindCharuco(gray, board, view);
  if (found) {
    DropStrays(board, view);
  }
  if (!found || static_cast<int>(view.corners.size()) < std::min(kMinCorners, board.InnerCorners()) ||
      !SpansAnArea(view.corners)) {
    return std::nullopt;
  }
  view.sharpness = Sharpness(gray, view.corners);
  return view;
}

}  // namespace sqslam
