#include "slam/inspection/film_inspection.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <numbers>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "tests/io/temporary_folder.h"

namespace sqslam {
namespace {

using ::testing::AllOf;
using ::testing::Each;
using ::testing::ElementsAre;
using ::testing::Field;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr double kFps = 10.0;
const Camera kCamera{320, 240, 300.0, 300.0, 160.0, 120.0, {}, kFps};

// A wall with cards of all sizes and greys, seen by a camera at the origin that looks along z.
class Wall {
 public:
  explicit Wall(std::uint64_t seed) {
    cv::RNG random(seed);
    cards_.create(900, 1600, CV_8UC3);
    cards_.setTo(cv::Scalar::all(120));
    for (int i = 0; i < 2500; ++i) {
      const cv::Point corner(random.uniform(0, 1600), random.uniform(0, 900));
      const cv::Size size(random.uniform(6, 60), random.uniform(6, 60));
      cv::rectangle(cards_, cv::Rect(corner, size), cv::Scalar::all(random.uniform(30, 220)), cv::FILLED);
    }
  }

  // As the camera sees it that has been turned by `yaw` (radians) and moved by `x` (wall widths to the
  // right).
  cv::Mat Seen(double yaw, double x) const {
    const cv::Matx33d K(300, 0, 160, 0, 300, 120, 0, 0, 1);
    const cv::Matx33d R(std::cos(yaw), 0, -std::sin(yaw), 0, 1, 0, std::sin(yaw), 0, std::cos(yaw));
    const cv::Matx33d wall(1, 0, -800 - x * 1600, 0, 1, -450, 0, 0, 300);
    cv::Mat image;
    cv::warpPerspective(cards_, image, K * R * wall, {320, 240}, cv::INTER_AREA);
    return image;
  }

 private:
  cv::Mat cards_;
};

// The upper half of the picture shows a wall that is far away, the lower one a wall that is near.
cv::Mat TwoWalls(double yaw, double x) {
  static const Wall far(1);
  static const Wall near(2);
  cv::Mat image = far.Seen(yaw, 0.4 * x);
  near.Seen(yaw, x).rowRange(120, 240).copyTo(image.rowRange(120, 240));
  return image;
}

cv::Mat Walking(int i) { return TwoWalls(0.0, 0.004 * i); }

class FilmInspectionTest : public ::testing::Test {
 protected:
  FilmInspection Inspect(int frames, const std::function<cv::Mat(int)>& image,
                         const InspectionOptions& options = {},
                         const InspectionProgress& progress = nullptr) const {
    Sequence sequence;
    sequence.path = folder_.Path();
    sequence.camera = kCamera;
    for (int i = 0; i < frames; ++i) {
      const auto file = folder_.Path() / (std::to_string(i) + ".png");
      if (const cv::Mat pixels = image(i); !pixels.empty()) {
        cv::imwrite(file.string(), pixels);
      } else {
        std::filesystem::remove(file);  // of an earlier film
      }
      sequence.frames.emplace_back();
      sequence.frames.back().timestamp = 100.0 + i / kFps;
      sequence.frames.back().image_path = file;
    }
    return InspectFilm(sequence, {}, options, nullptr, progress);
  }
  static std::vector<FilmTrouble> Troubles(const FilmInspection& inspection) {
    std::vector<FilmTrouble> troubles;
    for (const FilmFinding& finding : inspection.findings) {
      troubles.push_back(finding.trouble);
    }
    return troubles;
  }

