#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "slam/util/text_lines.h"

namespace sqslam {

// Cells of a text file, as programs and spreadsheets write them.
struct TextTable {
  std::vector<std::string> names;  // of the columns, in lower case; empty if no line names them
  std::vector<TextLine> rows;      // with their cells as words
};

// Returns what separates the cells of a line, in this order: semicolons, commas, tabs (at least two), each
// outside of quotes, or blanks, which stands for blanks and tabs.
char SeparatorOf(std::string_view line);

// Returns the cells of a line without the blanks and quotes around them ("" in quotes is a quote). Between
// semicolons and tabs, a number may have a decimal comma; the cell has a point.
std::vector<std::string> CellsOf(std::string_view line, char separator);

// Returns the cells of all data lines of a text (ReadText), separated as in the first one, or else in their
// own way. The first line names the columns if each of its cells begins with a letter or is empty; else the
// comment line before it does, if it has as many words as that line has cells.
TextTable TableIn(std::string_view text);

// Same for a file. Throws InputError if it cannot be read.
TextTable ReadTextTable(const std::filesystem::path& path, std::string_view expected);

}  // namespace sqslam
