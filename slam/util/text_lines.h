#pragma once

#include <array>
#include <charconv>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

namespace sqslam {

// Parses the whole text as a number, with an optional plus sign; nothing for anything else.
template <typename Number>
std::optional<Number> ParseNumber(std::string_view text) {
  if (text.starts_with('+') && !text.starts_with("+-")) {
    text.remove_prefix(1);
  }
  Number number{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  return error == std::errc() && end == text.data() + text.size() ? std::optional(number) : std::nullopt;
}

// Replaces control characters by question marks, so that no file can send control sequences to the terminal.
std::string ReplaceControls(std::string_view text);

// Same for text of several lines, whose ends stay.
std::string ReplaceControlsInLines(std::string_view text);

// Returns the text as UTF-8 without control characters, with U+FFFD for each invalid
// sequence.
std::string ValidText(std::string_view text);

// Returns a part of a file for a message: control and invisible characters (byte-order marks, blanks of no
// width) stand as "<U+FEFF>", tabs as "\\t", bytes that are no UTF-8 as "<ff>".
std::string VisibleText(std::string_view text);

// Returns the start of UTF-8 text in at most `most` bytes, cut between two characters.
std::string CutText(std::string_view text, std::size_t most);

// Returns ValidText of a label or name, cut to kMaxLabelBytes.
std::string ValidLabel(std::string_view text);

// Returns the number of characters of UTF-8 text.
std::size_t CountCharacters(std::string_view text);

// Returns a line that a shell splits into these words.
std::string ShellLine(const std::vector<std::string>& words);

// Returns the parts between separators, without an empty last part.
std::vector<std::string> Split(const std::string& text, char separator);

// Returns a time as "0:12.5", minutes and seconds; negative times give 0.
std::string ClockText(double seconds);

// A line of a text file with data: not blank, no comment.
struct TextLine {
  int number = 0;  // 1-based
  std::string text;
  std::vector<std::string> words;  // separated by blanks or tabs
};

// Reads all data lines of a file (ReadText); '#' or, as CloudCompare writes it, '//' at the start of a line
// begins a comment. Throws InputError if the file cannot be read.
std::vector<TextLine> ReadTextLines(const std::filesystem::path& path, std::string_view expected);

// Same for text.
std::vector<TextLine> TextLinesIn(std::string_view text);

// Throws InputError "FILE:LINE: 'TEXT', expected EXPECTED".
[[noreturn]] void ThrowBadLine(const std::filesystem::path& path, const TextLine& line,
                               std::string_view expected);

// Returns the finite number in words[index]. Throws like ThrowBadLine otherwise.
double NumberAt(const std::filesystem::path& path, const TextLine& line, std::size_t index,
                std::string_view expected);

// Returns the finite numbers of a line with exactly `count` of them. Throws like ThrowBadLine otherwise.
template <std::size_t count>
std::array<double, count> NumbersIn(const std::filesystem::path& path, const TextLine& line,
                                    std::string_view expected) {
  std::array<double, count> numbers;
  if (line.words.size() != count) {
    ThrowBadLine(path, line, expected);
  }
  for (std::size_t i = 0; i < count; ++i) {
    numbers[i] = NumberAt(path, line, i, expected);
  }
  return numbers;
}

// Returns the whole file. Throws InputError "FILE: cannot be read (reason), expected EXPECTED".
std::string ReadFile(const std::filesystem::path& path, std::string_view expected);

// Returns the bytes of a text file as UTF-8 with LF at the ends of lines: without a byte-order mark,
// converted from UTF-16 (with a mark, or with a zero in each character of the first line), from CRLF and CR.
std::string DecodedText(std::string bytes);

// Returns the DecodedText() of a file. Throws like ReadFile().
std::string ReadText(const std::filesystem::path& path, std::string_view expected);

}  // namespace sqslam
