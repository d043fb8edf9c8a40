#pragma once

#include <opencv2/aruco.hpp>
#include <opencv2/aruco/charuco.hpp>
#include <opencv2/core/version.hpp>
#include <vector>

// OpenCV's ChArUco boards, whose interface changed with 4.7: Debian 12 has 4.6, Debian 13 has 4.10.
namespace sqslam::charuco {

#if CV_VERSION_MAJOR > 4 || (CV_VERSION_MAJOR == 4 && CV_VERSION_MINOR >= 7)

inline cv::Ptr<cv::aruco::Dictionary> PredefinedDictionary(int number) {
  return cv::makePtr<cv::aruco::Dictionary>(cv::aruco::getPredefinedDictionary(number));
}

// Draws a marker with one pixel per cell.
inline void DrawMarker(const cv::aruco::Dictionary& dictionary, int id, int cells, cv::Mat& bits) {
  dictionary.generateImageMarker(id, cells, bits, 1);
}

inline cv::Ptr<cv::aruco::CharucoBoard> MakeBoard(const cv::Size& squares, float square, float marker,
                                                  const cv::Ptr<cv::aruco::Dictionary>& dictionary) {
  auto board = cv::makePtr<cv::aruco::CharucoBoard>(squares, square, marker, *dictionary);
  board->setLegacyPattern(true);  // boards that were printed before look like this
  return board;
}

inline cv::Ptr<cv::aruco::Dictionary> DictionaryOf(const cv::aruco::CharucoBoard& board) {
  return cv::makePtr<cv::aruco::Dictionary>(board.getDictionary());
}

inline std::vector<cv::Point3f> CornersOf(const cv::aruco::CharucoBoard& board) {
  return board.getChessboardCorners();
}

#else

inline cv::Ptr<cv::aruco::Dictionary> PredefinedDictionary(int number) {
  return cv::aruco::getPredefinedDictionary(number);
}

// Draws a marker with one pixel per cell.
inline void DrawMarker(const cv::aruco::Dictionary& dictionary, int id, int cells, cv::Mat& bits) {
  dictionary.drawMarker(id, cells, bits, 1);
}

inline cv::Ptr<cv::aruco::CharucoBoard> MakeBoard(const cv::Size& squares, float square, float marker,
                                                  const cv::Ptr<cv::aruco::Dictionary>& dictionary) {
  return cv::aruco::CharucoBoard::create(squares.width, squares.height, square, marker, dictionary);
}

inline cv::Ptr<cv::aruco::Dictionary> DictionaryOf(const cv::aruco::CharucoBoard& board) {
  return board.dictionary;
}

inline std::vector<cv::Point3f> CornersOf(const cv::aruco::CharucoBoard& board) {
  return board.chessboardCorners;
}

#endif

}  // namespace sqslam::charuco
