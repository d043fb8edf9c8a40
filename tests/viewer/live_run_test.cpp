#include "app/viewer/frames/live_run.h"

#include <gtest/gtest.h>

#include <chrono>
#include <csignal>
#include <thread>

#include "tests/app/written_sequence.h"

namespace sqslam::viewer {
namespace {

// Polls until `done` is true of the news, for ten seconds at most.
LiveRun::News PollUntil(LiveRun& run, bool (*done)(const LiveRun::News&)) {
  LiveRun::News news = run.Poll();
  for (int i = 0; i < 1000 && !done(news); ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
    news = run.Poll();
  }
  return news;
}

TEST(LiveRunTest, EndsPausedRunOnCtrlC) {
  const auto sequence = testing::TinySequence();
  const TemporaryFolder folder;
  RunRequest request;
  request.options.detection.network = "none";
  request.sequence.path = sequence.Path();
  request.output = folder.Path() / "result";
  LiveRun run(request, {"", false});
  run.Control({RunControl::Command::kStep});
  run.Start();
  ASSERT_EQ(PollUntil(run, [](const auto& news) { return news.status.frames == 1; }).status.frames, 1);
  std::raise(SIGTERM);  // handled as Ctrl-C, and never ignored by a shell
  const LiveRun::News news = PollUntil(run, [](const auto& polled) { return polled.finished; });
  EXPECT_TRUE(news.finished);
  EXPECT_EQ(news.exit_code, 130);
  EXPECT_EQ(news.status.frames, 1);
}

}  // namespace
}  // namespace sqslam::viewer
