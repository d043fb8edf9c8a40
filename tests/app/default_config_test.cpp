#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <string>

#include "slam/system_options.h"
#include "slam/util/options.h"

namespace sqslam {
namespace {

TEST(DefaultConfig, AgreesWithTheDefaultsInTheCode) {
  const std::string path = std::string(SQSLAM_SOURCE_DIR) + "/configs/default.yaml";
  std::ifstream file(path);
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  EXPECT_TRUE(text == DumpOptions(SystemOptions{}))
      << "bring it up to date: build/release/bin/sqslam run --dump-config > configs/default.yaml";
}

}  // namespace
}  // namespace sqslam
