#pragma once

#include <charconv>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

namespace sqslam {

// The number that the whole text is, with or without a plus before it; empty for anything else.
template <typename Number>
std::optional<Number> ParseNumber(std::string_view text) {
  text.remove_prefix(text.starts_with('+') ? 1 : 0);
  Number number{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  return error == std::errc() && end == text.data() + text.size() ? std::optional(number) : std::nullopt;
}

// The text without control characters: a question mark in the place of each, so that no file writes to the
// terminal more than words.
std::string WithoutControls(std::string_view text);

// The text as UTF-8 without control characters; U+FFFD in the place of each byte that belongs to no
// character.
std::string ValidText(std::string_view text);

// The words as one line that a shell takes apart into the same words again.
std::string ShellLine(const std::vector<std::string>& words);

// A time as "0:12.5", minutes and seconds; below 0 as 0.
std::string ClockText(double seconds);

// One line of a text file that carries data: not blank, no comment.
struct TextLine {
  int number = 0;  // 1-based
  std::string text;
  std::vector<std::string> words;  // separated by blanks or tabs
};

// All data lines; '#' starts a comment at the start of a line, ends of line may be CRLF. Throws InputError
// where the file cannot be read.
std::vector<TextLine> ReadTextLines(const std::filesystem::path& path, std::string_view expected);

// Throws InputError "FILE:LINE: 'TEXT', expected EXPECTED".
[[noreturn]] void ThrowBadLine(const std::filesystem::path& path, const TextLine& line,
                               std::string_view expected);

// The finite number in words[index]; throws as ThrowBadLine where there is none.
double NumberAt(const std::filesystem::path& path, const TextLine& line, std::size_t index,
                std::string_view expected);

// The whole file as a string; throws InputError "FILE: cannot be read (reason), expected EXPECTED".
std::string ReadFile(const std::filesystem::path& path, std::string_view expected);

}  // namespace sqslam
