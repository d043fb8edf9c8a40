#include "render/video.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>

#include "hand_made_map.h"
#include "slam/util/error.h"

namespace sqslam {
namespace {
namespace fs = std::filesystem;

// A recording of three snapshots, the map growing object by object, in a folder that goes with the test.
class VideoTest : public testing::Test {
 protected:
  void SetUp() override {
    unsetenv("DISPLAY");
    std::string name = (fs::temp_directory_path() / "sqslam-video-XXXXXX").string();
    ASSERT_NE(mkdtemp(name.data()), nullptr);
    folder_ = name;
    const std::string image = (folder_ / "image.png").string();
    cv::imwrite(image, cv::Mat(240, 320, CV_8UC3, cv::Scalar(200, 120, 60)));
    RecordingWriter writer(folder_ / "map.sqmap", {});
    for (int i = 0; i < 3; ++i) {
      MapSnapshot map = HandMadeMap();
      map.sequence_number = i;
      map.frame_index = 10 * i;
      map.timestamp = 0.5 * i;
      map.image_path = image;
      map.objects.resize(static_cast<std::size_t>(i + 1));
      map.keyframes.resize(static_cast<std::size_t>(2 * i + 3));
      map.detections.push_back({{"book", 0.9, {40.0, 60.0, 100.0, 80.0}}, 0});
      writer.Add(map);
    }
    writer.Close();
    options_.picture.width = 480;
    options_.picture.height = 200;
    options_.picture.backend = RenderBackend::kOsmesa;
  }
  void TearDown() override { fs::remove_all(folder_); }

  int FilesLeft() const {
    return static_cast<int>(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()));
  }

  fs::path folder_;
  VideoOptions options_;
};

TEST_F(VideoTest, GrowthLastsAsLongAsTheRun) {
  const fs::path output = folder_ / "growth.mp4";
  options_.fps = 8.0;  // the run of one second
  EXPECT_EQ(WriteGrowthVideo(RecordingReader(folder_ / "map.sqmap"), options_, output), 8);
  cv::VideoCapture video(output.string());
  ASSERT_TRUE(video.isOpened());
  cv::Mat frame;
  int frames = 0;
  cv::Vec3b image_center;
  while (video.read(frame)) {
    ++frames;
    EXPECT_EQ(frame.size(), cv::Size(480, 200));
    image_center = frame.at<cv::Vec3b>(30, 90);
  }
  EXPECT_EQ(frames, 8);
  EXPECT_LT(cv::norm(image_center, cv::Vec3b(200, 120, 60), cv::NORM_INF),
            40.0);  // the input image stands left
}

TEST_F(VideoTest, GrowthHasAFrameForEachSnapshotOfAShortRun) {
  options_.fps = 1.0;
  const fs::path output = folder_ / "g" / "{frame:03}.png";
  EXPECT_EQ(WriteGrowthVideo(RecordingReader(folder_ / "map.sqmap"), options_, output), 3);
}

TEST_F(VideoTest, NumberedPicturesTakeARangeOfTheFrames) {
  options_.first = 1;
  WriteGrowthVideo(RecordingReader(folder_ / "map.sqmap"), options_, folder_ / "f" / "{frame:03}.png");
  EXPECT_FALSE(fs::exists(folder_ / "f" / "000.png"));
  EXPECT_EQ(cv::imread((folder_ / "f" / "002.png").string()).size(), cv::Size(480, 200));
}

TEST_F(VideoTest, OrbitStoppedHalfwayLeavesNoFile) {
  const int before = FilesLeft();
  options_.seconds = 0.2;
  WriteOrbit(HandMadeMap(), options_, folder_ / "orbit.mp4", [](int done, int) { return done < 2; });
  EXPECT_EQ(FilesLeft(), before);
}

TEST_F(VideoTest, OutputThatCannotBeWrittenIsSaid) {
  EXPECT_THROW(WriteOrbit(HandMadeMap(), options_, folder_ / "missing" / "orbit.mp4"), InputError);
  EXPECT_THROW(WriteOrbit(HandMadeMap(), options_, folder_ / "orbit.gif"), UsageError);
  options_.picture.width = 481;
  EXPECT_THROW(WriteOrbit(HandMadeMap(), options_, folder_ / "orbit.mp4"), UsageError);
  options_.picture.width = 480;
  options_.picture.transparent = true;
  EXPECT_THROW(WriteOrbit(HandMadeMap(), options_, folder_ / "orbit.mp4"), UsageError);
}

TEST(FrameNameTest, FillsTheFieldIn) {
  EXPECT_EQ(FrameName("a/{frame:04}.png", 7), "a/0007.png");
  EXPECT_EQ(FrameName("a/{frame}.png", 12), "a/12.png");
  EXPECT_FALSE(IsFrameTemplate("a/frame.png"));
}

}  // namespace
}  // namespace sqslam
