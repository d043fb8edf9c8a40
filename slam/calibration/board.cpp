#include "slam/calibration/board.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <limits>
#include <numeric>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "slam/calibration/charuco.h"
#include "slam/util/options.h"
#include "slam/util/statistics.h"
#include "slam/util/throw_if.h"

namespace sqslam {
namespace {

// Without DICT_, in the order of OpenCV's numbers.
const std::vector<std::string> kDictionaries = {
    "4X4_50",  "4X4_100", "4X4_250",  "4X4_1000", "5X5_50",  "5X5_100", "5X5_250",  "5X5_1000", "6X6_50",
    "6X6_100", "6X6_250", "6X6_1000", "7X7_50",   "7X7_100", "7X7_250", "7X7_1000", "ORIGINAL"};

// Returns null if the name is unknown.
cv::Ptr<cv::aruco::Dictionary> DictionaryOf(const CalibrationBoard& board) {
  const auto number = std::ranges::find(kDictionaries, board.dictionary) - kDictionaries.begin();
  return number < std::ssize(kDictionaries) ? charuco::PredefinedDictionary(static_cast<int>(number))
                                            : cv::Ptr<cv::aruco::Dictionary>();
}

// OpenCV's view of a checked ChArUco board, mm.
cv::Ptr<cv::aruco::CharucoBoard> MakeCharucoBoard(const CalibrationBoard& board) {
  return charuco::MakeBoard({board.columns, board.rows}, static_cast<float>(board.square_mm),
                            static_cast<float>(board.marker_mm), DictionaryOf(board));
}

// Adds a marker: its black area, then the white bits on it.
void AddMarker(const cv::Ptr<cv::aruco::Dictionary>& dictionary, int id, const cv::Rect2d& area,
               std::vector<BoardArea>& areas) {
  const int cells = dictionary->markerSize + 2;
  cv::Mat bits;
  charuco::DrawMarker(*dictionary, id, cells, bits);
  areas.push_back({area, true});
  const double side = area.width / cells;
  const auto is_white = [&](int x, int y) {
    return x < cells && y < cells && bits.at<std::uint8_t>(y, x) > 0;
  };
  const auto add = [&](int x, int y, int width, int height) {
    areas.push_back({{area.x + side * x, area.y + side * y, side * width, side * height}, false});
  };
  for (int y = 0; y < cells; ++y) {
    for (int x = 0; x < cells; ++x) {
      if (is_white(x, y)) {  // pairs leave no seam between adjacent cells
        add(x, y, is_white(x + 1, y) ? 2 : 1, 1);
        add(x, y, 1, is_white(x, y + 1) ? 2 : 1);
      }
    }
  }
}

constexpr int kMinCorners = 8;  // of a view

// Returns the smallest distance between two corners, a measure of the free space around each.
double Spacing(const std::vector<cv::Point2f>& corners) {
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < corners.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      least = std::min(least, cv::norm(corners[i] - corners[k]));
    }
  }
  return least;
}

// `room`: distance from a corner to the nearest edge that is not its own, in squares.
void Refine(const cv::Mat& gray, double room, std::vector<cv::Point2f>& corners) {
  constexpr int kMaxWindow = 11;  // px, half
  const int window = std::clamp(static_cast<int>(room * Spacing(corners)), 2, kMaxWindow);
  cv::cornerSubPix(gray, corners, {window, window}, {-1, -1},
                   {cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 50, 1e-3});
}

// Searches a smaller image, which is much faster and less sensitive to noise, and refines the corners in the
// full one.
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
  const cv::Ptr<cv::aruco::CharucoBoard> printed = MakeCharucoBoard(board);
  std::vector<std::vector<cv::Point2f>> markers;
  std::vector<int> marker_ids;
  cv::aruco::detectMarkers(gray, charuco::DictionaryOf(*printed), markers, marker_ids);
  if (marker_ids.empty()) {
    return false;
  }
  cv::aruco::interpolateCornersCharuco(markers, marker_ids, gray, printed, view.corners, view.ids);
  if (view.corners.size() > 1) {
    constexpr double kRoomShare = 0.8;  // of the distance to the nearest marker
    Refine(gray, kRoomShare * 0.5 * (1.0 - board.marker_mm / board.square_mm), view.corners);
  }
  return true;
}

// Drops corners that are outliers of a homography: the board is flat, except for lens distortion.
void DropOutliers(const CalibrationBoard& board, BoardView& view) {
  constexpr double kMaxError = 0.15;  // squares; lens distortion is less
  const std::vector<cv::Point3f> all = BoardCorners(board);
  std::vector<cv::Point2f> flat;
  for (const int id : view.ids) {
    const cv::Point3f& corner = all[id];
    flat.emplace_back(corner.x, corner.y);
  }
  cv::Mat good;
  if (flat.size() < 4 ||
      cv::findHomography(view.corners, flat, cv::RANSAC, kMaxError * board.square_mm, good).empty()) {
    view = {};
    return;
  }
  BoardView kept;
  for (int i = 0; i < good.rows; ++i) {
    if (good.at<std::uint8_t>(i) != 0) {
      kept.ids.push_back(view.ids[i]);
      kept.corners.push_back(view.corners[i]);
    }
  }
  view = kept;
}

