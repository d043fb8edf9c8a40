#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <opencv2/imgcodecs.hpp>

#include "slam/calibration/board.h"
#include "slam/io/cameras.h"
#include "tests/app/run_program.h"
#include "tests/support/board_scene.h"
#include "tests/support/film.h"

namespace sqslam::testing {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

const Camera kCamera{480, 360, 400.0, 400.0, 236.0, 183.0, {-0.1, 0.02, 0.0, 0.0, 0.0}};

// A film of a board with ten poses, each shown twice, at 20 frames a second.
fs::path BoardFilm(const fs::path& folder) {
  const CalibrationBoard board;
  const BoardScene scene(board, kCamera);
  std::vector<cv::Mat> images;
  std::vector<double> seconds;
  for (int i = 0; i < 20; ++i) {
    images.push_back(i % 2 == 1 ? images.back() : scene.Render(BoardPose(board, kCamera, i / 2)));
    seconds.push_back(i / 20.0);
  }
  WriteFilm(folder / "board.mp4", seconds, [&](int i) { return images[static_cast<std::size_t>(i)]; });
  return folder / "board.mp4";
}

TEST(Calibrate, WritesCalibrationAndPictureFromFilmOfBoard) {
  const TemporaryFolder folder;
  const fs::path camera = folder.Path() / "phone.yaml";
  const ProgramRun run =
      RunProgram("calibrate " + BoardFilm(folder.Path()).string() + " --output " + camera.string());
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, AllOf(HasSubstr("fx "), HasSubstr("field of view "), HasSubstr("RMS error ")));
  const Camera read = ReadCamera(camera);
  EXPECT_NEAR(read.fx, kCamera.fx, 0.01 * kCamera.fx);
  EXPECT_EQ(read.width, 480);
  EXPECT_NEAR(read.fps, 20.0, 0.1);
  EXPECT_GT(cv::imread((folder.Path() / "phone-residuals.png").string()).cols, 1000);
}

TEST(Calibrate, CountsSearchedFramesWhenNoBoardIsFound) {
  const TemporaryFolder folder;
  for (int i = 0; i < 4; ++i) {
    cv::imwrite((folder.Path() / (std::to_string(i) + ".png")).string(),
                cv::Mat(120, 160, CV_8UC3, cv::Scalar::all(90)));
  }
  const fs::path camera = folder.Path() / "camera.yaml";
  const ProgramRun run = RunProgram("calibrate " + folder.Path().string() + " --output " + camera.string());
  EXPECT_EQ(run.exit_code, 3);
  EXPECT_THAT(run.ErrorLines(), ElementsAre(HasSubstr("was found in 0 of 4 frames, expected at least 3")));
  EXPECT_FALSE(fs::exists(camera));
}

TEST(Calibrate, HintsWhenInnerCornersWereCounted) {
  const TemporaryFolder folder;
  const ProgramRun run = RunProgram("calibrate " + BoardFilm(folder.Path()).string() +
                                    " --columns 9 --rows 6 --output " + (folder.Path() / "c.yaml").string());
  EXPECT_EQ(run.exit_code, 3);
  EXPECT_THAT(run.err, HasSubstr("did you count inner corners? --columns 10 --rows 7 counts squares"));
}

TEST(Calibrate, FindsItsPrintedBoard) {
  const TemporaryFolder folder;
  const fs::path sheet = folder.Path() / "board.png";
  for (const BoardKind kind : {BoardKind::kChessboard, BoardKind::kCharuco}) {
    const std::string name = kind == BoardKind::kCharuco ? "charuco" : "chessboard";
    ASSERT_EQ(RunProgram("calibrate --board " + name + " --print-board " + sheet.string()).exit_code, 0);
    CalibrationBoard board;
    board.kind = kind;
    const cv::Mat page = cv::imread(sheet.string(), cv::IMREAD_GRAYSCALE);
    EXPECT_EQ(page.size(), cv::Size(7016, 4961));  // A4 at 600 dots an inch
    const std::optional<BoardView> view = FindBoard(page, board);
    ASSERT_TRUE(view) << name;
    ASSERT_EQ(view->corners.size(), 54U) << name;
    // True scale: 25 mm are 590.55 dots.
    const auto at = [&](int id) {
      return view->corners[static_cast<std::size_t>(std::find(view->ids.begin(), view->ids.end(), id) -
                                                    view->ids.begin())];
    };
    EXPECT_NEAR(cv::norm(at(8) - at(0)), 8 * 25.0 / 25.4 * 600.0, 1.0);
  }
}

}  // namespace
}  // namespace sqslam::testing
