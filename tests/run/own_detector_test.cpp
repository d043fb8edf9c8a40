#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>
#include <stdexcept>

#include "slam/dense/dense_input.h"
#include "slam/io/image_header.h"
#include "slam/run/run_pipeline.h"
#include "slam/snapshot/recording.h"
#include "slam/util/error.h"
#include "slam/util/text_lines.h"
#include "tests/app/written_sequence.h"
#include "tests/support/textured_world.h"

namespace sqslam {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

// Says the same box of every image, until it breaks.
class ConstantDetector : public ObjectDetector {
 public:
  explicit ConstantDetector(int breaks_after = 1000) : left_(breaks_after) {}
  std::vector<Detection> Detect(const cv::Mat& bgr) override {
    if (left_-- == 0) {
      throw std::logic_error("the lamp is broken");
    }
    return {{"panel", 0.9, {0.25 * bgr.cols, 0.25 * bgr.rows, 0.4 * bgr.cols, 0.4 * bgr.rows}}};
  }
  std::string Name() const override { return "constant"; }

 private:
  int left_;
};

class OwnDetectorTest : public ::testing::Test {
 protected:
  RunRequest Request() const {
    RunRequest request;
    request.sequence.path = sequence_.Path();
    request.output = folder_.Path() / "result";
    request.options.deterministic = true;
    request.options.vocabulary = "none";
    request.options.detection.interval = 5;
    return request;
  }

  const testing::WrittenSequence sequence_{testing::HandHeldPath(40)};
  const TemporaryFolder folder_;
};

TEST_F(OwnDetectorTest, ReplacesBoxesOfTheSequence) {
  sequence_.Write("boxes.txt", "0 cup 0.9 1 1 50 50\n");
  RunRequest request = Request();
  request.detector = std::make_shared<ConstantDetector>();
  RunHost host;
  const FinishedRun run = RunPipeline(request, host);
  EXPECT_EQ(run.stats.detector, "constant");
  EXPECT_EQ(run.stats.detector_frames, 9);  // every fifth of 40 and the last
  const std::string boxes = ReadFile(run.output / "boxes.txt", "boxes");
  EXPECT_THAT(boxes, StartsWith("# boxes of " + sequence_.Path().string() + ", constant"));
  EXPECT_THAT(boxes, HasSubstr(" panel "));
  EXPECT_THAT(boxes, Not(HasSubstr(" cup ")));
}

// densify masks moving things by the boxes of the result, whatever way they came.
TEST_F(OwnDetectorTest, StoresGivenBoxes) {
  RunRequest request = Request();
  sequence_.Write("boxes.csv", "frame,label,score,x,y,w,h\n0,cup,0.5,80,60,128,96\n5,cup,0.5,80,60,128,96\n");
  request.sequence.detections = sequence_.Path() / "boxes.csv";
  request.sequence.resize = "0.5";
  RunHost host;
  const FinishedRun run = RunPipeline(request, host);
  const std::string boxes = ReadFile(run.output / "boxes.txt", "boxes");
  EXPECT_THAT(boxes, StartsWith("# boxes of " + sequence_.Path().string() + ", as given"));
  EXPECT_THAT(boxes, HasSubstr("\n0.000000 cup 0.500 80.0 60.0 128.0 96.0\n0.166667 cup "));
  const Sequence mapped = OpenSequence(
      {.path = sequence_.Path(), .known_camera = RecordingReader(run.output / "map.sqmap").Last()->camera});
  DepthMap map;
  map.frame_index = 5;
  map.depth = cv::Mat(120, 160, CV_32FC1, cv::Scalar(1.0));
  MovingMask(run.output, mapped, {"cup"}).Apply(map);
  EXPECT_EQ(map.depth.at<float>(54, 72), 0.0F);
  EXPECT_EQ(map.depth.at<float>(54, 20), 1.0F);
}

// The detector sees the photograph as people do, and its boxes are written in pixels of the file.
TEST_F(OwnDetectorTest, SeesTurnedPhotographUpright) {
  const std::string photograph = sequence_.Image(5).string();
  cv::imwrite(photograph, Turned(cv::imread(photograph), 1));
  RunRequest request = Request();
  request.sequence.resize = "0.5";
  request.detector = std::make_shared<ConstantDetector>();
  RunHost host;
  const FinishedRun run = RunPipeline(request, host);
  EXPECT_EQ(run.stats.skipped, 0);
  const std::string boxes = ReadFile(run.output / "boxes.txt", "boxes");
  EXPECT_THAT(boxes, HasSubstr("\n0.000000 panel 0.900 80.0 60.0 128.0 96.0\n"));
  EXPECT_THAT(boxes, HasSubstr("\n0.166667 panel 0.900 60.0 80.0 96.0 128.0\n"));
}

TEST_F(OwnDetectorTest, SavesMapBeforeRethrowingDetectorError) {
  RunRequest request = Request();
  request.detector = std::make_shared<ConstantDetector>(5);
  RunHost host;
  try {
    RunPipeline(request, host);
    FAIL() << "nothing thrown";
  } catch (const InputError& error) {
    EXPECT_STREQ(error.what(), "the detector failed: the lamp is broken");
  }
  EXPECT_GT(RecordingReader(request.output / "map.sqmap").Size(), 0);
  EXPECT_TRUE(std::filesystem::exists(request.output / "trajectory.txt"));
}

}  // namespace
}  // namespace sqslam
