#include "app/terminal/terminal.h"

#include <gtest/gtest.h>

#include <csignal>

#include "slam/util/error.h"
#include "tests/io/temporary_folder.h"

namespace sqslam::app {
namespace {

TEST(RunChild, ALostExitCodeIsAnError) {
  const TemporaryFolder folder;
  const auto never = [] { return false; };
  std::signal(SIGCHLD, SIG_IGN);  // the system then reaps children itself
  EXPECT_THROW(RunChild({}, folder.Path() / "log", never, "/bin/true"), InputError);
  std::signal(SIGCHLD, SIG_DFL);
  EXPECT_EQ(RunChild({}, folder.Path() / "log", never, "/bin/false").exit_code, 1);
}

TEST(DurationText, HasHoursOnlyIfThereAreAny) {
  EXPECT_EQ(DurationText(31.6), "0:32");
  EXPECT_EQ(DurationText(3599.6), "1:00:00");
}

}  // namespace
}  // namespace sqslam::app
