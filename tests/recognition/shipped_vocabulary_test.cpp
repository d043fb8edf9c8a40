// assets/vocabulary.bin, the words that come with the program.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "slam/features/orb_extractor.h"
#include "slam/recognition/place_index.h"
#include "slam/recognition/vocabulary.h"

namespace sqslam::testing {
namespace {

const std::filesystem::path kSource = SQSLAM_SOURCE_DIR;

TEST(ShippedVocabulary, HasManyWordsInSmallFile) {
  EXPECT_LE(std::filesystem::file_size(kSource / "assets/vocabulary.bin"), 8U << 20U);
  const Vocabulary vocabulary = Vocabulary::Load(kSource / "assets/vocabulary.bin");
  EXPECT_EQ(vocabulary.Depth(), 5);
  EXPECT_GT(vocabulary.Words(), 50000u);
}

TEST(ShippedVocabulary, DistinguishesKitchenFromOfficeAndFindsPlaces) {
  const std::filesystem::path data = kSource / "../shared/data";
  if (!std::filesystem::exists(data / "redkitchen/rgb/000000.jpg") ||
      !std::filesystem::exists(data / "tsukuba/rgb/00000.jpg")) {
    GTEST_SKIP() << "no sequences below " << data;
  }
  const Vocabulary vocabulary = Vocabulary::Load(kSource / "assets/vocabulary.bin");
  OrbExtractor extractor({});
  const auto words_of = [&](const std::filesystem::path& path) {
    const cv::Mat image = cv::imread(path.string());
    cv::Mat gray;
    cv::cvtColor(image, gray, cv::COLOR_BGR2GRAY);
    const Camera camera{.width = image.cols, .height = image.rows, .fx = 525.0, .fy = 525.0};
    return vocabulary.Transform(extractor.Extract(gray, image, camera).descriptors);
  };
  const auto kitchen = [&](int i) { return words_of(data / fmt::format("redkitchen/rgb/{:06}.jpg", i)); };
  constexpr int kOffice = 10000;  // ids from here on
  PlaceIndex index;
  for (int i = 0; i < 15; ++i) {
    index.Add(kOffice + 10 * i, words_of(data / fmt::format("tsukuba/rgb/{:05}.jpg", 10 * i)));
  }
  for (int i = 0; i < 1000; i += 50) {
    index.Add(i, kitchen(i));
  }
  int near = 0;
  for (int i = 10; i < 1000; i += 100) {
    const BagOfWords bow = kitchen(i);
    const auto candidates = index.Query({.bow = &bow, .exclude = {}, .covisible = {}});
    ASSERT_FALSE(candidates.empty());
    EXPECT_LT(candidates[0].id, kOffice) << "frame " << i;
    near += candidates[0].id == i - 10 ? 1 : 0;
  }
  EXPECT_GE(near, 9) << "of 10 frames, a third of a second after one in the index";
}

}  // namespace
}  // namespace sqslam::testing
