#include "app/terminal/terminal.h"

#include <glog/logging.h>
#include <gtest/gtest.h>
#include <pty.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <thread>

#include "slam/util/error.h"
#include "tests/io/temporary_folder.h"

namespace sqslam::app {
namespace {

TEST(RunChild, ReportsLostExitCode) {
  const TemporaryFolder folder;
  const auto never = [] { return false; };
  std::signal(SIGCHLD, SIG_IGN);  // the system then reaps children itself
  EXPECT_THROW(RunChild({}, folder.Path() / "log", never, "/bin/true"), InputError);
  std::signal(SIGCHLD, SIG_DFL);
  EXPECT_EQ(RunChild({}, folder.Path() / "log", never, "/bin/false").exit_code, 1);
}

TEST(RunProgram, SilencesSolverWarnings) {
  ::testing::internal::CaptureStderr();
  RunProgram("test", [] {
    LOG(WARNING) << "Linear solver failure. Failed to compute a step.";  // as Ceres does
    return 0;
  });
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
}

// Makes stderr a terminal that can be closed.
class Terminal {
 public:
  Terminal() {
    EXPECT_EQ(openpty(&screen_, &keyboard_, nullptr, nullptr, nullptr), 0);
    dup2(keyboard_, STDERR_FILENO);
  }
  ~Terminal() {
    dup2(before_, STDERR_FILENO);
    ::close(before_);
    ::close(keyboard_);
  }
  void Close() { ::close(screen_); }

 private:
  int before_ = dup(STDERR_FILENO);
  int screen_ = -1;
  int keyboard_ = -1;
};

TEST(Progress, ContinuesWhenTerminalIsClosed) {
  Terminal terminal;
  {
    Progress progress(false);
    const auto update = [&](int done) {
      std::this_thread::sleep_for(std::chrono::milliseconds(250));  // longer than between two lines
      progress.Update(done, 100);
    };
    progress.Update(0, 100);
    update(1);
    terminal.Close();
    errno = 0;
    EXPECT_NO_THROW(update(2));
    EXPECT_EQ(errno, EIO);
    EXPECT_NO_THROW(PrintNotice("stopped"));
  }
}

TEST(InterruptGuard, IgnoresClosedPipe) {
  int ends[2];
  ASSERT_EQ(pipe(ends), 0);
  ::close(ends[0]);
  {
    const InterruptGuard guard;
    EXPECT_EQ(write(ends[1], "x", 1), -1);
  }
  EXPECT_EXIT(write(ends[1], "x", 1) == 1 ? void() : void(), ::testing::KilledBySignal(SIGPIPE), "");
  ::close(ends[1]);
}

TEST(DurationText, ShowsHoursOnlyWhenNeeded) {
  EXPECT_EQ(DurationText(31.6), "0:32");
  EXPECT_EQ(DurationText(3599.6), "1:00:00");
}

}  // namespace
}  // namespace sqslam::app
