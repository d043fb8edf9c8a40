#include "render/video/video.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>

#include "hand_made_map.h"
#include "render/video/palette.h"
#include "render/video/video_alignment.h"
#include "slam/io/video_index.h"
#include "slam/util/error.h"
#include "slam/util/text_lines.h"
#include "tests/support/film.h"

namespace sqslam {
namespace {
namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;

// A recording of three snapshots, the map growing object by object, in a folder that goes with the test.
class VideoTest : public ::testing::Test {
 protected:
  void SetUp() override {
    unsetenv("DISPLAY");
    std::string name = (fs::temp_directory_path() / "sqslam-video-XXXXXX").string();
    ASSERT_NE(mkdtemp(name.data()), nullptr);
    folder_ = name;
    const std::string image = (folder_ / "image.png").string();
    cv::imwrite(image, cv::Mat(240, 320, CV_8UC3, cv::Scalar(200, 120, 60)));
    for (int i = 0; i < 3; ++i) {
      MapSnapshot map = HandMadeMap();
      map.sequence_number = i;
      map.frame_index = 10 * i;
      map.timestamp = 0.5 * i;
      map.image_path = image;
      map.objects.resize(static_cast<std::size_t>(i + 1));
      map.keyframes.resize(static_cast<std::size_t>(2 * i + 3));
      map.detections.push_back({{"book", 0.9, {40.0, 60.0, 100.0, 80.0}}, 0});
      maps_.push_back(map);
    }
    Record("map.sqmap");
    options_.picture.width = 480;
    options_.picture.height = 200;
    options_.picture.backend = RenderBackend::kOsmesa;
  }
  void TearDown() override {
    fs::current_path(working_);
    fs::remove_all(folder_);
  }

  fs::path Record(const std::string& name) const {
    RecordingWriter writer(folder_ / name, {});
    for (const MapSnapshot& map : maps_) {
      writer.Add(map);
    }
    writer.Close();
    return folder_ / name;
  }

  // Frame 0 of the growth of what was recorded, which stands in three frames.
  cv::Mat FirstFrame(const fs::path& recording) {
    options_.fps = 1.0;
    const std::string name = recording.string() + "-{frame}.png";
    EXPECT_EQ(WriteGrowthVideo(RecordingReader(recording), options_, name), 3);
    return cv::imread(FrameName(name, 0));
  }

  int FilesLeft() const {
    return static_cast<int>(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()));
  }

