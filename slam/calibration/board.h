#pragma once

#include <array>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

namespace sqslam {

enum class BoardKind { kChessboard, kCharuco };
constexpr auto EnumNames(BoardKind) { return std::array{"chessboard", "charuco"}; }

// A flat board with corners at known positions.
struct CalibrationBoard {
  BoardKind kind = BoardKind::kChessboard;
  int columns = 10;  // squares, not inner corners
  int rows = 7;
  double square_mm = 25.0;
  double marker_mm = 18.0;            // ChArUco: side of a marker
  std::string dictionary = "4X4_50";  // ChArUco: OpenCV's name without DICT_

  int InnerCorners() const { return (columns - 1) * (rows - 1); }
};

// Throws UsageError unless the sizes are possible, a marker is smaller than its square, and the OpenCV
// dictionary has enough markers.
void CheckBoard(const CalibrationBoard& board);

// Returns for example "chessboard, 10 x 7 squares of 25 mm".
std::string BoardText(const CalibrationBoard& board);

// Returns the inner corners in the board's own frame, mm, z = 0, in the order of their ids.
std::vector<cv::Point3f> BoardCorners(const CalibrationBoard& board);

// A part of a printed board, mm from its top-left corner; later ones cover earlier ones.
struct BoardArea {
  cv::Rect2d area;
  bool black = true;
};
std::vector<BoardArea> BoardAreas(const CalibrationBoard& board);

// A board as seen in one image.
struct BoardView {
  std::string name;                  // of the image or frame, for messages
  std::vector<int> ids;              // of the found corners, indices into BoardCorners()
  std::vector<cv::Point2f> corners;  // px, distorted
  double sharpness = 0.0;  // steepness of the edges at the corners: 0.5 for a step from black to white within
                           // a pixel, less for blurred edges
};

// Finds the board, or enough of a ChArUco board for a view; a chessboard must be fully visible. `gray`: 8UC1.
std::optional<BoardView> FindBoard(const cv::Mat& gray, const CalibrationBoard& board);

}  // namespace sqslam
