#include "slam/evaluation/table.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <utility>

#include "slam/util/statistics.h"
#include "slam/util/text_lines.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace {

bool IsNumber(const Cell& cell) { return cell.decimals >= 0; }

bool HasRange(const Cell& cell) { return IsNumber(cell) && cell.spread.count > 1; }

std::string Fixed(double value, int decimals) {
  const std::string text = fmt::format("{:.{}f}", value, decimals);
  const bool is_zero = text.find_first_not_of("-0.") == std::string::npos;
  return is_zero && text.starts_with('-') ? text.substr(1) : text;  // no "-0.00"
}

// Columns of numbers are right-aligned, others left-aligned.
std::vector<bool> RightAligned(const Table& table) {
  std::vector<bool> right(table.columns.size(), false);
  for (const auto& row : table.rows) {
    for (std::size_t i = 0; i < right.size(); ++i) {
      right[i] = right[i] || IsNumber(row[i]);
    }
  }
  return right;
}

std::string Heading(const Table& table) {
  return table.name.empty() ? table.title : fmt::format("{}: {}", table.name, table.title);
}

// Formats a number with its range, or without one if all measurements agree.
std::string NumberText(const Cell& cell, const char* none, const char* plain, const char* with_range) {
  if (cell.spread.count == 0) {
    return none;
  }
  const std::string median = Fixed(cell.spread.median, cell.decimals);
  const std::string lowest = Fixed(cell.spread.lowest, cell.decimals);
  const std::string highest = Fixed(cell.spread.highest, cell.decimals);
  const bool wide = lowest != median || highest != median;  // otherwise the range adds nothing
  return fmt::format(fmt::runtime(wide ? with_range : plain), median, lowest, highest);
}

std::string LatexCell(const Cell& cell) {
  if (!IsNumber(cell)) {
    return EscapeLatex(cell.text);
  }
  return cell.best
             ? NumberText(cell, "--", "$\\mathbf{{{}}}$", "$\\mathbf{{{}}}$ {{\\scriptsize (${}$ to ${}$)}}")
             : NumberText(cell, "--", "${}$", "${}$ {{\\scriptsize (${}$ to ${}$)}}");
}

std::string MarkdownCell(const Cell& cell) {
  return IsNumber(cell) && cell.best ? NumberText(cell, "-", "**{}**", "**{}** ({} to {})")
                                     : EscapeMarkdown(FormatCell(cell));
}

std::string Significant(double value) { return fmt::format("{:.6g}", value); }

using Escapes = std::initializer_list<std::pair<char, std::string_view>>;

// Puts a backslash before the characters of `plain` and replaces others.
std::string Escaped(std::string_view text, std::string_view plain, Escapes escapes) {
  std::string escaped;
  for (const char c : text) {
    escaped += plain.find(c) != std::string_view::npos ? "\\" : "";
    const auto found = std::ranges::find_if(escapes, [c](const auto& escape) { return escape.first == c; });
    escaped += found != escapes.end() ? found->second : std::string_view(&c, 1);
  }
  return escaped;
}

}  // namespace

Spread SpreadOf(std::vector<double> values) {
  if (values.empty()) {
    return {};
  }
  const auto [lowest, highest] = std::ranges::minmax(values);
  return {static_cast<int>(values.size()), MeanMedian(std::move(values)), lowest, highest};
}

Cell Cell::Words(std::string text) { return {.text = std::move(text)}; }
Cell Cell::Number(double value, int decimals) {
  return {.text = "", .spread = {1, value, value, value}, .decimals = decimals};
}
Cell Cell::Of(const Spread& spread, int decimals) {
  return {.text = "", .spread = spread, .decimals = decimals};
}

void MarkBest(const std::vector<Cell*>& cells, BestValue best) {
  std::vector<std::pair<double, Cell*>> written;
  for (Cell* cell : cells) {
    if (IsNumber(*cell) && cell->spread.count > 0) {
      const double sign = best == BestValue::kHighest ? 1.0 : -1.0;
      const double unit = std::pow(10.0, cell->decimals);
      written.emplace_back(sign * std::round(unit * cell->spread.median) / unit, cell);
    }
  }
  if (written.empty()) {
    return;
  }
  const auto [low, high] = std::ranges::minmax(written, {}, &std::pair<double, Cell*>::first);
  for (const auto& [value, cell] : written) {
    cell->best = value == high.first && low.first < high.first;
  }
}

std::string FormatCell(const Cell& cell) {
  return IsNumber(cell) ? NumberText(cell, "-", "{}", "{} ({} to {})") : cell.text;
}

