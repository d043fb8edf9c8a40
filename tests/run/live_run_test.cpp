#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>

#include "slam/run/run_pipeline.h"
#include "slam/util/error.h"
#include "tests/io/captured_log.h"
#include "tests/io/temporary_folder.h"

namespace sqslam {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

constexpr int kImages = 20;

// A camera that shows a grey wall a few times and is then unplugged.
FrameGrabber GreyWall() {
  return [given = 0](cv::Mat& bgr) mutable {
    bgr = cv::Mat(480, 640, CV_8UC3, cv::Scalar::all(128));
    return given++ < kImages;
  };
}

RunRequest LiveRequest(const TemporaryFolder& folder) {
  RunRequest request;
  request.options.detection.network = "none";
  request.live_camera = 0;
  request.sequence.camera = "kinect-v1";
  request.open_camera = [](int, const Camera&) { return GreyWall(); };
  request.output = folder.Path() / "result";
  return request;
}

TEST(LiveRun, PassesOnOrCountsEveryImage) {
  const TemporaryFolder folder;
  const CapturedLog log;
  const RunRequest request = LiveRequest(folder);
  RunHost host;
  try {
    RunPipeline(request, host);
    FAIL() << "a wall makes no map";
  } catch (const NoMapError& error) {
    EXPECT_THAT(error.what(), HasSubstr("no map: "));
    EXPECT_THAT(error.what(), Not(HasSubstr("doctor"))) << "nothing is left of live images to look at";
  }
  const RunStats stats = ReadStats(request.output / "stats.json");
  EXPECT_GE(stats.frames, 1);
  EXPECT_EQ(stats.frames + stats.dropped, kImages);
  EXPECT_FALSE(std::filesystem::exists(request.output / "map.sqmap"));
  EXPECT_THAT(log.Text(), HasSubstr("camera 0: delivers no more images after 20"));
}

TEST(LiveRun, RejectsOptionsThatNeedARecording) {
  const TemporaryFolder folder;
  const auto refused = [&](const auto& change) {
    RunRequest request = LiveRequest(folder);
    change(request);
    RunHost host;
    EXPECT_THROW(RunPipeline(request, host), UsageError);
    EXPECT_FALSE(std::filesystem::exists(request.output));
  };
  refused([](RunRequest& request) { request.sequence.detections = "boxes.txt"; });
  refused([](RunRequest& request) { request.options.deterministic = true; });
}

}  // namespace
}  // namespace sqslam
