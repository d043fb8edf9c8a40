#include "slam/util/text_lines.h"

#include <gtest/gtest.h>

#include "slam/util/error.h"
#include "slam/util/json_file.h"
#include "tests/io/temporary_folder.h"

namespace sqslam::testing {
namespace {

TEST(ValidText, KeepsWordsOfAllLanguages) {
  for (const char* text : {"cup", "чашка☕", "été", "𝛼", ""}) {
    EXPECT_EQ(ValidText(text), text);
  }
}

TEST(ValidText, ReplacesWhatIsNoCharacter) {
  const std::string mark = "\xef\xbf\xbd";
  EXPECT_EQ(ValidText("caf\xe9"), "caf" + mark);                     // Latin-1
  EXPECT_EQ(ValidText("\xe2\x98"), mark + mark);                     // cut off
  EXPECT_EQ(ValidText("\xc0\xaf"), mark + mark);                     // overlong
  EXPECT_EQ(ValidText("\xed\xa0\x80"), mark + mark + mark);          // a surrogate
  EXPECT_EQ(ValidText("\xf4\x90\x80\x80").size(), 4 * mark.size());  // beyond Unicode
  EXPECT_EQ(ValidText("a\x1b[31mb\n"), "a?[31mb?");
}

TEST(ShellLine, QuotesWhatAShellWouldTakeApart) {
  EXPECT_EQ(ShellLine({"sqslam", "--output=a/b.png", "two words", "", "it's", "$HOME"}),
            R"(sqslam --output=a/b.png 'two words' '' 'it'\''s' '$HOME')");
}

TEST(ParseNumber, TakesAtMostOneSign) {
  EXPECT_EQ(ParseNumber<int>("+5"), 5);
  EXPECT_EQ(ParseNumber<double>("-0.5"), -0.5);
  for (const char* text : {"+-5", "-+5", "++5", "--5", "+", ""}) {
    EXPECT_FALSE(ParseNumber<int>(text).has_value()) << text;
    EXPECT_FALSE(ParseNumber<double>(text).has_value()) << text;
  }
}

TEST(ClockText, HasNoMinuteOfSixtySeconds) {
  EXPECT_EQ(ClockText(0.0), "0:00.0");
  EXPECT_EQ(ClockText(59.94), "0:59.9");
  EXPECT_EQ(ClockText(59.97), "1:00.0");
  EXPECT_EQ(ClockText(3671.26), "61:11.3");
  EXPECT_EQ(ClockText(-2.0), "0:00.0");
}

TEST(JsonFile, SaysWhereItIsBroken) {
  const TemporaryFolder folder;
  const auto message = [&](const std::string& text) {
    try {
      ReadJsonFile(folder.Write("a.json", text), "a list");
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_TRUE(message("[1,\n2,,3]").ends_with("a.json:2: no valid JSON, expected a list"));
  EXPECT_TRUE(message("[1e400]").ends_with("a.json: a number is beyond all ranges, expected a list"));
  for (const char* huge :
       {"[3e9]", "[-8.5e30]", "[99999999999999999999999]"}) {  // whatever is asked for later
    EXPECT_TRUE(message(huge).ends_with("a.json: a number is beyond all ranges, expected a list")) << huge;
  }
  EXPECT_EQ(message("[1, 1305031102.17, 9007199254740993]"), "");
}

TEST(JsonFile, IsWrittenThoughATextIsNone) {
  const TemporaryFolder folder;
  const auto path = folder.Path() / "a.json";
  WriteJsonFile(path, nlohmann::ordered_json{{"label", "caf\xe9"}});
  EXPECT_EQ(ReadJsonFile(path, "labels").at("label"), "caf\xef\xbf\xbd");
}

}  // namespace
}  // namespace sqslam::testing
