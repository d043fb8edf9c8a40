#include "slam/run/result_folder.h"

#include <gtest/gtest.h>

#include <stdexcept>

#include "slam/util/error.h"

namespace sqslam {
namespace {

TEST(AttemptAll, GoesOnAfterAnyFailureAndThrowsTheFirst) {
  int done = 0;
  const auto count = [&] { ++done; };
  const auto full = [] { throw InputError("the disk is full"); };
  const auto blind = [] { throw std::runtime_error("no display"); };
  EXPECT_THROW(AttemptAll({count, full, count, blind, count}), InputError);
  EXPECT_EQ(done, 3);
  EXPECT_THROW(AttemptAll({blind, full, count}), std::runtime_error);
  EXPECT_EQ(done, 4);
  EXPECT_NO_THROW(AttemptAll({count}));
}

}  // namespace
}  // namespace sqslam
