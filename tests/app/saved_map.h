#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <memory>
#include <string>

#include "tests/app/run_program.h"
#include "tests/app/written_sequence.h"
#include "tests/support/textured_world.h"

namespace sqslam::testing {

inline constexpr int kWayFrames = 90;
inline constexpr int kWayMapped = 60;

// One map for all tests, which none of them may change.
class SavedMapCommands : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    sequence_ = std::make_unique<WrittenSequence>(HandHeldPath(kWayFrames));
    folder_ = std::make_unique<TemporaryFolder>();
    const ProgramRun run =
        RunProgram("run " + sequence_->Path().string() + " --no-render --deterministic " +
                   "--detector none --frames " + std::to_string(kWayMapped) + " -o " + Map());
    ASSERT_EQ(run.exit_code, 0) << run.err;
    recording_ = Slurp(std::filesystem::path(Map()) / "map.sqmap");
  }
  static void TearDownTestSuite() {
    EXPECT_EQ(Slurp(std::filesystem::path(Map()) / "map.sqmap"), recording_) << "a saved map was changed";
    sequence_.reset();
    folder_.reset();
  }
  static std::string Map() { return (folder_->Path() / "map").string(); }
  static std::filesystem::path Out(const std::string& name) { return folder_->Path() / name; }
  static std::string Input() { return sequence_->Path().string(); }
  static void ExpectRefused(const std::string& arguments, int exit_code, const std::string& message) {
    const ProgramRun run = RunProgram(arguments + " -o " + Out("refused").string());
    EXPECT_EQ(run.exit_code, exit_code) << run.err;
    EXPECT_THAT(run.ErrorLines(), ::testing::ElementsAre(::testing::HasSubstr(message)));
    EXPECT_FALSE(std::filesystem::exists(Out("refused")));
  }

  static inline std::unique_ptr<WrittenSequence> sequence_;
  static inline std::unique_ptr<TemporaryFolder> folder_;
  static inline std::string recording_;
};

}  // namespace sqslam::testing
