#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "slam/io/cameras.h"
#include "slam/io/result_files.h"
#include "tests/app/run_program.h"
#include "tests/app/written_sequence.h"
#include "tests/support/textured_world.h"

// Cameras that show nothing of depth: no map may come of them, and the user must read why.
namespace sqslam::testing {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Matcher;
using ::testing::Not;

constexpr int kFrames = 40;
constexpr double kNoise = 3.0;  // grey levels, standard deviation of a sensor in a dim room

// The same images as a sensor sees them: each with noise of its own.
std::vector<cv::Mat> WithNoise(const std::vector<cv::Mat>& images, double sigma, std::uint64_t seed) {
  cv::RNG random(seed);
  std::vector<cv::Mat> noisy;
  for (const cv::Mat& image : images) {
    cv::Mat noise(image.size(), CV_16SC3);
    random.fill(noise, cv::RNG::NORMAL, 0.0, sigma);
    cv::Mat sum;
    cv::add(image, noise, sum, cv::noArray(), CV_8UC3);
    noisy.push_back(sum);
  }
  return noisy;
}

// A painted wall: bright, and darker towards one corner as a lamp lights it.
cv::Mat WhiteWall(const Camera& camera) {
  cv::Mat wall(camera.height, camera.width, CV_8UC3);
  for (int v = 0; v < wall.rows; ++v) {
    for (int u = 0; u < wall.cols; ++u) {
      const double level = 238.0 - 30.0 * u / wall.cols - 20.0 * v / wall.rows;
      wall.at<cv::Vec3b>(v, u) = cv::Vec3b::all(cv::saturate_cast<std::uint8_t>(level));
    }
  }
  return wall;
}

std::vector<Eigen::Matrix3d> LookingAround(int count) {
  std::vector<Eigen::Matrix3d> rotations;
  for (int i = 0; i < count; ++i) {
    const double t = static_cast<double>(i);
    rotations.emplace_back(Eigen::AngleAxisd(0.1 * std::sin(0.06 * t), Eigen::Vector3d::UnitY()) *
                           Eigen::AngleAxisd(0.05 * std::sin(0.09 * t), Eigen::Vector3d::UnitX()) *
                           Eigen::AngleAxisd(0.05 * std::sin(0.04 * t), Eigen::Vector3d::UnitZ()));
  }
  return rotations;
}

class NoMap : public ::testing::Test {
 protected:
  void ExpectNoMap(const WrittenSequence& sequence, const Matcher<const std::string&>& reason) {
    const fs::path output = folder_.Path() / "result";
    const ProgramRun run =
        RunProgram("run " + sequence.Path().string() +
                   " --no-render --deterministic --detector none --output " + output.string());
    EXPECT_EQ(run.exit_code, 4) << run.out << run.err;
    EXPECT_THAT(run.ErrorLines(), ElementsAre(AllOf(HasSubstr("no map: "), reason)));
    EXPECT_THAT(run.err, Not(HasSubstr("no objects"))) << "without boxes, as was asked for";
    ASSERT_TRUE(fs::exists(output / "stats.json"));
    std::vector<std::string> files;
    for (const auto& entry : fs::directory_iterator(output)) {
      files.push_back(entry.path().filename().string());
    }
    EXPECT_THAT(files, ElementsAre("stats.json"));
    const RunStats stats = ReadStats(output / "stats.json");
    EXPECT_EQ(stats.frames, kFrames);
    EXPECT_EQ(stats.tracked, 0);
    EXPECT_EQ(stats.keyframes, 0);
    const ProgramRun doctor = RunProgram("doctor " + sequence.Path().string() + " --detector none");
    EXPECT_EQ(doctor.exit_code, 3) << doctor.out << doctor.err;
    EXPECT_THAT(doctor.out, HasSubstr("not suitable for mapping"));
  }

