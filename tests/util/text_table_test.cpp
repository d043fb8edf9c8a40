#include "slam/util/text_table.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace sqslam {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using Row = std::vector<std::string>;

std::vector<Row> RowsOf(const TextTable& table) {
  std::vector<Row> rows;
  for (const TextLine& row : table.rows) {
    rows.push_back(row.words);
  }
  return rows;
}

TEST(CellsOf, KeepsSeparatorsInQuotes) {
  EXPECT_THAT(CellsOf(R"(0, "cup, small" ,"say ""hi""",)", ','),
              ElementsAre("0", "cup, small", "say \"hi\"", ""));
  EXPECT_THAT(CellsOf(R"( 0.5 "tea pot"	1 )", ' '), ElementsAre("0.5", "tea pot", "1"));
  EXPECT_THAT(CellsOf(",", ','), ElementsAre("", ""));
  EXPECT_THAT(CellsOf("\"open, 1", ','), ElementsAre("open, 1"));
  EXPECT_THAT(CellsOf("", ','), IsEmpty());
}

TEST(CellsOf, ReadsDecimalCommasBetweenSemicolons) {
  EXPECT_THAT(CellsOf("1,5;a,b;-2,25e3;1.000,5", ';'), ElementsAre("1.5", "a,b", "-2.25e3", "1.000,5"));
}

TEST(TableIn, SeparatesAsFirstRowDoes) {
  EXPECT_THAT(RowsOf(TableIn("1, 2\n3,4 5\n6 7\n")),
              ElementsAre(Row{"1", "2"}, Row{"3", "4 5"}, Row{"6", "7"}));
  EXPECT_THAT(RowsOf(TableIn("1 2\t3\n")), ElementsAre(Row{"1", "2", "3"}));
  EXPECT_THAT(RowsOf(TableIn("1\ttea pot\t3\n")), ElementsAre(Row{"1", "tea pot", "3"}));
}

TEST(TableIn, SkipsLinesOfBlanks) {
  EXPECT_THAT(RowsOf(TableIn("\f\n \t\v\r\n1 2\n")), ElementsAre(Row{"1", "2"}));
}

TEST(TableIn, FindsNamesOfColumns) {
  EXPECT_THAT(TableIn(",Frame,X_min\n0,1,2\n").names, ElementsAre("", "frame", "x_min"));
  EXPECT_THAT(TableIn("# by a tracker\n# time x\n0 1\n").names, ElementsAre("time", "x"));
  EXPECT_THAT(TableIn("//X Y Z\n0 1 2\n").names, ElementsAre("x", "y", "z"));
  EXPECT_THAT(TableIn("# a comment of words\n0 1\n").names, IsEmpty());
  EXPECT_THAT(TableIn("nan inf\n0 1\n").names, IsEmpty());
  EXPECT_THAT(TableIn("rgb/0.png 0.5\n").names, IsEmpty());
  EXPECT_EQ(TableIn("a,b\n1,2\n").rows.front().number, 2);
}

}  // namespace
}  // namespace sqslam
