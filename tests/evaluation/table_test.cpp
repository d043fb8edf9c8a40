#include "slam/evaluation/table.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace sqslam {
namespace {

using testing::HasSubstr;

TEST(SpreadOf, TakesMiddleValueOfOddCount) {
  const Spread spread = SpreadOf({5.0, 1.0, 3.0});
  EXPECT_EQ(spread.count, 3);
  EXPECT_DOUBLE_EQ(spread.median, 3.0);
  EXPECT_DOUBLE_EQ(spread.lowest, 1.0);
  EXPECT_DOUBLE_EQ(spread.highest, 5.0);
}

TEST(SpreadOf, AveragesMiddleValuesOfEvenCount) {
  EXPECT_DOUBLE_EQ(SpreadOf({10.0, 1.0, 2.0, 4.0}).median, 3.0);
}

TEST(SpreadOf, ReportsEmptyInput) {
  EXPECT_EQ(SpreadOf({}).count, 0);
  EXPECT_EQ(FormatCell(Cell::Of(SpreadOf({}), 2)), "-");
}

TEST(FormatCell, ShowsRangeOnlyWhenValuesDiffer) {
  EXPECT_EQ(FormatCell(Cell::Of(SpreadOf({0.60, 0.62, 0.65}), 2)), "0.62 (0.60 to 0.65)");
  EXPECT_EQ(FormatCell(Cell::Of(SpreadOf({0.621, 0.622, 0.623}), 2)), "0.62");
  EXPECT_EQ(FormatCell(Cell::Number(0.5, 3)), "0.500");
  EXPECT_EQ(FormatCell(Cell::Number(-0.0001, 2)), "0.00");
}

TEST(Escapes, EscapesSpecialCharacters) {
  EXPECT_EQ(EscapeMarkdown("a|b_c*d`e\\f"), "a\\|b\\_c\\*d\\`e\\\\f");
  EXPECT_EQ(EscapeLatex("50 % & $x_1^2$ {#} ~\\"),
            "50 \\% \\& \\$x\\_1\\textasciicircum{}2\\$ \\{\\#\\} \\textasciitilde{}\\textbackslash{}");
  EXPECT_EQ(EscapeCsv("plain"), "plain");
  EXPECT_EQ(EscapeCsv("-0.5 (1e-3)"), "-0.5 (1e-3)");
  EXPECT_EQ(EscapeCsv("=HYPERLINK(1)"), "'=HYPERLINK(1)");
  EXPECT_EQ(EscapeCsv("-2+3+cmd|' /C calc'!A0"), "'-2+3+cmd|' /C calc'!A0");
  EXPECT_EQ(EscapeCsv("a,\"b\""), "\"a,\"\"b\"\"\"");
}

Table Example() {
  return {"Table I",
          "IoU by class",
          {"class", "iou_a", "n"},
          {{Cell::Words("tea_pot"), Cell::Of(SpreadOf({0.5, 0.25, 0.75}), 2), Cell::Number(3, 0)},
           {Cell::Words("cup"), Cell::Of({}, 2), Cell::Number(12, 0)}},
          {"A note."}};
}

TEST(Tables, SetsBestValuesInBold) {
  Table table{"", "IoU", {"class", "full", "iou", "none"}, {}, {}};
  table.rows = {{Cell::Words("cup"), Cell::Number(0.614, 2), Cell::Of(SpreadOf({0.60, 0.62, 0.65}), 2),
                 Cell::Number(0.5, 2)},
                {Cell::Words("book"), Cell::Number(3.0, 0), Cell::Number(3.0, 0), Cell::Of({}, 0)},
                {Cell::Words("bowl"), Cell::Number(2.0, 0), Cell::Number(2.0, 0), Cell::Number(5.0, 0)}};
  for (auto& row : table.rows) {
    const bool lowest = &row == &table.rows[2];
    MarkBest({&row[0], &row[1], &row[2], &row[3]}, lowest ? BestValue::kLowest : BestValue::kHighest);
  }
  const std::string markdown = ToMarkdown(table);
  EXPECT_THAT(markdown, HasSubstr("| cup | 0.61 | **0.62** (0.60 to 0.65) | 0.50 |"));
  EXPECT_THAT(markdown, HasSubstr("| book | 3 | 3 | - |")) << "all are equal";
  EXPECT_THAT(markdown, HasSubstr("| bowl | **2** | **2** | 5 |")) << "ties";
  const std::string latex = ToLatex(table);
  EXPECT_THAT(latex, HasSubstr("cup & $0.61$ & $\\mathbf{0.62}$ {\\scriptsize ($0.60$ to $0.65$)} & $0.50$"));
  EXPECT_THAT(latex, HasSubstr("book & $3$ & $3$ & --"));
}

TEST(Tables, AlignsNumbersRightInMarkdown) {
  EXPECT_EQ(ToMarkdown(Example()),
            "## Table I: IoU by class\n\n| class | iou\\_a | n |\n| --- | ---: | ---: |\n"
            "| tea\\_pot | 0.50 (0.25 to 0.75) | 3 |\n| cup | - | 12 |\n\nA note.\n");
}

TEST(Tables, WritesBooktabsInLatex) {
  const std::string latex = ToLatex(Example());
  EXPECT_THAT(latex,
              HasSubstr("\\begin{tabular}{lrr}\n    \\toprule\n    class & iou\\_a & n \\\\ \\midrule\n"));
  EXPECT_THAT(latex, HasSubstr("tea\\_pot & $0.50$ {\\scriptsize ($0.25$ to $0.75$)} & $3$ \\\\\n"));
  EXPECT_THAT(latex, HasSubstr("cup & -- & $12$ \\\\\n    \\bottomrule\n"));
  EXPECT_THAT(latex, HasSubstr("\\caption{IoU by class}"));
}

TEST(Tables, WritesSpreadAsThreeCsvColumns) {
  EXPECT_EQ(ToCsv(Example()),
            "class,iou_a,iou_a lowest,iou_a highest,n\ntea_pot,0.5,0.25,0.75,3\ncup,,,,12\n");
}

TEST(Tables, AlignsTextByCharacters) {
  Table table{"",
              "T",
              {"a", "b"},
              {{Cell::Words("°°"), Cell::Words("x")}, {Cell::Words("abc"), Cell::Words("y")}},
              {}};
  EXPECT_EQ(ToText(table), "T\n  a    b\n  °°   x\n  abc  y\n");
}

}  // namespace
}  // namespace sqslam