  const Camera camera_ = TexturedWorld().GetCamera();
  const cv::Mat view_ = TexturedWorld().Render(0, {}).bgr;
  TemporaryFolder folder_;
};

// The message for a camera that stands still: it does not move, or nothing but noise moves.
const auto kHardlyMoves = HasSubstr("the camera hardly moves");
const auto kOnlyTurns = HasSubstr("the camera only turns");
const auto kNoTexture = HasSubstr("too little texture");

TEST_F(NoMap, StaticCameraGivesNoMap) {
  ExpectNoMap({camera_, std::vector<cv::Mat>(kFrames, view_)}, kHardlyMoves);
}

TEST_F(NoMap, StaticCameraWithNoisySensorGivesNoMap) {
  ExpectNoMap({camera_, WithNoise(std::vector<cv::Mat>(kFrames, view_), kNoise, 1)}, kHardlyMoves);
}

TEST_F(NoMap, TurningCameraGivesNoMap) {
  std::vector<Rigid3d> path;
  for (const Eigen::Matrix3d& R_map_camera : LookingAround(kFrames)) {
    path.push_back({Eigen::Quaterniond(R_map_camera), Eigen::Vector3d::Zero()});
  }
  ExpectNoMap(WrittenSequence(path), kOnlyTurns);
}

TEST_F(NoMap, BlankWallGivesNoMap) {
  ExpectNoMap({camera_, std::vector<cv::Mat>(kFrames, WhiteWall(camera_))}, kNoTexture);
}

TEST_F(NoMap, BlankWallWithSensorNoiseGivesNoMap) {
  ExpectNoMap({camera_, WithNoise(std::vector<cv::Mat>(kFrames, WhiteWall(camera_)), kNoise, 2)}, kNoTexture);
}

// The same with a photograph of a room instead of a rendered world.
class NoMapOfARoom : public NoMap {
 protected:
  static constexpr int kMargin = 90;  // px that turning may take from each border

  void SetUp() override {
    const fs::path folder = fs::path(SQSLAM_SOURCE_DIR) / "../shared/data/redkitchen";
    if (!fs::exists(folder)) {
      GTEST_SKIP() << folder << " is not there";
    }
    room_camera_ = ReadCamera(folder / "camera.yaml");
    cv::eigen2cv(Eigen::Matrix3d{{room_camera_.fx, 0.0, room_camera_.cx},
                                 {0.0, room_camera_.fy, room_camera_.cy},
                                 {0.0, 0.0, 1.0}},
                 K_);
    const cv::Mat distorted = cv::imread((folder / "rgb/000000.jpg").string());
    cv::undistort(distorted, room_, K_, room_camera_.distortion);
    room_camera_.distortion = {};
  }

  // Turned about the optical centre, without the borders.
  cv::Mat Turned(const Eigen::Matrix3d& R_room_camera) const {
    cv::Mat R_camera_room;
    cv::eigen2cv(Eigen::Matrix3d(R_room_camera.transpose()), R_camera_room);
    cv::Mat turned;
    cv::warpPerspective(room_, turned, K_ * R_camera_room * K_.inv(), room_.size(), cv::INTER_CUBIC,
                        cv::BORDER_CONSTANT, cv::Scalar(0, 0, 255));
    return turned(cv::Rect(kMargin, kMargin, room_.cols - 2 * kMargin, room_.rows - 2 * kMargin)).clone();
  }
  Camera RotatedCamera() const {
    Camera camera = room_camera_;
    camera.width -= 2 * kMargin;
    camera.height -= 2 * kMargin;
    camera.cx -= kMargin;
    camera.cy -= kMargin;
    return camera;
  }
  std::vector<cv::Mat> TurnedRoom() const {
    std::vector<cv::Mat> images;
    for (const Eigen::Matrix3d& R_room_camera : LookingAround(kFrames)) {
      images.push_back(Turned(R_room_camera));
    }
    return images;
  }

  Camera room_camera_;
  cv::Mat K_;
  cv::Mat room_;
};

TEST_F(NoMapOfARoom, StaticCameraGivesNoMap) {
  ExpectNoMap({room_camera_, std::vector<cv::Mat>(kFrames, room_)}, kHardlyMoves);
}

TEST_F(NoMapOfARoom, StaticCameraWithNoisySensorGivesNoMap) {
  ExpectNoMap({room_camera_, WithNoise(std::vector<cv::Mat>(kFrames, room_), kNoise, 3)}, kHardlyMoves);
}

TEST_F(NoMapOfARoom, TurningCameraGivesNoMap) { ExpectNoMap({RotatedCamera(), TurnedRoom()}, kOnlyTurns); }

TEST_F(NoMapOfARoom, TurningCameraWithNoisySensorGivesNoMap) {
  ExpectNoMap({RotatedCamera(), WithNoise(TurnedRoom(), kNoise, 4)}, kOnlyTurns);
}

}  // namespace
}  // namespace sqslam::testing
