#include "slam/util/data_path.h"

#include <gtest/gtest.h>

#include "slam/util/error.h"

namespace sqslam {
namespace {

TEST(DataPath, FindsFilesOfTheSourceTreeFromAPresetsBinFolder) {
  const std::filesystem::path expected =
      std::filesystem::path(SQSLAM_SOURCE_DIR) / "configs" / "default.yaml";
  EXPECT_TRUE(std::filesystem::equivalent(DataPath("configs/default.yaml"), expected));
}

TEST(DataPath, WhatIsNowhereIsReported) { EXPECT_THROW(DataPath("assets/no-such-file"), InputError); }

}  // namespace
}  // namespace sqslam
