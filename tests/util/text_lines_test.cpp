#include "slam/util/text_lines.h"

#include <gtest/gtest.h>

#include "slam/util/error.h"
#include "slam/util/json_file.h"
#include "slam/util/limits.h"
#include "tests/io/temporary_folder.h"

namespace sqslam::testing {
namespace {

TEST(ValidText, KeepsWordsOfAllLanguages) {
  for (const char* text : {"cup", "чашка☕", "été", "𝛼", ""}) {
    EXPECT_EQ(ValidText(text), text);
  }
}

TEST(ValidText, ReplacesInvalidBytes) {
  const std::string mark = "\xef\xbf\xbd";
  EXPECT_EQ(ValidText("caf\xe9"), "caf" + mark);                     // Latin-1
  EXPECT_EQ(ValidText("\xe2\x98"), mark);                            // cut off
  EXPECT_EQ(ValidText("\xc0\xaf"), mark + mark);                     // overlong
  EXPECT_EQ(ValidText("\xed\xa0\x80"), mark + mark + mark);          // a surrogate
  EXPECT_EQ(ValidText("\xf4\x90\x80\x80").size(), 4 * mark.size());  // beyond Unicode
  EXPECT_EQ(ValidText("a\x1b[31mb\n"), "a?[31mb?");
}

TEST(CutText, KeepsCharactersWhole) {
  EXPECT_EQ(CutText("été", 5), "été");
  EXPECT_EQ(CutText("été", 4), "ét");
  EXPECT_EQ(CutText("été", 3), "ét");
  EXPECT_EQ(CutText("été", 1), "");
  EXPECT_EQ(CutText("☕☕", 5), "☕");
}

TEST(ValidLabel, CutsBetweenCharacters) {
  const std::string letters(kMaxLabelBytes - 1, 'a');
  EXPECT_EQ(ValidLabel(letters + "b"), letters + "b");
  EXPECT_EQ(ValidLabel(letters + "é"), letters);
  EXPECT_EQ(ValidLabel(letters + "\xe9"), letters);
  EXPECT_EQ(ValidLabel("a\x1b\xe9"), "a?\xef\xbf\xbd");
}

TEST(ReplaceControls, KeepsLineEndsWhenAsked) {
  EXPECT_EQ(ReplaceControls("a: 1\r\nb\x1b[2J\n"), "a: 1??b?[2J?");
  EXPECT_EQ(ReplaceControlsInLines("a: 1\r\nb\x1b[2J\n"), "a: 1?\nb?[2J\n");
}

TEST(DecodedText, RemovesMarksAndConvertsUtf16) {
  using namespace std::string_literals;
  EXPECT_EQ(DecodedText("\xEF\xBB\xBF"
                        "a\r\nb\rc\n"),
            "a\nb\nc\n");
  EXPECT_EQ(DecodedText("\xFF\xFE"
                        "a\0\r\0\n\0\xe9\0=\xD8\0\xDE"s),
            "a\né\xF0\x9F\x98\x80");
  EXPECT_EQ(DecodedText("\xFE\xFF\0a\0b"s), "ab");
  EXPECT_EQ(DecodedText("1\0.\0005\0 \0"s), "1.5 ");  // without a mark
  EXPECT_EQ(DecodedText("\0001\0.\0005"s), "1.5");
  EXPECT_EQ(DecodedText("\xFF\xFE\0\xD8"s), "\xEF\xBF\xBD");  // half of a pair
  EXPECT_EQ(DecodedText("0 a 1\n"), "0 a 1\n");
}

TEST(VisibleText, ShowsInvisibleCharacters) {
  EXPECT_EQ(VisibleText("\xEF\xBB\xBF"
                        "0.5\tcup\xC2\xA0"
                        "é\x1b\xff☕"),
            "<U+FEFF>0.5\\tcup<U+00A0>é<U+001B><ff>☕");
}

TEST(ShellLine, QuotesWordsForShell) {
  EXPECT_EQ(ShellLine({"sqslam", "--output=a/b.png", "two words", "", "it's", "$HOME"}),
            R"(sqslam --output=a/b.png 'two words' '' 'it'\''s' '$HOME')");
}

TEST(ParseNumber, AcceptsAtMostOneSign) {
  EXPECT_EQ(ParseNumber<int>("+5"), 5);
  EXPECT_EQ(ParseNumber<double>("-0.5"), -0.5);
  for (const char* text : {"+-5", "-+5", "++5", "--5", "+", ""}) {
    EXPECT_FALSE(ParseNumber<int>(text).has_value()) << text;
    EXPECT_FALSE(ParseNumber<double>(text).has_value()) << text;
  }
}

TEST(ClockText, NeverShowsSixtySeconds) {
  EXPECT_EQ(ClockText(0.0), "0:00.0");
  EXPECT_EQ(ClockText(59.94), "0:59.9");
  EXPECT_EQ(ClockText(59.97), "1:00.0");
  EXPECT_EQ(ClockText(3671.26), "61:11.3");
  EXPECT_EQ(ClockText(-2.0), "0:00.0");
}

TEST(JsonFile, ReportsLineOfSyntaxError) {
  const TemporaryFolder folder;
  const auto message = [&](const std::string& text) {
    try {
      ReadJsonFile(folder.Write("a.json", text), "a list");
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_TRUE(message("[1,\n2,,3]").ends_with("a.json:2: invalid JSON, expected a list"));
  EXPECT_TRUE(message("[1e400]").ends_with("a.json: a number is out of range, expected a list"));
  for (const char* huge : {"[3e9]", "[-8.5e30]", "[99999999999999999999999]",
                           R"({"a": [1, {"b": 3e9}], "c": 2})"}) {  // whatever is asked for later
    EXPECT_TRUE(message(huge).ends_with("a.json: a number is out of range, expected a list")) << huge;
  }
  EXPECT_EQ(message("[1, 1305031102.17, 9007199254740993]"), "");
}

TEST(JsonFile, RefusesDeepNesting) {
  const TemporaryFolder folder;
  const auto read = [&](const std::string& text) { ReadJsonFile(folder.Write("a.json", text), "a list"); };
  const auto nested = [](std::size_t depth) { return std::string(depth, '[') + std::string(depth, ']'); };
  EXPECT_NO_THROW(read(nested(100)));
  const std::string message = InputErrorOf([&] { read("[1,\n" + nested(1'000'000) + "]"); });
  EXPECT_TRUE(message.ends_with("a.json:2: nested deeper than 100 levels, expected a list")) << message;
  std::string siblings = "[0";
  for (int i = 0; i < 200; ++i) {
    siblings += ", {\"a\": [1]}";
  }
  EXPECT_NO_THROW(read(siblings + "]"));
  const std::string brackets(200, '[');
  EXPECT_NO_THROW(read(R"({"a": "\")" + brackets + R"(\\", "b": ")" + brackets + "\"}"));
}

TEST(JsonFile, WritesInvalidUtf8AsReplacements) {
  const TemporaryFolder folder;
  const auto path = folder.Path() / "a.json";
  WriteJsonFile(path, nlohmann::ordered_json{{"label", "caf\xe9"}});
  EXPECT_EQ(ReadJsonFile(path, "labels").at("label"), "caf\xef\xbf\xbd");
}

}  // namespace
}  // namespace sqslam::testing
