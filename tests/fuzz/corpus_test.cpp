// Replays what the fuzzers start from and every input in tests/fuzz/corpus that once made a reader fail.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "slam/util/text_lines.h"
#include "tests/fuzz/fuzz_targets.h"
#include "tests/io/temporary_folder.h"

namespace sqslam::testing {
namespace {

namespace fs = std::filesystem;

class FuzzCorpus : public ::testing::TestWithParam<FuzzTarget> {
 protected:
  TemporaryFolder folder_;
};

TEST_P(FuzzCorpus, AcceptsItsSeed) {
  const FuzzTarget& target = GetParam();
  EXPECT_EQ(ReadFuzzed(target, folder_.Path(), target.seed()), "");
}

// Cut anywhere, or with any byte changed, a file is accepted or refused with a line that names it.
TEST_P(FuzzCorpus, RefusesDamagedSeedsByName) {
  const FuzzTarget& target = GetParam();
  const std::string seed = target.seed();
  const std::size_t step = std::max<std::size_t>(1, seed.size() / 200);
  const auto expect_told = [&](const std::string& bytes) {
    const std::string error = ReadFuzzed(target, folder_.Path(), bytes);
    if (!error.empty() && target.name != "snapshot") {  // which knows no file
      EXPECT_THAT(error, ::testing::HasSubstr(folder_.Path().string()));
    }
    EXPECT_EQ(error.find('\n'), std::string::npos) << error;
  };
  for (std::size_t at = 0; at < seed.size(); at += step) {
    expect_told(seed.substr(0, at));
    std::string changed = seed;
    changed[at] = static_cast<char>(changed[at] ^ (1 << (at % 8)));
    expect_told(changed);
  }
}

TEST_P(FuzzCorpus, SurvivesFormerFailures) {
  const FuzzTarget& target = GetParam();
  const fs::path corpus = fs::path(SQSLAM_SOURCE_DIR) / "tests/fuzz/corpus" / target.name;
  std::error_code nothing_found_yet;
  for (const auto& entry : fs::directory_iterator(corpus, nothing_found_yet)) {
    SCOPED_TRACE(entry.path());
    EXPECT_NO_THROW(ReadFuzzed(target, folder_.Path(), ReadFile(entry.path(), "an input")));
  }
}

// Names the target where a test fails.
void PrintTo(const FuzzTarget& target, std::ostream* out) { *out << target.name; }

INSTANTIATE_TEST_SUITE_P(Targets, FuzzCorpus, ::testing::ValuesIn(FuzzTargets().begin(), FuzzTargets().end()),
                         [](const auto& info) { return std::string(info.param.name); });

}  // namespace
}  // namespace sqslam::testing
