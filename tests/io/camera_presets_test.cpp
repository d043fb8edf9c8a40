
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "slam/io/cameras.h"
#include "slam/util/error.h"
#include "tests/io/temporary_folder.h"

namespace sqslam {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsSupersetOf;

TEST(CameraPresets, CanAllBeRead) {
  const std::vector<std::string> names = CameraPresetNames();
  EXPECT_THAT(names, IsSupersetOf({"icl-nuim", "scenes-v2", "7-scenes", "tum-freiburg1", "tum-freiburg2",
                                   "tum-freiburg3", "kinect-v1"}));
  for (const std::string& name : names) {
    const Camera camera = ReadCamera(CameraFile(name));
    EXPECT_EQ(camera.width, 640) << name;
    EXPECT_EQ(camera.height, 480) << name;
    // The datasets' cameras all see 57 to 68 degrees wide, with the optical axis near the image's centre.
    EXPECT_NEAR(camera.fx, 525.0, 50.0) << name;
    EXPECT_NEAR(camera.fy, 525.0, 50.0) << name;
    EXPECT_NEAR(camera.cx, 320.0, 8.0) << name;
    EXPECT_NEAR(camera.cy, 240.0, 16.0) << name;
  }
}

TEST(CameraPresets, KeepsFilesAndPaths) {
  const TemporaryFolder folder;
  EXPECT_EQ(CameraFile("phone.yaml"), "phone.yaml");
  EXPECT_EQ(CameraFile("./phone"), "./phone");
  EXPECT_EQ(CameraFile("tum-freiburg1").filename(), "tum-freiburg1.yaml");
}

TEST(CameraPresets, ListsPresetsWhenNameIsUnknown) {
  try {
    CameraFile("tum-freiburg4");
    FAIL() << "expected a UsageError";
  } catch (const UsageError& e) {
    EXPECT_THAT(e.what(), AllOf(HasSubstr("did you mean 'tum-freiburg"), HasSubstr("7-scenes, icl-nuim, ")));
  }
}

}  // namespace
}  // namespace sqslam
