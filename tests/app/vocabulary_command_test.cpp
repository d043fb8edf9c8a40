#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>

#include "slam/recognition/vocabulary.h"
#include "tests/app/run_program.h"

namespace sqslam::testing {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

// Noise in blocks: corners everywhere.
cv::Mat TexturedImage(int width, int height, int seed) {
  cv::Mat image(height, width, CV_8U);
  cv::RNG random(static_cast<std::uint64_t>(seed));
  for (int y = 0; y < height; y += 8) {
    for (int x = 0; x < width; x += 8) {
      image(cv::Rect(x, y, 8, 8)).setTo(random.uniform(0, 256));
    }
  }
  return image;
}

class VocabularyCommand : public ::testing::Test {
 protected:
  VocabularyCommand() {
    for (int i = 0; i < 3; ++i) {
      folder_.Write("images/sub/keep", "");  // not an image
      cv::imwrite((images_ / "sub" / (std::to_string(i) + ".png")).string(), TexturedImage(320, 240, i));
    }
  }
  ProgramRun Learn(const std::string& arguments) const {
    return RunProgram("vocabulary " + arguments + " --output " + file_.string());
  }

  TemporaryFolder folder_;
  std::filesystem::path images_ = folder_.Path() / "images";
  std::filesystem::path file_ = folder_.Path() / "words.bin";
};

TEST_F(VocabularyCommand, LearnsFromFolder) {
  const ProgramRun run = Learn(images_.string() + " --branching 4 --depth 2 --features 200");
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, AllOf(HasSubstr("16 words in 2 levels"), HasSubstr("of 3 images")));
  const ProgramRun info = RunProgram("info " + file_.string());
  EXPECT_EQ(info.exit_code, 0);
  EXPECT_THAT(info.out,
              AllOf(HasSubstr("words      16"), HasSubstr("levels     2"), HasSubstr("of 3 images")));
}

TEST_F(VocabularyCommand, UsesListedFramesOfSequenceWithStride) {
  std::filesystem::create_directories(folder_.Path() / "sequence");
  folder_.Write("sequence/rgb.txt",
                "# a comment\n0.0 ../images/sub/0.png\n0.1 ../images/sub/1.png\n0.2 ../images/sub/2.png\n");
  const std::string arguments = (folder_.Path() / "sequence").string() + " --stride 2 --depth 2 --quiet";
  ASSERT_EQ(Learn(arguments).exit_code, 0);
  EXPECT_EQ(Vocabulary::Load(file_).TrainedImages(), 2u);
  const std::string first = Slurp(file_);
  ASSERT_EQ(Learn(arguments).exit_code, 0);
  EXPECT_EQ(Slurp(file_), first);
}

TEST_F(VocabularyCommand, MakesSeveralViewsOfLargePhotographs) {
  const std::string photograph = (folder_.Path() / "large.png").string();
  cv::imwrite(photograph, TexturedImage(1600, 1000, 9));
  const ProgramRun run = Learn(photograph + " " + images_.string() + " --views 2 --depth 2 --quiet");
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(run.out, "");
  EXPECT_EQ(Vocabulary::Load(file_).TrainedImages(), 2u + 3u);
}

TEST_F(VocabularyCommand, SkipsUnreadableImagesWithWarning) {
  folder_.Write("images/broken.png", "no image");
  const ProgramRun run = Learn(images_.string() + " --depth 2");
  EXPECT_EQ(run.exit_code, 0);
  EXPECT_THAT(run.err, HasSubstr("broken.png: cannot be read as an image, skipped"));
  EXPECT_EQ(Vocabulary::Load(file_).TrainedImages(), 3u);
}

TEST_F(VocabularyCommand, RejectsUnusableInputAndWritesNoFile) {
  std::filesystem::create_directories(folder_.Path() / "empty");
  cv::imwrite((folder_.Path() / "white.png").string(), cv::Mat(240, 320, CV_8U, cv::Scalar(255)));
  folder_.Write("bad/rgb.txt", "0.0\n");
  for (const auto& [input, message] :
       std::vector<std::pair<std::string, std::string>>{{"nothing", "does not exist"},
                                                        {"empty", "holds no image"},
                                                        {"images/sub/keep", "cannot be read"},
                                                        {"bad", "rgb.txt:1"},
                                                        {"white.png", "no features to learn words from"}}) {
    const ProgramRun run = Learn((folder_.Path() / input).string());
    EXPECT_EQ(run.exit_code, 3) << input;
    EXPECT_THAT(run.ErrorLines(), ElementsAre(HasSubstr(message)));
    EXPECT_FALSE(std::filesystem::exists(file_));
  }
}

TEST_F(VocabularyCommand, ReportsWrongUsageWithCodeTwo) {
  for (const std::string options : {"", "--depth 0", "--branching 1", "--stride 0", "--views -1"}) {
    EXPECT_EQ(Learn((options.empty() ? "" : images_.string() + " ") + options).exit_code, 2) << options;
  }
}

TEST_F(VocabularyCommand, ReportsDamagedVocabularyInInfo) {
  ASSERT_EQ(Learn(images_.string() + " --depth 2 --quiet").exit_code, 0);
  std::filesystem::resize_file(file_, 100);
  const ProgramRun info = RunProgram("info " + file_.string());
  EXPECT_EQ(info.exit_code, 3);
  EXPECT_THAT(info.ErrorLines(), ElementsAre(HasSubstr("words.bin: has 100 bytes")));
}

}  // namespace
}  // namespace sqslam::testing
