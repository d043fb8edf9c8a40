#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>
#include <thread>

#include "render/scene/class_colors.h"
#include "render/scene/style.h"
#include "run_program.h"
#include "slam/snapshot/recording.h"
#include "tests/render/hand_made_map.h"

namespace sqslam {
namespace {
namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;
using testing::ProgramRun;
using testing::RunProgram;
using testing::Slurp;

// A map of three snapshots whose images are there.
class RenderCommandTest : public ::testing::Test {
 protected:
  void SetUp() override {
    const std::string image = (folder_.Path() / "image.png").string();
    cv::imwrite(image, cv::Mat(240, 320, CV_8UC3, cv::Scalar(200, 120, 60)));
    RecordingWriter writer(folder_.Path() / "map.sqmap", {});
    for (int i = 0; i < 3; ++i) {
      MapSnapshot map = HandMadeMap();
      map.sequence_number = i;
      map.frame_index = 30 * i;
      map.timestamp = i;
      map.image_path = image;
      writer.Add(map);
    }
    writer.Close();
  }

  std::string Out(const std::string& name) const { return (folder_.Path() / name).string(); }

  ProgramRun Render(const std::string& arguments, const std::string& before = "") const {
    return RunProgram("render " + folder_.Path().string() +
                          " --resolution 320,240 --rendering-backend osmesa --quiet " + arguments,
                      before);
  }

  int FilesLeft() const {
    return static_cast<int>(std::distance(fs::directory_iterator(folder_.Path()), fs::directory_iterator()));
  }

