#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace sqslam {

// Median and range of some measurements.
struct Spread {
  int count = 0;  // measurements; 0: the rest is undefined
  double median = 0.0;
  double lowest = 0.0;
  double highest = 0.0;
};

// The median of an even number of values is the mean of the middle two.
Spread SpreadOf(std::vector<double> values);

// One cell: text, or a measured number with its spread.
struct Cell {
  std::string text;
  Spread spread{};
  int decimals = -1;  // digits of the number after the point; below 0: the cell is text
  bool best = false;  // the median is set in bold in Markdown and LaTeX

  static Cell Words(std::string text);
  static Cell Number(double value, int decimals);  // one measurement
  static Cell Of(const Spread& spread, int decimals);
};

// A table that can be written in several formats. Rows are as long as `columns`.
struct Table {
  std::string name;   // "Table I"; may be empty
  std::string title;  // its content in a few words
  std::vector<std::string> columns;
  std::vector<std::vector<Cell>> rows;
  std::vector<std::string> notes;  // one sentence each, under the table
};

// Marks the cells whose medians, as written, are the best of those given. No cell is marked if all are equal
// or fewer than two hold a number. Cells of one row or column, for instance.
enum class BestValue { kHighest, kLowest };
void MarkBest(const std::vector<Cell*>& cells, BestValue best);

// "0.62", "0.62 (0.60 to 0.65)" if several measurements differ, "-" if there are none.
std::string FormatCell(const Cell& cell);

std::string ToText(const Table& table);      // for the terminal, columns aligned
std::string ToMarkdown(const Table& table);  // heading, table, notes
std::string ToLatex(const Table& table);     // a table environment that needs booktabs
// One header line; a column that holds any number with a spread becomes three: NAME, NAME lowest, NAME
// highest. RFC 4180: quotes where needed. Numbers with six significant digits, empty if there are none.
std::string ToCsv(const Table& table);

// Escape characters with a special meaning in the format.
std::string EscapeMarkdown(std::string_view text);
std::string EscapeLatex(std::string_view text);
std::string EscapeCsv(std::string_view text);

}  // namespace sqslam
