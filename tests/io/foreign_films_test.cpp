// Video files as ffmpeg writes them: the frames, times and colours are those of the pictures that went in.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <opencv2/imgproc.hpp>

#include "slam/io/cameras.h"
#include "slam/io/frame_source.h"
#include "slam/io/image_header.h"
#include "slam/io/sequence.h"
#include "tests/io/captured_log.h"
#include "tests/io/temporary_folder.h"

namespace sqslam {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

constexpr int kPictures = 24;
constexpr double kStep = 0.04;  // seconds
constexpr int kMaxError = 2;    // grey levels
constexpr double kMaxMeanError = 0.45;
const std::array kColors = {cv::Vec3b(0, 160, 0), cv::Vec3b(200, 30, 40), cv::Vec3b(20, 60, 220),
                            cv::Vec3b(128, 128, 128)};  // B, G, R

int GreyOf(int picture) { return 20 + 9 * picture; }

class ForeignFilms : public ::testing::Test {
 protected:
  void SetUp() override {
    if (std::system("ffmpeg -version > /dev/null 2>&1") != 0) {
      GTEST_SKIP() << "ffmpeg is not installed";
    }
  }

  // Four patches of colour above one whose grey level is the number of the picture.
  static cv::Mat Picture(cv::Size size, int number) {
    cv::Mat picture(size, CV_8UC3, cv::Scalar::all(GreyOf(number)));
    for (int i = 0; i < 4; ++i) {
      picture(cv::Rect(i * size.width / 4, 0, size.width / 4, size.height / 2)).setTo(cv::Scalar(kColors[i]));
    }
    return picture;
  }

  fs::path Raw(cv::Size size) const {
    const fs::path file = folder_.Path() / fmt::format("{}x{}.raw", size.width, size.height);
    std::ofstream out(file, std::ios::binary);
    for (int i = 0; i < kPictures; ++i) {
      const cv::Mat picture = Picture(size, i);
      out.write(reinterpret_cast<const char*>(picture.data),
                static_cast<std::streamsize>(picture.total() * 3));
    }
    return file;
  }

  // Runs ffmpeg on the pictures of this size, with these arguments behind them. Returns the file.
  fs::path Film(const std::string& name, cv::Size size, const std::string& arguments) const {
    const fs::path file = folder_.Path() / name;
    Run(fmt::format("-f rawvideo -pix_fmt bgr24 -s {}x{} -r 25 -i {} {} {}", size.width, size.height,
                    Raw(size).string(), arguments, file.string()));
    return file;
  }
  static void Run(const std::string& arguments) {
    ASSERT_EQ(std::system(("ffmpeg -nostdin -v error -y " + arguments).c_str()), 0) << arguments;
  }

  // Plays the file and compares each frame with the picture of its time. Returns the numbers of the pictures.
  static std::vector<int> Play(const Sequence& sequence, double first_time = 0.0) {
    FrameSource source(sequence);
    std::vector<int> pictures;
    while (const std::optional<Frame> frame = source.Next()) {
      const cv::Size size = frame->bgr.size();
      const int grey = frame->gray.at<std::uint8_t>(3 * size.height / 4, size.width / 2);
      pictures.push_back(static_cast<int>(std::lround((grey - GreyOf(0)) / 9.0)));
      EXPECT_NEAR(frame->timestamp + first_time, kStep * pictures.back(), 0.5 * kStep);
      ExpectColors(frame->bgr);
    }
    EXPECT_EQ(source.Skipped(), 0);
    return pictures;
  }
  // Returns the mean error.
  static double ExpectColors(const cv::Mat& bgr) {
    double sum = 0.0;
    for (int i = 0; i < 4; ++i) {
      const cv::Vec3b seen = bgr.at<cv::Vec3b>(bgr.rows / 4, (2 * i + 1) * bgr.cols / 8);
      for (int c = 0; c < 3; ++c) {
        EXPECT_NEAR(seen[c], kColors[i][c], kMaxError) << "patch " << i << ", channel " << c;
        sum += seen[c] - kColors[i][c];
      }
    }
    return sum / 12.0;
  }
  static std::vector<int> From(int first, int last = kPictures - 1) {
    std::vector<int> numbers;
    for (int i = first; i <= last; ++i) {
      numbers.push_back(i);
    }
    return numbers;
  }