  // Starts a render that would take hours, presses Ctrl-C once its file is begun, and returns the exit code.
  int Interrupt(const std::string& output, const std::string& growth,
                const std::function<bool()>& begun) const {
    const std::string err = Out("err.txt");
    const pid_t child = ::fork();
    if (child == 0) {
      ::signal(SIGINT, SIG_DFL);  // whatever the tests were started by
      if (::freopen(err.c_str(), "w", stderr) != nullptr) {
        ::execl(SQSLAM_PROGRAM, "sqslam", "render", folder_.Path().c_str(), "--output", output.c_str(),
                "--resolution", "320,240", "--seconds", "36000", "--fps", "60", "--quiet",
                growth.empty() ? nullptr : growth.c_str(), nullptr);
      }
      ::_exit(99);
    }
    int status = 0;
    for (int i = 0; i < 6000 && !begun() && ::waitpid(child, &status, WNOHANG) == 0; ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    ::kill(child, SIGINT);
    ::waitpid(child, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : 1000 + WTERMSIG(status);
  }

  TemporaryFolder folder_;
};

int FramesIn(const std::string& path) {
  cv::VideoCapture video(path);
  cv::Mat frame;
  int frames = 0;
  while (video.read(frame)) {
    ++frames;
  }
  return frames;
}

TEST_F(RenderCommandTest, FinishesPlayableVideoOnCtrlC) {
  const std::string output = Out("orbit.mp4");
  const auto begun = [&] {  // the file has no name yet
    for (const auto& entry : fs::directory_iterator(folder_.Path())) {
      if (entry.path().extension() == ".mp4" && fs::file_size(entry.path()) > 0) {
        return true;
      }
    }
    return false;
  };
  EXPECT_EQ(Interrupt(output, "", begun), 130);
  const int frames = FramesIn(output);
  EXPECT_GE(frames, 1);
  EXPECT_THAT(Slurp(Out("err.txt")),
              HasSubstr("interrupted; " + std::to_string(frames) + " of 2160000 frames"));
}

TEST_F(RenderCommandTest, KeepsNumberedPicturesOnCtrlC) {
  // Growth of three seconds at most: interrupted after its second picture of 120.
  EXPECT_EQ(Interrupt(Out("{frame:03}.png"), "--growth", [&] { return fs::exists(Out("001.png")); }), 130);
  int pictures = 0;
  for (const auto& entry : fs::directory_iterator(folder_.Path())) {
    EXPECT_EQ(entry.path().filename().string().find(".tmp"), std::string::npos);
    pictures += entry.path().extension() == ".png" && entry.path().stem() != "image" ? 1 : 0;
  }
  EXPECT_GE(pictures, 2);
  EXPECT_LT(pictures, 120);
  EXPECT_THAT(Slurp(Out("err.txt")),
              HasSubstr("interrupted; " + std::to_string(pictures) + " of 120 frames"));
}

TEST_F(RenderCommandTest, ReportsFullDiskAndLeavesNoVideo) {
  const int before = FilesLeft();
  const ProgramRun run =
      Render("--output " + Out("a.mp4") + " --seconds 3 --fps 10", "ulimit -f 8");  // 4 or 8 KiB
  EXPECT_EQ(run.exit_code, 3);
  EXPECT_THAT(run.err, AllOf(HasSubstr("/a.mp4: "), HasSubstr("File too large"), HasSubstr("free space")));
  EXPECT_EQ(FilesLeft(), before);
}

TEST_F(RenderCommandTest, MakesAndJoinsPieces) {
  for (const char* shard : {"1/2", "2/2"}) {
    const ProgramRun run = Render("--output " + Out("g.mp4") + " --growth --fps 1 --shard " + shard);
    EXPECT_EQ(run.exit_code, 0) << run.err;
  }
  const std::string join = "render --join " + Out("g.part-2-of-2.mp4") + " ";
  const ProgramRun joined =
      RunProgram(join + Out("g.part-1-of-2.mp4") + " --output " + Out("g.mp4") + " --quiet");
  EXPECT_EQ(joined.exit_code, 0) << joined.err;
  EXPECT_EQ(FramesIn(Out("g.mp4")), 3);
  const ProgramRun lacking = RunProgram(join + " --output " + Out("h.mp4"));
  EXPECT_EQ(lacking.exit_code, 3);
  EXPECT_THAT(lacking.err, HasSubstr("missing piece 1 of 2"));
}

TEST_F(RenderCommandTest, DrawsCameraFrameOverItsImage) {
  const auto run = [&](const std::string& arguments) {
    return RunProgram("render " + folder_.Path().string() + " --output " + Out("p.png") + " --quiet " +
                      arguments);
  };
  EXPECT_EQ(run("--camera-frame 30").exit_code, 0);
  EXPECT_EQ(cv::imread(Out("p.png")).size(), cv::Size(320, 240));
  const ProgramRun overlay = run("--camera-frame 60 --overlay");
  EXPECT_EQ(overlay.exit_code, 0) << overlay.err;
  const cv::Vec3b corner_of_photo(200, 120, 60);
  EXPECT_EQ(cv::imread(Out("p.png")).at<cv::Vec3b>(0, 0), corner_of_photo);
  const ProgramRun photo = run("--camera-frame 60 --photo --at-frame 60 --set text.legend=false");
  EXPECT_EQ(photo.exit_code, 0) << photo.err;
  const cv::Mat over_photo = cv::imread(Out("p.png"));
  EXPECT_EQ(over_photo.at<cv::Vec3b>(0, 0), corner_of_photo);
  cv::Mat drawn;
  cv::inRange(over_photo, corner_of_photo, corner_of_photo, drawn);
  EXPECT_LT(cv::countNonZero(drawn), 0.98 * static_cast<double>(drawn.total())) << "the map lies over it";
  EXPECT_EQ(run("--camera-frame 60 --photo --resolution 500,240 --style dark").exit_code, 0);
  EXPECT_EQ(cv::imread(Out("p.png")).at<cv::Vec3b>(2, 92), corner_of_photo) << "in the middle";
  EXPECT_NE(cv::imread(Out("p.png")).at<cv::Vec3b>(2, 86), corner_of_photo);
  const ProgramRun unknown = run("--camera-frame 31");
  EXPECT_EQ(unknown.exit_code, 2);
  EXPECT_THAT(unknown.err,
              AllOf(HasSubstr("frame 31"), HasSubstr("from 0 to 70"), HasSubstr("nearest is 30")));
  fs::remove(Out("image.png"));
  const ProgramRun gone = run("--camera-frame 60 --overlay");
  EXPECT_EQ(gone.exit_code, 3);
  EXPECT_THAT(gone.err, HasSubstr("frame 60"));
}

TEST_F(RenderCommandTest, RejectsContradictoryOptions) {
  for (const std::string arguments :
       {"--output a.mp4 --camera-path spiral", "--output a.mp4 --camera-path none.yaml",
        "--output a.mp4 --shard 3/2", "--output a.mp4 --camera-frame 30", "--output a.png --overlay",
        "--output a.png --photo", "--output a.png --camera-frame 30 --photo --overlay",
        "--output a.mp4 --projection orthographic --camera-path follow",
        "--output a.png --camera-frame 30 --projection orthographic", "--output a.png --shard 1/2",
        "--output a.png --camera-frame 30 --view top", "--output a.png --view under",
        "--join b.part-1-of-1.mp4 --output c.mp4"}) {
    const ProgramRun run = Render(arguments);
    EXPECT_EQ(run.exit_code, 2) << arguments << ": " << run.err;
    EXPECT_EQ(run.ErrorLines().size(), 1u) << run.err;
  }
  EXPECT_EQ(RunProgram("render --output a.png").exit_code, 2);
  EXPECT_EQ(RunProgram("run x --video a.avi").exit_code, 2);
  EXPECT_EQ(RunProgram("run x --video /nonexistent/a.mp4").exit_code, 2);
}

TEST_F(RenderCommandTest, DrawsVectorGraphicsLikePicture) {
  const std::string look =
      "--set objects.labels=true --set light.shadow=0 --set light.ambient_occlusion=0 --output ";
  ASSERT_EQ(Render(look + Out("map.svg")).exit_code, 0);
  const std::string svg = Slurp(Out("map.svg"));
  for (const char* part : {"<image", ">cup<", ">book<", ">sports ball<", ">grid "}) {
    EXPECT_THAT(svg, HasSubstr(part));
  }
  // Three silhouettes in the colours of their classes.
  for (const char* label : {"cup", "book", "sports_ball"}) {
    EXPECT_THAT(svg,
                HasSubstr("Z\" fill=\"" + FormatColor(LabelColors()(label)) + "\" fill-opacity=\"0.85\""));
  }
  ASSERT_EQ(Render(look + Out("map.pdf")).exit_code, 0);
  EXPECT_EQ(Slurp(Out("map.pdf")).substr(0, 5), "%PDF-");
  EXPECT_EQ(Render("--camera-frame 30 --output " + Out("no.svg")).exit_code, 2);
}

TEST_F(RenderCommandTest, WritesDensityOfPictures) {
  ASSERT_EQ(Render("--output " + Out("a.png")).exit_code, 0);
  ASSERT_EQ(Render("--growth --frames 1 --output '" + Out("{frame}.png") + "'").exit_code, 0);
  for (const char* name : {"a.png", "0.png"}) {
    EXPECT_EQ(Slurp(Out(name)).substr(37, 4), "pHYs") << name;
    EXPECT_FALSE(cv::imread(Out(name)).empty());
  }
}

TEST_F(RenderCommandTest, WritesDifferenceWhenReferenceIsNotMet) {
  ASSERT_EQ(Render("--output " + Out("a.png")).exit_code, 0);
  EXPECT_EQ(Render("--output " + Out("b.png") + " --reference " + Out("a.png")).exit_code, 0);
  EXPECT_FALSE(fs::exists(Out("b-difference.png")));
  const ProgramRun other = Render("--style dark --output " + Out("b.png") + " --reference " + Out("a.png"));
  EXPECT_EQ(other.exit_code, 5);
  EXPECT_THAT(other.err, HasSubstr("b-difference.png"));
  const cv::Mat difference = cv::imread(Out("b-difference.png"));
  EXPECT_EQ(difference.size(), cv::Size(3 * 320, 240));
}

TEST_F(RenderCommandTest, DetectsOneMissingObjectOnWhitePaper) {
  const std::string bare =
      "--set points.show=false --set grid.show=false --set cameras.trajectory=false --set "
      "cameras.keyframes=false --set cameras.current=false --output " +
      Out("a.png");
  ASSERT_EQ(Render(bare).exit_code, 0);
  cv::Mat reference = cv::imread(Out("a.png"));
  cv::circle(reference, {24, 24}, 16, {40, 40, 40}, cv::FILLED, cv::LINE_AA);  // 1 % of the picture
  cv::imwrite(Out("reference.png"), reference);
  const ProgramRun run = Render(bare + " --reference " + Out("reference.png"));
  EXPECT_EQ(run.exit_code, 5);
  EXPECT_THAT(run.err, HasSubstr("a-difference.png"));
}

}  // namespace
}  // namespace sqslam
