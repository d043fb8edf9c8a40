#include <gtest/gtest.h>

#include "slam/util/markup.h"

namespace sqslam {
namespace {

TEST(Fingerprint, MatchesPublishedVectors) {  // vectors of draft-eastlake-fnv, appendix C
  EXPECT_EQ(Fingerprint(""), "cbf29ce484222325");
  EXPECT_EQ(Fingerprint("a"), "af63dc4c8601ec8c");
  EXPECT_EQ(Fingerprint("foobar"), "85944171f73967e8");
}

TEST(Fingerprint, TreatsBytesAsUnsigned) {
  EXPECT_NE(Fingerprint("\xC3\xA4"), Fingerprint("\xC3\xA5"));
  EXPECT_EQ(Fingerprint("\xFF").size(), 16U);
}

}  // namespace
}  // namespace sqslam