  TemporaryFolder folder_;
};

const cv::Size kFilmSize(160, 120);
// Exact conversion, which ffmpeg's default is not.
std::string ToYuv(const std::string& matrix, const std::string& range) {
  return fmt::format(
      "scale=out_color_matrix={}:out_range={}:flags=accurate_rnd+full_chroma_int,format=yuv420p", matrix,
      range);
}
const std::string kYuv = ToYuv("bt601", "tv");
const std::string kExact = "-c:v libx264 -preset veryfast -qp 1 -g 8 ";

TEST_F(ForeignFilms, HaveTheColoursOfTheirMatrixAndRange) {
  for (const auto& [name, size, matrix, range] :
       {std::tuple("sd.mp4", kFilmSize, "smpte170m", "tv"),
        std::tuple("sd-full.mp4", kFilmSize, "smpte170m", "pc"),
        std::tuple("hd.mp4", cv::Size(1280, 720), "bt709", "tv"),
        std::tuple("hd-full.mkv", cv::Size(320, 240), "bt709", "pc")}) {
    SCOPED_TRACE(name);
    const Sequence sequence = OpenSequence(
        {.path = Film(name, size,
                      fmt::format("-vf {} -colorspace {} -color_range {} {}",
                                  ToYuv(std::string_view(matrix) == "bt709" ? "bt709" : "bt601", range),
                                  matrix, range, kExact))});
    EXPECT_EQ(Play(sequence), From(0));
    EXPECT_NEAR(ExpectColors(FrameSource(sequence).Next()->bgr), 0.0, kMaxMeanError);
  }
}

// Rows whose bytes are no multiple of a register: the decoder must not write behind the picture.
TEST_F(ForeignFilms, StayInTheirMemoryAtAnyWidth) {
  for (const cv::Size size : {cv::Size(600, 400), cv::Size(626, 200), cv::Size(90, 50)}) {
    const std::string name = fmt::format("{}.mp4", size.width);
    const Sequence sequence =
        OpenSequence({.path = Film(name, size, "-vf " + kYuv + " " + kExact), .resize = "1"});
    FrameSource source(sequence);
    std::vector<Frame> frames;  // kept, so that a new picture lies behind the last, where damage shows
    while (std::optional<Frame> frame = source.Next()) {
      frames.push_back(*std::move(frame));
    }
    EXPECT_EQ(std::ssize(frames), kPictures) << size;
  }
}

TEST_F(ForeignFilms, ShowSquarePixelsUpright) {
  const Sequence wide = OpenSequence(
      {.path = Film("wide.mp4", kFilmSize, "-vf setsar=3/2," + kYuv + " " + kExact), .resize = "1"});
  EXPECT_EQ(wide.camera.width, 240);
  EXPECT_EQ(wide.camera.height, 120);
  EXPECT_EQ(Play(wide), From(0));
  // A calibration of the stored pixels.
  const std::string camera = folder_.Write("stored.yaml",
                                           "width: 160\nheight: 120\nfx: 100\nfy: 150\ncx: 79.5\n"
                                           "cy: 59.5\n");
  const Sequence calibrated =
      OpenSequence({.path = folder_.Path() / "wide.mp4", .camera = camera, .resize = "1"});
  EXPECT_NEAR(calibrated.camera.fx, 150.0, 1e-9);
  EXPECT_NEAR(calibrated.camera.cx, 119.5, 1e-9);

  const fs::path turned = folder_.Path() / "turned.mp4";
  Run(fmt::format(
      "-display_rotation 90 -i {} -c copy {} 2> /dev/null || ffmpeg -nostdin -v error -y -i {} -c copy "
      "-metadata:s:v rotate=90 {}",
      Film("flat.mp4", kFilmSize, "-vf " + kYuv + " " + kExact).string(), turned.string(),
      (folder_.Path() / "flat.mp4").string(), turned.string()));
  const Sequence upright = OpenSequence({.path = turned, .resize = "1"});
  EXPECT_EQ(upright.camera.width, 120);
  EXPECT_EQ(upright.camera.height, 160);
  EXPECT_EQ(upright.frames.size(), std::size_t{kPictures});
}

TEST_F(ForeignFilms, StartAtTheFirstPictureThatCanBeDecoded) {
  const fs::path whole = Film("whole.ts", kFilmSize, "-vf " + kYuv + " -bf 2 " + kExact + "-muxrate 4000000");
  std::ifstream in(whole, std::ios::binary);
  const std::string bytes((std::istreambuf_iterator<char>(in)), {});
  for (const double share : {0.2, 0.3, 0.45}) {
    SCOPED_TRACE(share);
    const fs::path cut =
        folder_.Write("cut.ts", bytes.substr(static_cast<std::size_t>(share * bytes.size())));
    const Sequence sequence = OpenSequence({.path = cut, .resize = "1"});
    ASSERT_FALSE(sequence.frames.empty());
    FrameSource source(sequence);
    std::optional<Frame> first = source.Next();
    ASSERT_TRUE(first);
    EXPECT_EQ(first->index, 0);
    const int picture =
        static_cast<int>(std::lround((first->gray.at<std::uint8_t>(90, 80) - GreyOf(0)) / 9.0));
    EXPECT_EQ(picture % 8, 0) << "a key picture";
    EXPECT_EQ(Play(sequence, picture * kStep), From(picture));
  }
}

TEST_F(ForeignFilms, KeepVariableTimesAndEditLists) {
  const Sequence variable =
      OpenSequence({.path = Film("variable.mp4", kFilmSize,
                                 "-vf \"" + kYuv + ",select='not(eq(mod(n,5),2))'\" -vsync vfr " + kExact),
                    .resize = "1"});
  std::vector<int> expected = From(0);
  std::erase_if(expected, [](int i) { return i % 5 == 2; });
  EXPECT_EQ(Play(variable), expected);

  const fs::path whole = Film("whole.mp4", kFilmSize, "-vf " + kYuv + " " + kExact);
  const fs::path cut = folder_.Path() / "cut.mp4";
  Run(fmt::format("-ss 0.44 -i {} -c copy {}", whole.string(), cut.string()));  // from the key picture before
  EXPECT_EQ(Play(OpenSequence({.path = cut, .resize = "1"}), 11 * kStep), From(11));
}

TEST_F(ForeignFilms, IgnoreCoversAndTakeOneStream) {
  const std::string film = Film("film.mp4", kFilmSize, "-vf " + kYuv + " " + kExact).string();
  const std::string other = Film("other.mp4", {64, 48}, "-vf " + kYuv + " " + kExact).string();
  const std::string cover = (folder_.Path() / "cover.png").string();
  const std::string sound = (folder_.Path() / "sound.m4a").string();
  Run(fmt::format("-f lavfi -i color=red:s=500x500 -frames:v 1 {}", cover));
  Run(fmt::format("-f lavfi -i sine=d=1 -c:a aac {}", sound));
  for (const auto& [name, inputs] :
       {std::pair("last.mp4", fmt::format("-i {} -i {} -map 0 -map 1 -c copy -disposition:v:1 attached_pic",
                                          film, cover)),
        std::pair("first.mp4", fmt::format("-i {} -i {} -map 1 -map 0 -c copy -disposition:v:0 attached_pic",
                                           film, cover)),
        std::pair("sound.mkv", fmt::format("-i {} -i {} -map 1 -map 0 -c copy", film, sound))}) {
    SCOPED_TRACE(name);
    Run(inputs + " " + (folder_.Path() / name).string());
    const Sequence sequence = OpenSequence({.path = folder_.Path() / name, .resize = "1"});
    EXPECT_EQ(sequence.camera.width, 160);
    EXPECT_EQ(Play(sequence), From(0));
  }
  const CapturedLog log;
  Run(fmt::format("-i {} -i {} -map 1 -map 0 -c copy -disposition:v:0 0 -disposition:v:1 0 {}", film, other,
                  (folder_.Path() / "two.mkv").string()));
  EXPECT_EQ(Play(OpenSequence({.path = folder_.Path() / "two.mkv", .resize = "1"})), From(0));
  EXPECT_THAT(log.Text(),
              HasSubstr("two.mkv: has 2 streams of video, of which number 1 of 160x120 is taken"));
  EXPECT_THAT(InputErrorOf([&] { OpenSequence({.path = sound}); }),
              HasSubstr("sound.m4a: cannot be read as a video"));
}

}  // namespace
}  // namespace sqslam
