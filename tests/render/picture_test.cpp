#include "render/picture.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/quality/qualityssim.hpp>

#include "tests/render/sample_map.h"

namespace sqslam {
namespace {

namespace fs = std::filesystem;

bool SameBytes(const cv::Mat& a, const cv::Mat& b) {
  return a.size() == b.size() && a.type() == b.type() && cv::norm(a, b, cv::NORM_INF) == 0.0;
}

PictureOptions SmallPicture(const std::string& style = "paper") {
  PictureOptions options;
  options.width = 320;
  options.height = 240;
  options.style = LoadStyle(style);
  return options;
}

// 1 - SSIM between a picture and tests/baselines/NAME.png. A picture that differs is left beside the test
// program. With SQSLAM_UPDATE_BASELINES set, the picture becomes the baseline (scripts/update-baselines.sh).
double DifferenceFromBaseline(const cv::Mat& image, const std::string& name) {
  const fs::path path = fs::path(SQSLAM_SOURCE_DIR) / "tests/baselines" / (name + ".png");
  if (std::getenv("SQSLAM_UPDATE_BASELINES") != nullptr) {  // NOLINT: no other thread runs
    cv::imwrite(path.string(), image);
  }
  const cv::Mat baseline = cv::imread(path.string(), cv::IMREAD_UNCHANGED);
  if (baseline.size() != image.size() || baseline.type() != image.type()) {
    return 1.0;
  }
  const cv::Scalar ssim = cv::quality::QualitySSIM::compute(baseline, image, cv::noArray());
  double worst = ssim[0];
  for (int channel = 1; channel < image.channels(); ++channel) {
    worst = std::min(worst, ssim[channel]);
  }
  if (1.0 - worst > 0.001) {
    cv::imwrite((fs::current_path() / (name + ".differs.png")).string(), image);
  }
  return 1.0 - worst;
}

// Software rendering repeats to the bit, so this allows for little more than another version of Mesa: the command's
// default of 0.04 overlooks a missing object.
constexpr double kThreshold = 0.006;

TEST(PictureTest, PaperStyleLooksAsItDid) {
  EXPECT_LT(DifferenceFromBaseline(RenderPicture(MakeSampleMap(9, 3000), SmallPicture()), "map_paper"),
            kThreshold);
}

TEST(PictureTest, DarkStyleLooksAsItDid) {
  EXPECT_LT(DifferenceFromBaseline(RenderPicture(MakeSampleMap(9, 3000), SmallPicture("dark")), "map_dark"),
            kThreshold);
}

TEST(PictureTest, SolidObjectsWithLabelsLookAsTheyDid) {
  PictureOptions options = SmallPicture();
  options.style.objects.opacity = 1.0;
  options.style.objects.labels = true;
  EXPECT_LT(DifferenceFromBaseline(RenderPicture(MakeSampleMap(4, 500), options), "map_labels"), kThreshold);
}

TEST(PictureTest, ABaselineComparisonNoticesAMissingObject) {
  if (std::getenv("SQSLAM_UPDATE_BASELINES") != nullptr) {  // NOLINT: no other thread runs
    GTEST_SKIP() << "baselines are being written";
  }
  MapSnapshot map = MakeSampleMap(9, 3000);
  PictureRenderer renderer(SmallPicture());
  renderer.SetMap(map);
  map.objects.erase(map.objects.begin() + 4);
  renderer.SetMapKeepingFrame(map);
  EXPECT_GT(DifferenceFromBaseline(renderer.Render(), "map_paper"), kThreshold);
}

TEST(PictureTest, BothBackEndsDrawTheSame) {
  PictureOptions options = SmallPicture();
  options.backend = RenderBackend::kOsmesa;
  const cv::Mat osmesa = RenderPicture(MakeSampleMap(5, 500), options);
  options.backend = RenderBackend::kEgl;
  EXPECT_TRUE(SameBytes(osmesa, RenderPicture(MakeSampleMap(5, 500), options)));
}

TEST(PictureTest, WithoutBackgroundCornersAreClearAndObjectsAreNot) {
  PictureOptions options = SmallPicture();
  options.transparent = true;
  options.style.grid.show = false;
  options.style.text.legend = false;
  options.style.text.scale = false;
  options.style.objects.opacity = 1.0;
  const cv::Mat image = RenderPicture(MakeSampleMap(1, 0), options);
  ASSERT_EQ(image.type(), CV_8UC4);
  cv::Mat alpha;
  cv::extractChannel(image, alpha, 3);
  EXPECT_EQ(alpha.at<std::uint8_t>(0, 0), 0);
  EXPECT_EQ(alpha.at<std::uint8_t>(0, 319), 0);
  EXPECT_GT(cv::countNonZero(alpha == 255), 2000);
  EXPECT_GT(cv::countNonZero(alpha == 0), 2000);
}

TEST(PictureTest, AnOrbitIsTheSameByteForByteTwice) {
  const MapSnapshot map = MakeSampleMap(6, 800);
  std::vector<cv::Mat> first;
  for (int run = 0; run < 2; ++run) {
    PictureRenderer renderer(SmallPicture());
    renderer.SetMap(map);
    const std::vector<ViewCamera> path = OrbitPath(renderer.DefaultCamera(), 4);
    for (std::size_t i = 0; i < path.size(); ++i) {
      const cv::Mat image = renderer.Render(path[i]);
      if (run == 0) {
        first.push_back(image);
      } else {
        EXPECT_TRUE(SameBytes(first[i], image)) << "frame " << i;
      }
    }
  }
  EXPECT_FALSE(SameBytes(first[0], first[1]));
}

TEST(PictureTest, StrayPointsDoNotChangeTheView) {
  MapSnapshot map = MakeSampleMap(6, 800);
  PictureRenderer renderer(SmallPicture());
  renderer.SetMap(map);
  const ViewCamera before = renderer.DefaultCamera();
  for (int i = 0; i < 8; ++i) {
    map.points.push_back({Eigen::Vector3f(500.0F, -300.0F + static_cast<float>(i), 80.0F), {10, 10, 10}, -1});
  }
  renderer.SetMap(map);
  EXPECT_LT((renderer.DefaultCamera().position - before.position).norm(), 0.05 * before.Distance());
}

TEST(PictureTest, AnEmptyMapIsStillAPicture) {
  EXPECT_EQ(RenderPicture(MapSnapshot{}, SmallPicture()).size(), cv::Size(320, 240));
}

}  // namespace
}  // namespace sqslam
