#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <memory>
#include <string>

#include "tests/io/temporary_folder.h"

namespace sqslam::testing {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

// Asks bash what it offers for the last word of a command line.
class CompletionTest : public ::testing::Test {
 protected:
  CompletionTest() {
    const std::string command = "python3 " SQSLAM_SOURCE_DIR "/scripts/make-completion.py " SQSLAM_PROGRAM
                                " " +
                                folder_.Path().string();
    written_ = std::system(command.c_str()) == 0;
  }

  std::string Offers(const std::string& words) const {
    const std::string command =
        "bash -c 'source " + folder_.Path().string() + "/bash-completion/completions/sqslam; COMP_WORDS=(" +
        words + "); COMP_CWORD=$((${#COMP_WORDS[@]} - 1)); _sqslam; echo \" ${COMPREPLY[*]} \"'";
    const std::unique_ptr<FILE, int (*)(FILE*)> pipe(popen(command.c_str(), "r"), pclose);
    std::string offers;
    std::array<char, 256> part{};
    while (std::fgets(part.data(), part.size(), pipe.get()) != nullptr) {
      offers += part.data();
    }
    return offers;
  }

  TemporaryFolder folder_;
  bool written_ = false;
};

TEST_F(CompletionTest, KnowsCommandsOptionsAndTheirWords) {
  ASSERT_TRUE(written_);
  EXPECT_THAT(Offers("sqslam re"), AllOf(HasSubstr(" render "), Not(HasSubstr(" run "))));
  EXPECT_THAT(Offers("sqslam run --assoc"), HasSubstr(" --association "));
  EXPECT_THAT(Offers("sqslam run --association \"\""), AllOf(HasSubstr(" full "), HasSubstr(" iou+ttest ")));
  EXPECT_THAT(Offers("sqslam figure \"\""), AllOf(HasSubstr(" yaw "), HasSubstr(" outliers ")));
  EXPECT_THAT(Offers("sqslam figure yaw --style \"\""), AllOf(HasSubstr(" paper "), HasSubstr(" dark ")));
}

}  // namespace
}  // namespace sqslam::testing
