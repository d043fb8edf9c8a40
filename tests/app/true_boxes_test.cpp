#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <string>

#include "slam/util/text_lines.h"
#include "tests/io/temporary_folder.h"

namespace sqslam::testing {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

// A camera at the origin of the world looks along z at a box of 0.4 m by 0.2 m by 0.2 m, whose front is 2 m
// away.
class TrueBoxesTest : public ::testing::Test {
 protected:
  TrueBoxesTest() {
    folder_.Write("camera.yaml", "width: 640\nheight: 480\nfx: 500\nfy: 500\ncx: 320\ncy: 240\nfps: 10\n");
    folder_.Write("groundtruth.txt", "0 0 0 0 0 0 0 1\n0.1 0.04 0 0 0 0 0 1\n");
    folder_.Write("objects_gt.json",
                  R"([{"id": 1, "label": "box", "primitive": "cuboid", "center": [0, 0, 2.1], "yaw": 0,
                       "half_size": [0.2, 0.1, 0.1], "shape": [0.1, 0.1]}])");
    folder_.Write("boxes.txt",
                  "0 box 0.9 275 220 80 45\n"       // is too small
                  "0.05 box 0.8 260 210 100 50\n"   // between two true poses
                  "0 cup 0.7 10 10 30 30\n"         // of no true object
                  "0.4 box 0.6 270 215 100 50\n");  // has no true pose
  }

  std::string BoxesWith(const std::string& options) const {
    const std::string output = (folder_.Path() / "true.txt").string();
    const std::string command = "python3 " SQSLAM_SOURCE_DIR "/scripts/true-boxes.py " +
                                folder_.Path().string() + " --output " + output + " " + options;
    return std::system(command.c_str()) == 0 ? ReadFile(output, "boxes") : "failed";
  }

  TemporaryFolder folder_;
};

TEST_F(TrueBoxesTest, ReplacesBoxesByProjections) {
  const std::string boxes = BoxesWith("");
  EXPECT_THAT(boxes, HasSubstr("\n0 box 0.9 270.00 215.00 100.00 50.00\n"));
  EXPECT_THAT(boxes, HasSubstr("\n0.05 box 0.8 265.00 215.00 100.00 50.00\n"))
      << "the camera has moved by 2 cm";
}

TEST_F(TrueBoxesTest, KeepsOtherBoxes) {
  const std::string boxes = BoxesWith("");
  EXPECT_THAT(boxes, HasSubstr("\n0 cup 0.7 10.00 10.00 30.00 30.00\n"));
  EXPECT_THAT(boxes, HasSubstr("\n0.4 box 0.6 270.00 215.00 100.00 50.00\n"));
}

TEST_F(TrueBoxesTest, OmitsOtherBoxesOnDemand) {
  const std::string boxes = BoxesWith("--only-true");
  EXPECT_THAT(boxes, HasSubstr("0 box 0.9 270.00"));
  EXPECT_THAT(boxes, Not(HasSubstr("cup")));
  EXPECT_THAT(boxes, Not(HasSubstr("0.4 box")));
}

TEST_F(TrueBoxesTest, RequiresOverlap) {
  EXPECT_THAT(BoxesWith("--min-iou 0.9"), HasSubstr("\n0 box 0.9 275.00"));
}

TEST_F(TrueBoxesTest, DistortsProjectionsLikeTheLens) {
  folder_.Write("camera.yaml",
                "width: 640\nheight: 480\nfx: 500\nfy: 500\ncx: 320\ncy: 240\nfps: 10\n"
                "distortion: [0.5, 0, 0, 0, 0]\n");
  // A corner at x = 0.1, y = 0.05 of the plane z = 1 moves outwards by 0.5 r^2 = 0.625 %.
  EXPECT_THAT(BoxesWith(""), HasSubstr("\n0 box 0.9 269.69 214.84 100.62 50.31\n"));
}

TEST_F(TrueBoxesTest, FailsWithoutGroundTruth) {
  std::filesystem::remove(folder_.Path() / "objects_gt.json");
  EXPECT_EQ(BoxesWith("2> /dev/null"), "failed");
}

}  // namespace
}  // namespace sqslam::testing
