#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

#include "slam/io/cameras.h"
#include "slam/util/error.h"
#include "slam/util/text_lines.h"
#include "tests/io/photograph.h"

namespace sqslam {
namespace {

// A photograph whose EXIF holds the focal length for 35 mm film.
std::filesystem::path WithFocalLength(const TemporaryFolder& folder, const cv::Size& size,
                                      std::uint32_t focal_mm) {
  return WritePhotograph(folder, "photo.jpg", cv::Mat(size, CV_8UC3, cv::Scalar::all(99)),
                         {.focal_mm = focal_mm});
}

TEST(CameraGuess, UsesPhotographsFocalLengthByDiagonal) {
  const TemporaryFolder folder;
  const auto guess = GuessCamera(WithFocalLength(folder, {400, 300}, 26), 30.0);
  ASSERT_TRUE(guess);
  EXPECT_EQ(guess->camera.width, 400);
  EXPECT_EQ(guess->camera.height, 300);
  EXPECT_NEAR(guess->camera.fx, 26.0 / std::hypot(36.0, 24.0) * 500.0, 0.01);
  EXPECT_EQ(guess->camera.fx, guess->camera.fy);
  EXPECT_NE(guess->source.find("26 mm"), std::string::npos) << guess->source;
}

TEST(CameraGuess, RefusesClaimedSizeBeforeDecoding) {
  const TemporaryFolder folder;
  std::string bytes = ReadFile(WithFocalLength(folder, {64, 48}, 26), "a photograph");
  const std::size_t frame = bytes.find("\xFF\xC0");
  ASSERT_NE(frame, std::string::npos);
  bytes.replace(frame + 5, 4, "\xFD\xE8\xFD\xE8");  // 65000 by 65000
  const std::string png(                            // header, a hundred bytes of pixels, end
      "\x89PNG\r\n\x1A\n\0\0\0\x0DIHDR\0\0\xFD\xE8\0\0\xFD\xE8\x08\0\0\0\0\x87\x3C\x86\xD6"
      "\0\0\0\x0CIDAT\x78\x9C\x63\x60\xA0\x3D\0\0\0\x64\0\x01\x86\x64\x3C\x35\0\0\0\0IEND\xAE\x42\x60\x82",
      69);
  for (const auto& file : {folder.Write("large.jpg", bytes), folder.Write("large.png", png)}) {
    try {
      GuessCamera(file, 30.0);
      ADD_FAILURE() << file;
    } catch (const InputError& e) {
      EXPECT_NE(std::string(e.what()).find("65000x65000 pixels, expected sides from 16 to 16384"),
                std::string::npos)
          << e.what();
    }
  }
}

TEST(CameraGuess, AssumesSixtyDegreesAlongLongerSideOtherwise) {
  const TemporaryFolder folder;
  const std::filesystem::path image = folder.Path() / "a.png";
  cv::imwrite(image.string(), cv::Mat(400, 300, CV_8UC3, cv::Scalar::all(9)));
  const auto guess = GuessCamera(image, 25.0);
  ASSERT_TRUE(guess);
  EXPECT_NEAR(guess->camera.fx, 200.0 / std::tan(30.0 * std::numbers::pi / 180.0), 1e-9);
  EXPECT_EQ(guess->camera.cx, 149.5);
  EXPECT_EQ(guess->camera.fps, 25.0);
  EXPECT_FALSE(GuessCamera(folder.Path() / "none.png", 25.0));
}

}  // namespace
}  // namespace sqslam