  const fs::path working_ = fs::current_path();
  fs::path folder_;
  std::vector<MapSnapshot> maps_;
  VideoOptions options_;
};

TEST_F(VideoTest, GrowthLastsAsLongAsRun) {
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

TEST_F(VideoTest, GrowthShowsFramesOfFilm) {
  const fs::path film = folder_ / "film.mp4";
  std::vector<double> seconds(30);
  std::generate(seconds.begin(), seconds.end(), [i = 0]() mutable { return 0.1 * i++; });
  sqslam::testing::WriteFilm(film, seconds,
                             [](int i) { return cv::Mat(240, 320, CV_8UC3, cv::Scalar::all(10 * i)); });
  RecordingWriter writer(folder_ / "film.sqmap", {film.string(), "test", ""});
  MapSnapshot map = HandMadeMap();
  map.objects.clear();
  map.frame_index = 20;
  writer.Add(map);
  writer.Close();
  WriteGrowthVideo(RecordingReader(folder_ / "film.sqmap"), options_, folder_ / "growth-{frame}.png");
  const cv::Mat frame = cv::imread((folder_ / "growth-0.png").string());
  ASSERT_FALSE(frame.empty());
  EXPECT_NEAR(frame.at<cv::Vec3b>(90, 60)[1], 200, 8);
}

TEST_F(VideoTest, GrowthShowsEachSnapshotOfShortRun) {
  options_.fps = 1.0;
  const fs::path output = folder_ / "g" / "{frame:03}.png";
  EXPECT_EQ(WriteGrowthVideo(RecordingReader(folder_ / "map.sqmap"), options_, output), 3);
}

TEST_F(VideoTest, WritesRangeOfNumberedPictures) {
  options_.first = 1;
  WriteGrowthVideo(RecordingReader(folder_ / "map.sqmap"), options_, folder_ / "f" / "{frame:03}.png");
  EXPECT_FALSE(fs::exists(folder_ / "f" / "000.png"));
  EXPECT_EQ(cv::imread((folder_ / "f" / "002.png").string()).size(), cv::Size(480, 200));
}

int FramesIn(const fs::path& path) {
  cv::VideoCapture video(path.string());
  cv::Mat frame;
  int frames = 0;
  while (video.read(frame)) {
    ++frames;
  }
  return frames;
}

TEST_F(VideoTest, FinishesVideoWhenStopped) {
  const int before = FilesLeft();
  options_.seconds = 0.2;
  const auto stop_at_two = [](int done, int) { return done < 2; };
  EXPECT_EQ(WriteOrbit(HandMadeMap(), options_, folder_ / "orbit.mp4", stop_at_two), 2);
  EXPECT_EQ(FramesIn(folder_ / "orbit.mp4"), 2);
  const RecordingReader recording(folder_ / "map.sqmap");
  EXPECT_EQ(WriteGrowthVideo(recording, options_, folder_ / "growth.mp4", stop_at_two), 2);
  EXPECT_EQ(FramesIn(folder_ / "growth.mp4"), 2);
  EXPECT_EQ(FilesLeft(), before + 2);  // nothing temporary
}

TEST_F(VideoTest, AcceptsColonInRelativeName) {
  fs::current_path(folder_);
  options_.seconds = 0.2;
  const std::string piece = "2024-05-01T12:30.part-1-of-1.mp4";
  EXPECT_EQ(WriteOrbit(HandMadeMap(), options_, piece), 6);
  EXPECT_EQ(JoinVideo({piece}, "2024-05-01T12:30.mp4", 30.0), 6);
  EXPECT_EQ(IndexVideo("2024-05-01T12:30.mp4").timestamps.size(), 6U);
}

TEST_F(VideoTest, GrowthShowsOutlinesOnImageAndKeyframesOnTimeline) {
  WriteGrowthVideo(RecordingReader(folder_ / "map.sqmap"), options_, folder_ / "{frame}.png");
  const cv::Mat page = cv::imread((folder_ / "2.png").string());
  // Left lies the image of one colour: what differs from it was drawn.
  cv::Mat same;
  cv::inRange(page(cv::Rect(20, 30, 140, 100)), cv::Scalar(195, 115, 55), cv::Scalar(205, 125, 65), same);
  EXPECT_GT(same.total() - static_cast<std::size_t>(cv::countNonZero(same)), 1500u);  // boxes alone: less
  // Above the time line: marks of keyframes at 0, 1/3, 2/3 and, with those after the recording's end, 1 s.
  cv::Mat ink;
  cv::inRange(page(cv::Rect(0, 188, 480, 1)), cv::Scalar::all(0), cv::Scalar(250, 250, 250), ink);
  std::vector<int> marks;
  for (int x = 1; x < ink.cols; ++x) {
    if (ink.at<std::uint8_t>(0, x) > 0 && ink.at<std::uint8_t>(0, x - 1) == 0) {
      marks.push_back(x);
    }
  }
  ASSERT_EQ(marks.size(), 4u);
  EXPECT_NEAR(marks[1] - marks[0], (marks[3] - marks[0]) / 3.0, 1.5);
}

TEST_F(VideoTest, FollowingViewUsesFirstPoseBeforeTracking) {
  options_.path = CameraPath::kFirstPerson;
  options_.show_image = false;
  options_.picture.style.cameras.current = false;
  maps_[1].T_map_camera = maps_[0].T_map_camera = maps_[0].keyframes[1].T_map_camera;
  const cv::Mat tracked = FirstFrame(Record("tracked.sqmap"));
  maps_[0].T_map_camera.reset();
  const cv::Mat lost = FirstFrame(Record("lost.sqmap"));
  ASSERT_EQ(lost.size(), cv::Size(480, 200));
  EXPECT_LT(cv::norm(tracked, lost, cv::NORM_L1) / static_cast<double>(lost.total()), 0.5);
}

TEST_F(VideoTest, NamesBoxAfterItsObjectNotItsDetection) {
  const cv::Mat book = FirstFrame(Record("book.sqmap"));
  maps_[0].detections[0].detection.label = "a notebook";
  const cv::Mat still = FirstFrame(Record("still.sqmap"));
  EXPECT_EQ(cv::norm(book, still, cv::NORM_INF), 0.0);
  maps_[0].objects[0].label = "cat";
  EXPECT_GT(cv::norm(book, FirstFrame(Record("cat.sqmap")), cv::NORM_INF), 0.0);
}

TEST_F(VideoTest, GrowthReadsEachStateOnce) {
  int read = 0;
  const RecordingReader reader(folder_ / "map.sqmap", [&](MapSnapshotPtr map) {
    read += map->frame_index == 0 ? 1 : 0;
    return map;
  });
  options_.fps = 1.0;
  WriteGrowthVideo(reader, options_, folder_ / "growth-{frame}.png");
  EXPECT_EQ(read, 1);
}

class ShardTest : public VideoTest {
 protected:
  void SetUp() override {
    VideoTest::SetUp();
    options_.seconds = 5.5;
    options_.fps = 2.0;  // eleven frames: segments of 4, 4 and 3
    parts_ = PartsOf(3);
  }

  std::vector<std::string> PartsOf(int count) {
    std::vector<std::string> parts;
    for (int i = 1; i <= count; ++i) {
      options_.shard = {i, count};
      parts.push_back(PartName(folder_ / "orbit.mp4", options_.shard).string());
      WriteOrbit(HandMadeMap(), options_, parts.back());
    }
    return parts;
  }

  std::string BytesOf(const std::string& name) const { return ReadFile(folder_ / name, "a video"); }

  std::string ErrorOf(const std::vector<std::string>& pieces) {
    try {
      JoinVideo(pieces, folder_ / "joined.mp4", 30.0);
    } catch (const InputError& error) {
      return error.what();
    }
    return "(no InputError)";
  }

  std::vector<std::string> parts_;
};

TEST_F(ShardTest, JoinsPiecesInAnyOrderToSameBytes) {
  EXPECT_EQ(fs::path(parts_[1]).filename(), "orbit.part-2-of-3.mp4");
  const std::vector<std::string> halves = PartsOf(2);
  options_.shard = {};
  WriteOrbit(HandMadeMap(), options_, folder_ / "whole.mp4");
  EXPECT_EQ(FramesIn(folder_ / "whole.mp4"), 11);
  EXPECT_EQ(JoinVideo({parts_[2], parts_[0], parts_[1]}, folder_ / "joined.mp4", 30.0), 11);
  EXPECT_TRUE(BytesOf("joined.mp4") == BytesOf("whole.mp4"));
  EXPECT_EQ(JoinVideo(halves, folder_ / "joined.mp4", 30.0), 11);
  EXPECT_TRUE(BytesOf("joined.mp4") == BytesOf("whole.mp4"));
}

TEST_F(ShardTest, DoesNotDependOnNumberOfCores) {
  options_.shard = {};
  WriteOrbit(HandMadeMap(), options_, folder_ / "whole.mp4");
  // x264 writes its settings into the stream; by default it takes 1.5 threads per core.
  EXPECT_NE(BytesOf("whole.mp4").find(" threads=4 "), std::string::npos);
}

TEST_F(ShardTest, RejectsMorePiecesThanSegments) {
  options_.shard = {1, 4};
  EXPECT_THROW(WriteOrbit(HandMadeMap(), options_, folder_ / "orbit.mp4"), UsageError);
}

TEST_F(ShardTest, ReportsInvalidPieces) {
  EXPECT_THAT(ErrorOf({parts_[0], parts_[2]}), HasSubstr("missing piece 2 of 3"));
  EXPECT_THAT(ErrorOf({parts_[0], parts_[0], parts_[1]}), HasSubstr("given twice"));
  EXPECT_THAT(ErrorOf({parts_[0], (folder_ / "other.part-2-of-3.mp4").string()}), HasSubstr("another video"));
  EXPECT_THAT(ErrorOf({(folder_ / "orbit.mp4").string()}), HasSubstr("part-I-of-N"));
  options_.shard = {2, 3};
  WriteOrbit(HandMadeMap(), options_, parts_[1], [](int done, int) { return done < 2; });
  EXPECT_THAT(ErrorOf(parts_),
              AllOf(HasSubstr("part-2-of-3"), HasSubstr("2 frames"), HasSubstr("interrupted")));
  options_.picture.width = 400;
  WriteOrbit(HandMadeMap(), options_, parts_[1]);
  EXPECT_THAT(ErrorOf(parts_), AllOf(HasSubstr("part-2-of-3"), HasSubstr("400x200"), HasSubstr("480x200")));
  EXPECT_FALSE(fs::exists(folder_ / "joined.mp4"));
}

TEST_F(VideoTest, JoinsNumberedPicturesUnlessOneIsMissing) {
  options_.seconds = 0.4;
  const std::string name = (folder_ / "f" / "{frame:03}.png").string();
  for (int i = 1; i <= 2; ++i) {  // two shards share the numbers
    options_.shard = {i, 2};
    EXPECT_EQ(WriteOrbit(HandMadeMap(), options_, name), 6);
  }
  EXPECT_EQ(JoinVideo({name}, folder_ / "joined.mp4", 12.0), 12);
  EXPECT_EQ(FramesIn(folder_ / "joined.mp4"), 12);
  fs::remove(folder_ / "f" / "004.png");
  EXPECT_THROW(JoinVideo({name}, folder_ / "again.mp4", 12.0), InputError);
  EXPECT_FALSE(fs::exists(folder_ / "again.mp4"));
}

TEST_F(VideoTest, WritesPicturesThatPlayByThemselves) {
  options_.fps = 10.0;
  options_.seconds = 1.0;
  for (const char* name : {"turn.gif", "turn.webp"}) {
    EXPECT_EQ(WriteOrbit(HandMadeMap(), options_, folder_ / name), 10);
  }
  cv::VideoCapture gif((folder_ / "turn.gif").string());
  cv::Mat frame;
  int frames = 0;
  for (; gif.read(frame); ++frames) {
    EXPECT_EQ(frame.size(), cv::Size(480, 200));
  }
  EXPECT_EQ(frames, 10);
  const std::string webp = ReadFile(folder_ / "turn.webp", "a picture");
  EXPECT_EQ(webp.substr(0, 4), "RIFF");
  EXPECT_NE(webp.find("ANIM"), std::string::npos);
}

TEST_F(VideoTest, CoversVideoWithItsLastFrame) {
  options_.seconds = 0.2;
  WriteOrbit(HandMadeMap(), options_, folder_ / "orbit.mp4");
  EXPECT_EQ(FramesIn(folder_ / "orbit.mp4"), 6);
  EXPECT_NE(ReadFile(folder_ / "orbit.mp4", "a video").find("covr"), std::string::npos);
}

TEST(MotionTest, LeadsFromOneStateToTheNext) {
  MapSnapshot from = HandMadeMap(), to = from;
  to.objects[0].superquadric.T_map_object.translation.x() += 1.0;
  to.objects[0].superquadric.shape.half_size.z() *= 3.0;
  from.objects.resize(2);
  to.T_map_camera->translation.y() += 2.0;
  const MapSnapshot half = Between(from, to, 0.5);
  ASSERT_EQ(half.objects.size(), 3u);
  const PosedSuperquadric& moved = half.objects[0].superquadric;
  EXPECT_NEAR(moved.T_map_object.translation.x(),
              from.objects[0].superquadric.T_map_object.translation.x() + 0.5, 1e-9);
  EXPECT_NEAR(moved.shape.half_size.z(), 2.0 * from.objects[0].superquadric.shape.half_size.z(), 1e-9);
  EXPECT_LT(half.objects[2].superquadric.shape.half_size.x(), to.objects[2].superquadric.shape.half_size.x());
  EXPECT_NEAR(half.T_map_camera->translation.y(), from.T_map_camera->translation.y() + 1.0, 1e-9);
  EXPECT_EQ(Between(from, to, 1.0).objects[2].superquadric.shape.half_size,
            to.objects[2].superquadric.shape.half_size);
}

TEST(PaletteTest, KeepsFewColoursAndReducesMany) {
  cv::Mat flat(20, 30, CV_8UC3, cv::Scalar(250, 120, 7));
  flat(cv::Rect(3, 3, 9, 9)).setTo(cv::Scalar(1, 2, 3));
  const auto drawn = [](const PaletteImage& image, int y, int x) {
    const std::uint32_t argb = image.argb[image.index(y, x)];
    return cv::Vec3b(argb & 255U, (argb >> 8U) & 255U, (argb >> 16U) & 255U);
  };
  const PaletteImage two = ReduceColors(flat);
  EXPECT_EQ(drawn(two, 0, 0), cv::Vec3b(250, 120, 7));
  EXPECT_EQ(drawn(two, 5, 5), cv::Vec3b(1, 2, 3));
  cv::Mat many(256, 256, CV_8UC3);
  for (int y = 0; y < 256; ++y) {
    for (int x = 0; x < 256; ++x) {
      many.at<cv::Vec3b>(y, x) = {static_cast<std::uint8_t>(x), static_cast<std::uint8_t>(y),
                                  static_cast<std::uint8_t>((x + y) / 2)};
    }
  }
  const PaletteImage reduced = ReduceColors(many);
  double error = 0.0;
  for (int y = 0; y < 256; ++y) {
    for (int x = 0; x < 256; ++x) {
      error +=
          cv::norm(cv::Vec3d(drawn(reduced, y, x)) - cv::Vec3d(many.at<cv::Vec3b>(y, x))) / (256.0 * 256.0);
    }
  }
  EXPECT_LT(error, 12.0);
}

TEST_F(VideoTest, ReportsUnwritableOutput) {
  EXPECT_THROW(WriteOrbit(HandMadeMap(), options_, folder_ / "missing" / "orbit.mp4"), InputError);
  EXPECT_THROW(WriteOrbit(HandMadeMap(), options_, folder_ / "orbit.avi"), UsageError);
  options_.picture.width = 481;
  EXPECT_THROW(WriteOrbit(HandMadeMap(), options_, folder_ / "orbit.mp4"), UsageError);
  options_.picture.width = 480;
  options_.picture.transparent = true;
  EXPECT_THROW(WriteOrbit(HandMadeMap(), options_, folder_ / "orbit.mp4"), UsageError);
}

TEST(FrameNameTest, FillsField) {
  EXPECT_EQ(FrameName("a/{frame:04}.png", 7), "a/0007.png");
  EXPECT_EQ(FrameName("a/{frame}.png", 12), "a/12.png");
  EXPECT_FALSE(IsFrameTemplate("a/frame.png"));
}

}  // namespace
}  // namespace sqslam
