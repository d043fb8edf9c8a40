#include "slam/util/data_path.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "slam/util/error.h"

namespace sqslam {
namespace {

TEST(DataPath, FindsSourceTreeFromBuildFolder) {
  const std::filesystem::path expected =
      std::filesystem::path(SQSLAM_SOURCE_DIR) / "configs" / "default.yaml";
  EXPECT_TRUE(std::filesystem::equivalent(DataPath("configs/default.yaml"), expected));
}

TEST(DataPath, ReportsMissingFile) { EXPECT_THROW(DataPath("assets/no-such-file"), InputError); }

TEST(ConfigFileTest, FindsNamesAndFilesAndSuggestsNearest) {
  EXPECT_TRUE(
      std::filesystem::equivalent(ConfigFile("configs/styles", "style", "dark"),
                                  std::filesystem::path(SQSLAM_SOURCE_DIR) / "configs/styles/dark.yaml"));
  EXPECT_EQ(ConfigFile("configs/styles", "style", "my/own.yaml"), "my/own.yaml");
  try {
    ConfigFile("configs/styles", "style", "papre");
    FAIL();
  } catch (const UsageError& e) {
    EXPECT_THAT(e.what(),
                ::testing::AllOf(::testing::HasSubstr("style 'papre'"), ::testing::HasSubstr("mean 'paper'?"),
                                 ::testing::HasSubstr("blueprint, dark")));
  }
}

}  // namespace
}  // namespace sqslam
