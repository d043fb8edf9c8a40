#include "slam/util/markup.h"

#include <gtest/gtest.h>

namespace sqslam {
namespace {

TEST(Markup, Base64MatchesStandard) {  // the examples of RFC 4648
  EXPECT_EQ(Base64(""), "");
  EXPECT_EQ(Base64("f"), "Zg==");
  EXPECT_EQ(Base64("fo"), "Zm8=");
  EXPECT_EQ(Base64("foo"), "Zm9v");
  EXPECT_EQ(Base64("foobar"), "Zm9vYmFy");
  EXPECT_EQ(Base64("\xff\xfe\xfd"), "//79");
}

TEST(Markup, EscapesTextForElementsAndAttributes) {
  EXPECT_EQ(EscapeMarkup("<a b=\"c\">&\n"), "&lt;a b=&quot;c&quot;&gt;&amp; ");
  EXPECT_EQ(EscapeMarkup("µ ε₁"), "µ ε₁");
  EXPECT_EQ(EscapeMarkup("<caf\xe9\x7f"), "&lt;caf\xef\xbf\xbd ");
}

}  // namespace
}  // namespace sqslam
