#include "slam/util/worker_thread.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <stdexcept>
#include <vector>

namespace sqslam {
namespace {

TEST(WorkerThread, DoesAllJobsInOrder) {
  std::vector<int> done;
  WorkerThread<int> worker(3, [&done](int job) { done.push_back(job); });
  for (int i = 0; i < 50; ++i) {
    worker.Add(i);
  }
  worker.Finish();
  ASSERT_EQ(done.size(), 50u);
  EXPECT_TRUE(std::is_sorted(done.begin(), done.end()));
}

TEST(WorkerThread, CompletesWaitingJobsWhenDestroyed) {
  std::atomic<int> done = 0;
  {
    WorkerThread<int> worker(10, [&done](int) { ++done; });
    for (int i = 0; i < 10; ++i) {
      worker.Add(i);
    }
  }
  EXPECT_EQ(done, 10);
}

TEST(WorkerThread, RethrowsErrorToCaller) {
  std::atomic<int> done = 0;
  WorkerThread<int> worker(1, [&done](int job) {
    if (job == 2) {
      throw std::runtime_error("disk full");
    }
    ++done;
  });
  while (worker.Offer(done < 2 ? 1 : 2)) {
  }
  EXPECT_TRUE(worker.Failed());
  EXPECT_FALSE(worker.Offer(1));
  EXPECT_THROW(worker.Add(1), std::runtime_error);
  EXPECT_THROW(worker.Finish(), std::runtime_error);
  EXPECT_GE(done, 2);
}

}  // namespace
}  // namespace sqslam