std::string ToText(const Table& table) {
  const std::vector<bool> right = RightAligned(table);
  std::vector<std::vector<std::string>> lines = {table.columns};
  for (const auto& row : table.rows) {
    lines.push_back(ToVector(row, FormatCell));
  }
  std::vector<std::size_t> widths(table.columns.size(), 0);
  for (const auto& line : lines) {
    for (std::size_t i = 0; i < line.size(); ++i) {
      widths[i] = std::max(widths[i], CountCharacters(line[i]));
    }
  }
  std::string text = Heading(table) + "\n";
  for (const auto& line : lines) {
    std::string row;
    for (std::size_t i = 0; i < line.size(); ++i) {
      const std::string padding(widths[i] - CountCharacters(line[i]), ' ');
      row += fmt::format("  {}{}{}", right[i] ? padding : "", line[i], right[i] ? "" : padding);
    }
    text += row.substr(0, row.find_last_not_of(' ') + 1) + "\n";
  }
  for (const std::string& note : table.notes) {
    text += "  " + note + "\n";
  }
  return text;
}

std::string ToMarkdown(const Table& table) {
  std::string text = fmt::format("## {}\n\n", EscapeMarkdown(Heading(table)));
  const auto add_row = [&text](const std::vector<std::string>& cells) {
    text += fmt::format("| {} |\n", fmt::join(cells, " | "));
  };
  add_row(ToVector(table.columns, EscapeMarkdown));
  add_row(
      ToVector(RightAligned(table), [](bool is_right) { return std::string(is_right ? "---:" : "---"); }));
  for (const auto& row : table.rows) {
    add_row(ToVector(row, MarkdownCell));
  }
  for (const std::string& note : table.notes) {
    text += fmt::format("\n{}\n", EscapeMarkdown(note));
  }
  return text;
}

std::string ToLatex(const Table& table) {
  std::string alignment;
  for (const bool is_right : RightAligned(table)) {
    alignment += is_right ? 'r' : 'l';
  }
  std::string text = fmt::format(
      "% needs \\usepackage{{booktabs}}\n\\begin{{table}}\n  \\centering\n  \\caption{{{}}}\n  "
      "\\begin{{tabular}}{{{}}}\n    \\toprule\n",
      EscapeLatex(table.title), alignment);
  text += fmt::format("    {} \\\\ \\midrule\n", fmt::join(ToVector(table.columns, EscapeLatex), " & "));
  for (const auto& row : table.rows) {
    text += fmt::format("    {} \\\\\n", fmt::join(ToVector(row, LatexCell), " & "));
  }
  text += "    \\bottomrule\n  \\end{tabular}\n";
  for (const std::string& note : table.notes) {
    text += fmt::format("  \\par\\footnotesize {}\n", EscapeLatex(note));
  }
  return text + "\\end{table}\n";
}

std::string ToCsv(const Table& table) {
  std::vector<bool> wide(table.columns.size(), false);
  for (const auto& row : table.rows) {
    for (std::size_t i = 0; i < wide.size(); ++i) {
      wide[i] = wide[i] || HasRange(row[i]);
    }
  }
  std::string text;
  const auto add_line = [&text](const std::vector<std::string>& cells) {
    text += fmt::format("{}\n", fmt::join(ToVector(cells, EscapeCsv), ","));
  };
  std::vector<std::string> line;
  for (std::size_t i = 0; i < wide.size(); ++i) {
    line.push_back(table.columns[i]);
    if (wide[i]) {
      line.push_back(table.columns[i] + " lowest");
      line.push_back(table.columns[i] + " highest");
    }
  }
  add_line(line);
  for (const auto& row : table.rows) {
    line.clear();
    for (std::size_t i = 0; i < wide.size(); ++i) {
      const Spread& spread = row[i].spread;
      const bool empty = !IsNumber(row[i]) || spread.count == 0;
      line.push_back(IsNumber(row[i]) ? (empty ? "" : Significant(spread.median)) : row[i].text);
      if (wide[i]) {
        line.push_back(empty ? "" : Significant(spread.lowest));
        line.push_back(empty ? "" : Significant(spread.highest));
      }
    }
    add_line(line);
  }
  return text;
}

std::string EscapeMarkdown(std::string_view text) { return Escaped(text, "|*_`<[\\", {{'\n', " "}}); }

std::string EscapeLatex(std::string_view text) {
  return Escaped(text, "&%$#_{}",
                 {{'~', "\\textasciitilde{}"},
                  {'^', "\\textasciicircum{}"},
                  {'\\', "\\textbackslash{}"},
                  {'<', "\\textless{}"},
                  {'>', "\\textgreater{}"},
                  {'\n', " "}});
}

std::string EscapeCsv(std::string_view text) {
  // Spreadsheets evaluate text that begins like a formula; an apostrophe makes it text.
  const std::size_t first = text.find_first_of("=@+-\t\r");
  const bool number = text.find_first_not_of("+-0123456789.,eE%() ") == std::string_view::npos;
  const std::string cell = fmt::format("{}{}", first == 0 && !number ? "'" : "", text);
  const bool plain = cell.find_first_of(",\"\r\n") == std::string::npos;
  return plain ? cell : fmt::format("\"{}\"", Escaped(cell, "", {{'"', "\"\""}}));
}

}  // namespace sqslam
