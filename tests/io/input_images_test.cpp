#include "slam/io/input_images.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>

#include "tests/io/temporary_folder.h"
#include "tests/support/film.h"

namespace sqslam {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

constexpr int kFilmFrames = 50;

cv::Mat GreyPicture(int index) { return cv::Mat(96, 128, CV_8UC3, cv::Scalar::all(4.0 * index + 20.0)); }

// The index of the picture that the image is, by its brightness; -1 for no image.
int IndexOf(const cv::Mat& image) {
  return image.empty() ? -1 : static_cast<int>(std::lround((cv::mean(image)[1] - 20.0) / 4.0));
}

class InputImagesTest : public ::testing::Test {
 protected:
  // A recording of the sequence with one state, whose camera has half of the pictures' size.
  RecordingReader Record(const fs::path& sequence, const MapSnapshot& wanted = {}) const {
    MapSnapshot map = wanted;
    map.camera = {64, 48, 60.0, 60.0, 32.0, 24.0};
    const fs::path file = folder_.Path() / "map.sqmap";
    RecordingWriter(file, {sequence.string(), "test", ""}).Add(map);
    return RecordingReader(file);
  }
  fs::path Film() const {
    const fs::path file = folder_.Path() / "film.mp4";
    std::vector<double> seconds;
    for (int i = 0; i < kFilmFrames; ++i) {
      seconds.push_back(i / 25.0);
    }
    testing::WriteFilm(file, seconds, GreyPicture);
    return file;
  }

  TemporaryFolder folder_;
};

TEST_F(InputImagesTest, ReadsFramesOfFilmInAnyOrder) {
  InputImages images(Record(Film()));
  ASSERT_NE(images.FindSequence(), nullptr);
  for (const int frame : {0, 1, 2, 10, 49, 3, 3, 45}) {
    const cv::Mat image = images.Read(frame);
    EXPECT_EQ(IndexOf(image), frame);
    EXPECT_EQ(image.size(), cv::Size(64, 48));
  }
  EXPECT_TRUE(images.Read(kFilmFrames).empty());
  EXPECT_TRUE(images.Read(-1).empty());
}

TEST_F(InputImagesTest, ReadsFilesOfFolder) {
  for (int i = 0; i < 5; ++i) {
    cv::imwrite((folder_.Path() / ("images" + std::to_string(i) + ".png")).string(), GreyPicture(i));
  }
  InputImages images(Record(folder_.Path()));
  EXPECT_EQ(IndexOf(images.Read(3)), 3);
  EXPECT_EQ(images.Read(3).size(), cv::Size(64, 48));
}

TEST_F(InputImagesTest, RefusesChangedNumbering) {
  const auto image = [this](int i) { return folder_.Path() / ("images" + std::to_string(i) + ".png"); };
  for (int i = 0; i < 5; ++i) {
    cv::imwrite(image(i).string(), GreyPicture(i));
  }
  MapSnapshot map;
  map.frame_index = 3;
  map.image_path = image(3).string();
  const RecordingReader recording = Record(folder_.Path(), map);
  fs::remove(image(4));  // frames before it keep their numbers
  EXPECT_EQ(IndexOf(InputImages(recording).Read(2)), 2);
  fs::remove(image(0));
  InputImages images(recording);
  EXPECT_EQ(images.FindSequence(), nullptr);
  EXPECT_TRUE(images.Read(2).empty());
  EXPECT_THAT(images.WhyNot(), HasSubstr("images3.png is image 2 there (from 0), but image 3 of the map"));
  EXPECT_EQ(IndexOf(images.Read(map)), 3);  // the file that the snapshot names is still there
}

TEST_F(InputImagesTest, PrefersFileNamedBySnapshot) {
  const fs::path named = folder_.Path() / "named.png";
  cv::imwrite(named.string(), GreyPicture(33));
  MapSnapshot map;
  map.camera = {64, 48, 60.0, 60.0, 32.0, 24.0};
  map.frame_index = 7;
  InputImages images(Record(Film()));
  EXPECT_EQ(IndexOf(images.Read(map)), 7);
  map.image_path = named.string();
  EXPECT_EQ(IndexOf(images.Read(map)), 33);
  map.image_path = "/gone.png";
  EXPECT_TRUE(images.Has(map));
  EXPECT_EQ(IndexOf(images.Read(map)), 7);
}

TEST_F(InputImagesTest, ReportsReasonForMissingImages) {
  InputImages images(Record("/gone/film.mp4"));
  EXPECT_EQ(images.FindSequence(), nullptr);
  EXPECT_TRUE(images.Read(0).empty());
  EXPECT_FALSE(images.Has(MapSnapshot()));
  EXPECT_THAT(images.WhyNot(), HasSubstr("/gone/film.mp4"));
}

}  // namespace
}  // namespace sqslam
