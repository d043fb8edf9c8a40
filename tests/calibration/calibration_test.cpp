#include "slam/calibration/calibration.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

#include "slam/util/error.h"
#include "tests/support/board_scene.h"

namespace sqslam {
namespace {

using testing::BoardPose;
using testing::BoardScene;
using ::testing::Contains;
using ::testing::HasSubstr;

const Camera kCamera{640, 480, 520.0, 523.0, 311.0, 246.0, {-0.21, 0.06, 0.001, -0.0015, 0.0}};

CalibrationBoard Chessboard() { return {BoardKind::kChessboard, 10, 7, 25.0}; }
CalibrationBoard Charuco() { return {BoardKind::kCharuco, 9, 6, 30.0, 18.0, "4X4_50"}; }

std::vector<BoardView> Views(const CalibrationBoard& board, int count,
                             const std::function<Rigid3d(int)>& pose) {
  const BoardScene scene(board, kCamera);
  std::vector<BoardView> views;
  for (int i = 0; i < count; ++i) {
    cv::Mat gray;
    cv::cvtColor(scene.Render(pose(i)), gray, cv::COLOR_BGR2GRAY);
    if (std::optional<BoardView> view = FindBoard(gray, board)) {
      view->name = "view " + std::to_string(i);
      views.push_back(std::move(*view));
    }
  }
  return views;
}

std::vector<BoardView> Views(const CalibrationBoard& board, int count) {
  // A ChArUco board need not be seen whole.
  const double reach = board.kind == BoardKind::kCharuco ? 1.5 : 1.0;
  return Views(board, count, [&](int i) { return BoardPose(board, kCamera, i, reach); });
}

// Largest distance between the pixels of one ray in two cameras, px, without the mean shift: boards hardly
// determine rotations of the camera by less than a tenth of a degree.
double LargestDifference(const Camera& a, const Camera& b) {
  std::vector<Eigen::Vector2d> differences;
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (int y = 0; y <= 480; y += 20) {
    for (int x = 0; x <= 640; x += 20) {
      const Eigen::Vector3d ray = a.Unproject(a.Undistort({x, y}));
      differences.emplace_back(b.ProjectDistorted(ray) - Eigen::Vector2d(x, y));
      mean += differences.back();
    }
  }
  mean /= static_cast<double>(differences.size());
  double largest = 0.0;
  for (const Eigen::Vector2d& difference : differences) {
    largest = std::max(largest, (difference - mean).norm());
  }
  return largest;
}

class CalibrationTest : public ::testing::TestWithParam<CalibrationBoard> {};

TEST_P(CalibrationTest, RecoversCamera) {
  const std::vector<BoardView> views = Views(GetParam(), 26);
  EXPECT_GE(views.size(), 18U);
  const Calibration c = Calibrate(views, GetParam(), {640, 480});
  EXPECT_NEAR(c.camera.fx, kCamera.fx, 0.003 * kCamera.fx);
  EXPECT_NEAR(c.camera.fy, kCamera.fy, 0.003 * kCamera.fy);
  EXPECT_NEAR(c.camera.cx, kCamera.cx, 1.0);
  EXPECT_NEAR(c.camera.cy, kCamera.cy, 1.0);
  EXPECT_LT(LargestDifference(kCamera, c.camera), 0.3);
  EXPECT_LT(c.rms, 0.15);
  EXPECT_GT(c.covered, 0.7);
  EXPECT_LT(std::abs(c.camera.fx - kCamera.fx), 5.0 * c.intrinsic_deviation[0]);
  EXPECT_TRUE(Weaknesses(c).empty()) << Weaknesses(c).front();
}

INSTANTIATE_TEST_SUITE_P(Boards, CalibrationTest, ::testing::Values(Chessboard(), Charuco()),
                         [](const auto& info) {
                           return info.param.kind == BoardKind::kCharuco ? "charuco" : "chessboard";
                         });

TEST(Calibration, DropsAndNamesOutlierViews) {
  std::vector<BoardView> views = Views(Chessboard(), 20);
  const std::size_t before = views.size();
  for (std::size_t i = 0; i < views[3].corners.size(); ++i) {  // a bent board
    views[3].corners[i].x += 4.0F * std::sin(0.9F * static_cast<float>(i));
  }
  views[5].corners[7].y += 6.0F;  // a corner that is none
  const Calibration c = Calibrate(views, Chessboard(), {640, 480});
  EXPECT_THAT(c.dropped_views, Contains(HasSubstr("view 3 ")));
  EXPECT_GE(c.dropped_corners, 1);
  EXPECT_LT(c.views.size(), before);
  EXPECT_NEAR(c.camera.fx, kCamera.fx, 0.003 * kCamera.fx);
}

TEST(Calibration, WarnsOfParallelBoards) {
  const CalibrationBoard board = Chessboard();
  const std::vector<BoardView> views = Views(board, 8, [&](int i) {
    return Rigid3d{Eigen::Quaterniond(Eigen::AngleAxisd(0.02 * i, Eigen::Vector3d::UnitX())),
                   Eigen::Vector3d(-125.0 + 3.0 * i, -87.0, 500.0 + 20.0 * i)};
  });
  ASSERT_GE(views.size(), 3U);
  const std::vector<std::string> weaknesses = Weaknesses(Calibrate(views, board, {640, 480}));
  EXPECT_THAT(weaknesses, Contains(HasSubstr("of the image, expected 70 %")));
  EXPECT_THAT(weaknesses, Contains(HasSubstr("nearly parallel")));
}

TEST(Calibration, WarnsOfFoldingLens) {
  std::vector<BoardView> views = Views(Chessboard(), 40);
  EXPECT_FALSE(Calibrate(views, Chessboard(), {640, 480}).folds);
  // A lens that folds at rays 0.75 off the axis, within the image; the views only show rays inside.
  Camera folding = kCamera;
  folding.distortion = {-0.6, 0.0, 0.0, 0.0, 0.0};
  std::erase_if(views, [&](BoardView& view) {
    bool outside = false;
    for (cv::Point2f& corner : view.corners) {
      const Eigen::Vector3d ray = kCamera.Unproject(kCamera.Undistort({corner.x, corner.y}));
      const Eigen::Vector2d pixel = folding.ProjectDistorted(ray);
      outside = outside || std::hypot(ray.x(), ray.y()) > 0.6 * ray.z();
      corner = {static_cast<float>(pixel.x()), static_cast<float>(pixel.y())};
    }
    return outside;
  });
  ASSERT_GE(views.size(), 8U);
  const Calibration c = Calibrate(views, Chessboard(), {640, 480});
  EXPECT_TRUE(c.folds);
  EXPECT_THAT(Weaknesses(c), Contains(HasSubstr("folds back within the image")));
}

TEST(Calibration, RefusesRepeatedView) {
  const std::vector<BoardView> views =
      Views(Chessboard(), 5, [&](int) { return BoardPose(Chessboard(), kCamera, 1); });
  ASSERT_FALSE(views.empty());
  EXPECT_THROW(Calibrate(views, Chessboard(), {640, 480}), InputError);
}

TEST(CalibrationBoardTest, RefusesImpossibleSizes) {
  CalibrationBoard board = Charuco();
  board.marker_mm = 40.0;
  EXPECT_THROW(CheckBoard(board), UsageError);
  board = Charuco();
  board.dictionary = "4X4_5";
  EXPECT_THROW(CheckBoard(board), UsageError);
  board = Charuco();
  board.columns = 20;  // more white squares than the dictionary has markers
  EXPECT_THROW(CheckBoard(board), UsageError);
  board = Chessboard();
  board.rows = 1;
  EXPECT_THROW(CheckBoard(board), UsageError);
}

}  // namespace
}  // namespace sqslam