  TemporaryFolder folder_;
};

TEST_F(FilmInspectionTest, AcceptsWalkPastThings) {
  const FilmInspection inspection = Inspect(60, Walking);
  EXPECT_THAT(inspection.findings, IsEmpty());
  EXPECT_TRUE(inspection.IsFit());
  EXPECT_NEAR(inspection.moving, inspection.seconds, 1e-9);
  EXPECT_THAT(inspection.moments, Each(Field(&FilmMoment::sideways, ::testing::Gt(0.1))));
}

TEST_F(FilmInspectionTest, ReportsStandstill) {
  const FilmInspection inspection = Inspect(40, [](int) { return TwoWalls(0.0, 0.0); });
  EXPECT_THAT(Troubles(inspection), ElementsAre(FilmTrouble::kStandstill));
  EXPECT_FALSE(inspection.IsFit());
}

TEST_F(FilmInspectionTest, ReportsTurningOnTheSpotWithTimes) {
  const FilmInspection inspection = Inspect(100, [](int i) {
    const int turned = std::clamp(i, 40, 70) - 40;  // from second 4 to 7
    return TwoWalls(0.012 * turned, 0.004 * (i - turned));
  });
  ASSERT_THAT(Troubles(inspection), ElementsAre(FilmTrouble::kTurning));
  EXPECT_NEAR(inspection.findings[0].begin, 4.0, 0.5);
  EXPECT_NEAR(inspection.findings[0].end, 7.0, 0.5);
  EXPECT_THAT(InWords(inspection.findings[0]),
              AllOf(HasSubstr("0:04 to 0:07"), HasSubstr("turns on the spot")));
}

TEST_F(FilmInspectionTest, TakesLongTurnForBreak) {
  const auto turning = [](double rate) {
    return [rate](int i) { return TwoWalls(rate * (std::clamp(i, 30, 70) - 50), 0.003 * std::min(i, 30)); };
  };
  EXPECT_FALSE(Inspect(80, turning(0.012)).findings.front().breaks);
  EXPECT_TRUE(Inspect(80, turning(0.03)).findings.front().breaks);
}

TEST_F(FilmInspectionTest, ReportsBlurDarknessAndPlainWalls) {
  EXPECT_THAT(Troubles(Inspect(40,
                               [](int i) {
                                 cv::Mat image = Walking(i);
                                 cv::blur(image.clone(), image, {15, 15});
                                 return image;
                               })),
              ElementsAre(FilmTrouble::kBlur));
  EXPECT_THAT(Troubles(Inspect(40, [](int i) { return cv::Mat(Walking(i) / 50); })),
              ElementsAre(FilmTrouble::kExposure));
  EXPECT_THAT(Troubles(Inspect(40,
                               [](int i) {
                                 cv::Mat image(240, 320, CV_8UC3, cv::Scalar::all(150));
                                 Walking(i)(cv::Rect(0, 0, 60, 60)).copyTo(image(cv::Rect(0, 0, 60, 60)));
                                 return image;
                               })),
              ElementsAre(FilmTrouble::kTexture));
}

TEST_F(FilmInspectionTest, ReportsJumpBetweenFrames) {
  const FilmInspection inspection = Inspect(60, [](int i) { return Walking(i < 30 ? i : i - 120); });
  ASSERT_THAT(Troubles(inspection), ElementsAre(FilmTrouble::kJump));
  EXPECT_NEAR(inspection.findings[0].begin, 2.9, 0.35);
  EXPECT_FALSE(inspection.IsFit());  // half of it on either side
}

TEST_F(FilmInspectionTest, IgnoresShortTrouble) {
  const auto blurred_once = [](int i) {
    cv::Mat image = Walking(i);
    if (i >= 30 && i < 33) {
      cv::blur(image.clone(), image, {15, 15});
    }
    return image;
  };
  EXPECT_THAT(Troubles(Inspect(60, blurred_once)), IsEmpty());
}

// A frame that cannot be read shifts neither samples nor their neighbours against each other: each sample is
// compared with the frame after it.
TEST_F(FilmInspectionTest, ToleratesUnreadableFrame) {
  InspectionOptions options;
  options.sample_interval = 0.4;
  options.min_trouble = 0.3;
  const auto whole = Inspect(80, Walking, options);
  for (const int missing : {20, 21}) {  // a sample; the frame after one
    const auto inspection = Inspect(
        80, [&](int i) { return i == missing ? cv::Mat() : Walking(i); }, options);
    EXPECT_THAT(inspection.findings, IsEmpty()) << missing;
    for (const FilmMoment& moment : inspection.moments) {
      const auto same = std::ranges::find(whole.moments, moment.frame, &FilmMoment::frame);
      ASSERT_NE(same, whole.moments.end());
      if (moment.frame != 16 && moment.frame != 20) {
        EXPECT_EQ(moment.shared, same->shared) << moment.frame << " without " << missing;
      }
    }
  }
}

TEST_F(FilmInspectionTest, StopsWhenCancelled) {
  const FilmInspection inspection =
      Inspect(40, Walking, {}, [](std::int64_t done, std::int64_t) { return done < 2; });
  EXPECT_EQ(inspection.moments.size(), 2u);
  EXPECT_THAT(inspection.findings, IsEmpty());
}

TEST_F(FilmInspectionTest, RefusesTooFewFrames) {
  EXPECT_THAT(InputErrorOf([&] { Inspect(2, Walking); }), HasSubstr("expected at least three"));
}

TEST(BlurOfTest, RisesWithBlurAndIgnoresContrast) {
  cv::Mat sharp;
  cv::cvtColor(Walking(0), sharp, cv::COLOR_BGR2GRAY);
  double last = BlurOf(sharp);
  cv::Mat faint;
  sharp.convertTo(faint, CV_8U, 0.5, 60.0);
  EXPECT_NEAR(BlurOf(faint), last, 0.03);
  for (const int size : {3, 7, 15}) {
    cv::Mat blurred;
    cv::blur(sharp, blurred, {size, size});
    EXPECT_GT(BlurOf(blurred), last + 0.03);
    last = BlurOf(blurred);
  }
  cv::Mat shaken;  // blurred in one direction alone
  cv::blur(sharp, shaken, {15, 1});
  EXPECT_GT(BlurOf(shaken), BlurOf(sharp) + 0.2);
}

}  // namespace
}  // namespace sqslam
