#include "slam/calibration/board.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <opencv2/aruco/charuco.hpp>

#include "slam/calibration/charuco.h"
#include "slam/util/error.h"
#include "slam/util/options.h"

namespace sqslam {
namespace {

const std::map<std::string, cv::aruco::PREDEFINED_DICTIONARY_NAME>& Dictionaries() {
  static const std::map<std::string, cv::aruco::PREDEFINED_DICTIONARY_NAME> kDictionaries = {
      {"4X4_50", cv::aruco::DICT_4X4_50},          {"4X4_100", cv::aruco::DICT_4X4_100},
      {"4X4_250", cv::aruco::DICT_4X4_250},        {"4X4_1000", cv::aruco::DICT_4X4_1000},
      {"5X5_50", cv::aruco::DICT_5X5_50},          {"5X5_100", cv::aruco::DICT_5X5_100},
      {"5X5_250", cv::aruco::DICT_5X5_250},        {"5X5_1000", cv::aruco::DICT_5X5_1000},
      {"6X6_50", cv::aruco::DICT_6X6_50},          {"6X6_100", cv::aruco::DICT_6X6_100},
      {"6X6_250", cv::aruco::DICT_6X6_250},        {"6X6_1000", cv::aruco::DICT_6X6_1000},
      {"7X7_50", cv::aruco::DICT_7X7_50},          {"7X7_100", cv::aruco::DICT_7X7_100},
      {"7X7_250", cv::aruco::DICT_7X7_250},        {"7X7_1000", cv::aruco::DICT_7X7_1000},
      {"ORIGINAL", cv::aruco::DICT_ARUCO_ORIGINAL}};
  return kDictionaries;
}

// The cells of a marker: black all over, and the white bits on it.
void AddMarker(const cv::Ptr<cv::aruco::Dictionary>& dictionary, int id, const cv::Rect2d& area,
               std::vector<BoardArea>& areas) {
  const int cells = dictionary->markerSize + 2;
  cv::Mat bits;
  dictionary->drawMarker(id, cells, bits, 1);
  areas.push_back({area, true});
  const double side = area.width / cells;
  // Rows and columns both, so that no seam shows between cells that touch.
  const auto add_runs = [&](bool across) {
    for (int line = 0; line < cells; ++line) {
      const auto is_white = [&](int i) {
        return i < cells && (across ? bits.at<std::uint8_t>(line, i) : bits.at<std::uint8_t>(i, line)) > 0;
      };
      for (int i = 0; i < cells; ++i) {
        const int begin = i;
        while (is_white(i)) {
          ++i;
        }
        if (i > begin) {
          const double along = side * begin;
          const double length = side * (i - begin);
          areas.push_back({across ? cv::Rect2d(area.x + along, area.y + side * line, length, side)
                                  : cv::Rect2d(area.x + side * line, area.y + along, side, length),
                           false});
        }
      }
    }
  };
  add_runs(true);
  add_runs(false);
}

}  // namespace

cv::Ptr<cv::aruco::CharucoBoard> MakeCharucoBoard(const CalibrationBoard& board) {
  return cv::aruco::CharucoBoard::create(
      board.columns, board.rows, static_cast<float>(board.square_mm), static_cast<float>(board.marker_mm),
      cv::aruco::getPredefinedDictionary(Dictionaries().at(board.dictionary)));
}

void CheckBoard(const CalibrationBoard& board) {
  constexpr int kMinSquares = 3;
  constexpr int kMaxSquares = 100;
  const auto fits = [](int squares) { return squares >= kMinSquares && squares <= kMaxSquares; };
  if (!fits(board.columns) || !fits(board.rows)) {
    throw UsageError(fmt::format("a board of {} x {} squares, expected from {} to {} each way", board.columns,
                                 board.rows, kMinSquares, kMaxSquares));
  }
  if (!(board.square_mm > 0.0)) {
    throw UsageError(fmt::format("--square-mm {}: expected a length above 0", board.square_mm));
  }
  if (board.kind != CalibrationBoard::Kind::kCharuco) {
    return;
  }
  if (!(board.marker_mm > 0.0 && board.marker_mm < board.square_mm)) {
    throw UsageError(
        fmt::format("--marker-mm {}: expected less than the square's {}", board.marker_mm, board.square_mm));
  }
  const auto found = Dictionaries().find(board.dictionary);
  if (found == Dictionaries().end()) {
    std::vector<std::string> names;
    for (const auto& [name, number] : Dictionaries()) {
      names.push_back(name);
    }
    throw UsageError(fmt::format("--dictionary {}: expected one of {}; did you mean {}?", board.dictionary,
                                 fmt::join(names, ", "), NearestWord(board.dictionary, names)));
  }
  const int there = cv::aruco::getPredefinedDictionary(found->second)->bytesList.rows;
  const int needed = board.columns * board.rows / 2;
  if (there < needed) {
    throw UsageError(
        fmt::format("--dictionary {}: has {} markers, expected one for each of the board's {} "
                    "white squares",
                    board.dictionary, there, needed));
  }
}

std::string BoardText(const CalibrationBoard& board) {
  return board.kind == CalibrationBoard::Kind::kChessboard
             ? fmt::format("chessboard, {} x {} squares of {} mm", board.columns, board.rows, board.square_mm)
             : fmt::format("ChArUco board, {} x {} squares of {} mm, {} markers of {} mm", board.columns,
                           board.rows, board.square_mm, board.dictionary, board.marker_mm);
}

std::vector<cv::Point3f> BoardCorners(const CalibrationBoard& board) {
  if (board.kind == CalibrationBoard::Kind::kCharuco) {
    return MakeCharucoBoard(board)->chessboardCorners;
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
  const bool charuco = board.kind == CalibrationBoard::Kind::kCharuco;
  const cv::Ptr<cv::aruco::Dictionary> dictionary =
      charuco ? MakeCharucoBoard(board)->dictionary : cv::Ptr<cv::aruco::Dictionary>();
  const double margin = 0.5 * (side - board.marker_mm);
  // As OpenCV 4 lays its boards out: the lowest row begins black for ChArUco, markers are numbered row by
  // row.
  int marker = 0;
  for (int y = 0; y < board.rows; ++y) {
    for (int x = 0; x < board.columns; ++x) {
      const bool black = charuco ? (board.rows - 1 - y) % 2 == x % 2 : (x + y) % 2 == 0;
      if (black) {
        areas.push_back({{x * side, y * side, side, side}, true});
      } else if (charuco) {
        AddMarker(dictionary, marker++,
                  {x * side + margin, y * side + margin, board.marker_mm, board.marker_mm}, areas);
      }
    }
  }
  return areas;
}

}  // namespace sqslam
