#include "slam/run/warning_log.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spdlog/sinks/dist_sink.h>
#include <spdlog/spdlog.h>

namespace sqslam {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

TEST(WarningLog, RecordsEachWarningOnceWhileAlive) {
  const auto before = spdlog::default_logger();
  const auto sinks = std::make_shared<spdlog::sinks::dist_sink_mt>();
  spdlog::set_default_logger(std::make_shared<spdlog::logger>("test", sinks));
  {
    const WarningLog log;
    spdlog::info("news");
    spdlog::warn("the first");
    spdlog::warn("the {}", "second");
    spdlog::warn("the first");
    EXPECT_THAT(log.Lines(), ElementsAre("the first", "the second"));
  }
  EXPECT_THAT(sinks->sinks(), IsEmpty());
  spdlog::set_default_logger(before);
}

TEST(WarningLog, IgnoresDetachedLogs) {
  const WarningLog log;
  EXPECT_THAT(log.Lines(), IsEmpty());
}

}  // namespace
}  // namespace sqslam
