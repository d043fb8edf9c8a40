#include "slam/util/text_table.h"

#include <algorithm>
#include <cctype>
#include <cstddef>

namespace sqslam {
namespace {

constexpr std::string_view kBlanks = " \t";
constexpr char kBlank = ' ';

std::string_view Trimmed(std::string_view text) {
  const std::size_t begin = std::min(text.find_first_not_of(" \t\r"), text.size());
  const std::size_t end = text.find_last_not_of(" \t\r");
  return end == std::string_view::npos ? std::string_view() : text.substr(begin, end + 1 - begin);
}

// Returns the number of these characters outside of quotes.
std::size_t CountOutsideQuotes(std::string_view line, char character) {
  bool quoted = false;
  std::size_t count = 0;
  for (const char c : line) {
    quoted = quoted != (c == '"');
    count += !quoted && c == character ? 1 : 0;
  }
  return count;
}

// Removes the first cell of the text, with its separator, and returns it.
std::string TakeCell(std::string_view& text, char separator) {
  const auto ends = [&](char c) {
    return separator == kBlank ? kBlanks.find(c) != kBlanks.npos : c == separator;
  };
  std::string cell;
  const std::size_t first = std::min(text.find_first_not_of(kBlanks), text.size());
  bool quoted = first < text.size() && text[first] == '"';
  std::size_t i = quoted ? first + 1 : 0;
  for (; i < text.size() && (quoted || !ends(text[i])); ++i) {
    if (!quoted || text[i] != '"') {
      cell += text[i];
    } else if (i + 1 < text.size() && text[i + 1] == '"') {
      cell += text[++i];
    } else {
      quoted = false;
    }
  }
  text.remove_prefix(std::min(i + 1, text.size()));
  return std::string(Trimmed(cell));
}

// Replaces the decimal comma of a number.
void UsePoint(std::string& cell) {
  const std::size_t comma = cell.find(',');
  if (comma != std::string::npos && cell.find('.') == std::string::npos) {
    std::string number = cell;
    number[comma] = '.';
    cell = ParseNumber<double>(number) ? number : cell;
  }
}

bool IsName(const std::string& cell) {
  const auto first = static_cast<unsigned char>(cell.empty() ? 'a' : cell[0]);
  return (std::isalpha(first) != 0 || first == '_' || first >= 0x80) && !ParseNumber<double>(cell);
}

std::vector<std::string> InLowerCase(std::vector<std::string> cells) {
  for (std::string& cell : cells) {
    std::ranges::transform(cell, cell.begin(),
                           [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  }
  return cells;
}

// Returns the last comment line among those before the first data line, without its '#'; empty if there is
// none.
std::string_view CommentBefore(std::string_view text) {
  std::string_view comment;
  while (!text.empty()) {
    const std::string_view line = text.substr(0, text.find('\n'));
    text.remove_prefix(std::min(line.size() + 1, text.size()));
    const std::string_view trimmed = Trimmed(line);
    const std::size_t mark = trimmed.starts_with("//") ? 2 : trimmed.starts_with('#') ? 1 : 0;
    if (!trimmed.empty() && mark == 0) {
      break;
    }
    comment = trimmed.empty() ? comment : trimmed.substr(mark);
  }
  return comment;
}

}  // namespace

char SeparatorOf(std::string_view line) {
  for (const char separator : {';', ','}) {
    if (CountOutsideQuotes(line, separator) > 0) {
      return separator;
    }
  }
  return CountOutsideQuotes(line, '\t') > 1 ? '\t' : kBlank;
}

std::vector<std::string> CellsOf(std::string_view line, char separator) {
  std::vector<std::string> cells;
  for (line = Trimmed(line); !line.empty();) {
    const bool ends_open = separator != kBlank && line.back() == separator;
    cells.push_back(TakeCell(line, separator));
    if (separator == kBlank) {
      line = Trimmed(line);
    } else if (line.empty() && ends_open) {
      cells.emplace_back();  // behind the last separator
    }
  }
  if (separator == ';' || separator == '\t') {
    std::ranges::for_each(cells, UsePoint);
  }
  return cells;
}

TextTable TableIn(std::string_view text) {
  TextTable table;
  table.rows = TextLinesIn(text);
  if (table.rows.empty()) {
    return table;
  }
  const char separator = SeparatorOf(table.rows.front().text);
  for (TextLine& row : table.rows) {
    row.words = CellsOf(row.text, separator);
    if (row.words.size() == 1) {
      row.words = CellsOf(row.text, SeparatorOf(row.text));
    }
  }
  const std::vector<std::string>& first = table.rows.front().words;
  if (first.size() > 1 && std::ranges::all_of(first, IsName)) {
    table.names = InLowerCase(first);
    table.rows.erase(table.rows.begin());
    return table;
  }
  const std::string_view comment = CommentBefore(text);
  std::vector<std::string> names = CellsOf(comment, SeparatorOf(comment));
  if (names.size() == first.size() && std::ranges::all_of(names, IsName)) {
    table.names = InLowerCase(std::move(names));
  }
  return table;
}

TextTable ReadTextTable(const std::filesystem::path& path, std::string_view expected) {
  return TableIn(ReadText(path, expected));
}

}  // namespace sqslam
