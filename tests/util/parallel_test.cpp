#include "slam/util/parallel.h"

#include <gtest/gtest.h>

#include <stdexcept>
#include <string>

namespace sqslam {
namespace {

TEST(ParallelFor, CallsEachNumberOnce) {
  for (const int threads : {0, 1, 3, 50}) {
    std::vector<int> calls(20);
    ParallelFor(calls.size(), threads, [&](std::size_t i) { ++calls[i]; });
    EXPECT_EQ(calls, std::vector<int>(20, 1));
  }
  ParallelFor(0, 4, [](std::size_t) { FAIL(); });
}

TEST(ParallelFor, RethrowsAndStopsWhenCallThrows) {
  std::atomic<int> calls = 0;
  try {
    ParallelFor(100000, 2, [&](std::size_t) {
      ++calls;
      throw std::runtime_error("broken");
    });
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_EQ(std::string(error.what()), "broken");
  }
  EXPECT_LE(calls, 2);
}

}  // namespace
}  // namespace sqslam