// Collinear corners don't determine a pose.
bool SpansArea(const std::vector<cv::Point2f>& corners) {
  constexpr double kMinSide = 10.0;  // px
  const cv::RotatedRect around = cv::minAreaRect(corners);
  return std::min(around.size.width, around.size.height) >= kMinSide;
}

double Sharpness(const cv::Mat& gray, const std::vector<cv::Point2f>& corners) {
  constexpr int kHalfPatch = 5;  // px
  std::vector<double> steepness;
  for (const cv::Point2f& corner : corners) {
    const cv::Rect patch = cv::Rect(cvRound(corner.x) - kHalfPatch, cvRound(corner.y) - kHalfPatch,
                                    2 * kHalfPatch + 1, 2 * kHalfPatch + 1) &
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

void CheckBoard(const CalibrationBoard& board) {
  constexpr int kMinSquares = 3;
  constexpr int kMaxSquares = 100;
  const auto fits = [](int squares) { return squares >= kMinSquares && squares <= kMaxSquares; };
  ThrowIf<UsageError>(!fits(board.columns) || !fits(board.rows),
                      "a board of {} x {} squares, expected {} to {} per side", board.columns, board.rows,
                      kMinSquares, kMaxSquares);
  ThrowIf<UsageError>(!(board.square_mm > 0.0), "--square-mm {}: expected a length above 0", board.square_mm);
  if (board.kind != BoardKind::kCharuco) {
    return;
  }
  ThrowIf<UsageError>(!(board.marker_mm > 0.0 && board.marker_mm < board.square_mm),
                      "--marker-mm {}: expected less than the square's {}", board.marker_mm, board.square_mm);
  const cv::Ptr<cv::aruco::Dictionary> dictionary = DictionaryOf(board);
  if (!dictionary) {
    throw UsageError("--dictionary {}: expected one of {}{}", board.dictionary,
                     fmt::join(kDictionaries, ", "), DidYouMean(board.dictionary, kDictionaries));
  }
  const int available = dictionary->bytesList.rows;
  const int needed = board.columns * board.rows / 2;
  ThrowIf<UsageError>(
      available < needed,
      "--dictionary {}: has {} markers, expected one for each of the board's {} white squares",
      board.dictionary, available, needed);
}

std::string BoardText(const CalibrationBoard& board) {
  return board.kind == BoardKind::kChessboard
             ? fmt::format("chessboard, {} x {} squares of {} mm", board.columns, board.rows, board.square_mm)
             : fmt::format("ChArUco board, {} x {} squares of {} mm, {} markers of {} mm", board.columns,
                           board.rows, board.square_mm, board.dictionary, board.marker_mm);
}

std::vector<cv::Point3f> BoardCorners(const CalibrationBoard& board) {
  if (board.kind == BoardKind::kCharuco) {
    return charuco::CornersOf(*MakeCharucoBoard(board));
  }
  std::vector<cv::Point3f> corners;
  for (int y = 1; y < board.rows; ++y) {
    for (int x = 1; x < board.columns; ++x) {
      corners.emplace_back(static_cast<float>(x * board.square_mm), static_cast<float>(y * board.square_mm),
                           0.0F);
    }
  }
  return corners;
}

std::vector<BoardArea> BoardAreas(const CalibrationBoard& board) {
  std::vector<BoardArea> areas;
  const double side = board.square_mm;
  const bool with_markers = board.kind == BoardKind::kCharuco;
  const cv::Ptr<cv::aruco::Dictionary> dictionary = DictionaryOf(board);
  const double margin = 0.5 * (side - board.marker_mm);
  // The layout of OpenCV 4: on ChArUco boards the lowest row begins black, and markers are numbered row by
  // row.
  int marker = 0;
  for (int y = 0; y < board.rows; ++y) {
    for (int x = 0; x < board.columns; ++x) {
      const bool black = with_markers ? (board.rows - 1 - y) % 2 == x % 2 : (x + y) % 2 == 0;
      if (black) {
        areas.push_back({{x * side, y * side, side, side}, true});
      } else if (with_markers) {
        AddMarker(dictionary, marker++,
                  {x * side + margin, y * side + margin, board.marker_mm, board.marker_mm}, areas);
      }
    }
  }
  return areas;
}

std::optional<BoardView> FindBoard(const cv::Mat& gray, const CalibrationBoard& board) {
  BoardView view;
  const bool found = board.kind == BoardKind::kChessboard ? FindChessboard(gray, board, view)
                                                          : FindCharuco(gray, board, view);
  if (found) {
    DropOutliers(board, view);
  }
  if (!found || static_cast<int>(view.corners.size()) < std::min(kMinCorners, board.InnerCorners()) ||
      !SpansArea(view.corners)) {
    return std::nullopt;
  }
  view.sharpness = Sharpness(gray, view.corners);
  return view;
}

}  // namespace sqslam
