#include "slam/util/text_lines.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <sstream>

#include "slam/util/json_file.h"
#include "slam/util/limits.h"
#include "slam/util/throw_if.h"

namespace sqslam {
namespace fs = std::filesystem;

std::string ReadFile(const std::filesystem::path& path, std::string_view expected) {
  errno = 0;
  std::error_code none;
  std::ifstream file(path, std::ios::binary);
  // Pipes are allowed (`<(...)`), character devices are not: /dev/zero would never end.
  if (!file || fs::is_directory(path, none) || fs::is_character_file(path, none)) {
    throw InputError("{}: cannot be read ({}), expected {}", path.string(),
                     errno != 0 ? std::strerror(errno) : "not a file", expected);
  }
  ThrowIf<InputError>(fs::is_regular_file(path, none) && fs::file_size(path, none) > kMaxFileBytes,
                      "{}: larger than {} bytes, expected {}", path.string(), kMaxFileBytes, expected);
  return {std::istreambuf_iterator<char>(file), {}};
}

std::string ReplaceControls(std::string_view text) {
  std::string clean(text);
  std::ranges::replace_if(
      clean, [](unsigned char c) { return c < 0x20 || c == 0x7f; }, '?');
  return clean;
}

std::string ReplaceControlsInLines(std::string_view text) {
  std::string clean = ReplaceControls(text);
  std::ranges::transform(text, clean, clean.begin(),
                         [](char raw, char shown) { return raw == '\n' ? raw : shown; });
  return clean;
}

std::string ValidText(std::string_view text) {
  const std::string quoted = JsonText(text, -1);  // checks UTF-8
  return ReplaceControls(nlohmann::json::parse(quoted).get<std::string>());
}

std::string CutText(std::string_view text, std::size_t most) {
  std::size_t end = std::min(most, text.size());
  while (end > 0 && end < text.size() && (text[end] & 0xC0) == 0x80) {  // inside a character
    --end;
  }
  return std::string(text.substr(0, end));
}

std::string ValidLabel(std::string_view text) { return CutText(ValidText(text), kMaxLabelBytes); }

std::size_t CountCharacters(std::string_view text) {
  return static_cast<std::size_t>(std::ranges::count_if(text, [](char c) { return (c & 0xC0) != 0x80; }));
}

std::string ShellLine(const std::vector<std::string>& words) {
  const auto plain = [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 ||
           std::string_view("_-+./,:=@%").find(c) != std::string_view::npos;
  };
  std::string line;
  for (const std::string& word : words) {
    line += line.empty() ? "" : " ";
    if (!word.empty() && std::ranges::all_of(word, plain)) {
      line += word;
      continue;
    }
    line += '\'';
    for (const char c : word) {
      line += c == '\'' ? std::string("'\\''") : std::string(1, c);
    }
    line += '\'';
  }
  return line;
}

std::vector<std::string> Split(const std::string& text, char separator) {
  std::vector<std::string> parts;
  std::istringstream stream(text);
  for (std::string part; std::getline(stream, part, separator);) {
    parts.push_back(part);
  }
  return parts;
}

std::string ClockText(double seconds) {
  const long long tenths =
      std::llround(10.0 * std::max(0.0, seconds));  // rounded first: a minute never shows 60.0 s
  return fmt::format("{}:{:02}.{}", tenths / 600, tenths / 10 % 60, tenths % 10);
}

std::vector<TextLine> ReadTextLines(const std::filesystem::path& path, std::string_view expected) {
  return TextLinesIn(ReadFile(path, expected));
}

std::vector<TextLine> TextLinesIn(std::string_view text) {
  std::vector<TextLine> lines;
  for (int number = 1; !text.empty(); ++number) {
    const std::string_view whole = text.substr(0, text.find('\n'));
    text.remove_prefix(std::min(whole.size() + 1, text.size()));
    const std::size_t begin = whole.find_first_not_of(" \t\r");
    if (begin == std::string_view::npos || whole[begin] == '#') {
      continue;
    }
    const std::size_t end = whole.find_last_not_of(" \t\r") + 1;
    TextLine line{number, std::string(whole.substr(begin, end - begin)), {}};
    std::istringstream words(line.text);
    line.words.assign(std::istream_iterator<std::string>(words), {});
    lines.push_back(std::move(line));
  }
  return lines;
}

void ThrowBadLine(const std::filesystem::path& path, const TextLine& line, std::string_view expected) {
  constexpr std::size_t kMaxShown = 80;  // a binary file read as text must not flood the terminal
  const std::string shown =
      ReplaceControls(line.text.substr(0, kMaxShown)) + (line.text.size() > kMaxShown ? "..." : "");
  throw InputError("{}:{}: '{}', expected {}", path.string(), line.number, shown, expected);
}

double NumberAt(const std::filesystem::path& path, const TextLine& line, std::size_t index,
                std::string_view expected) {
  const auto number =
      index < line.words.size() ? ParseNumber<double>(line.words[index]) : std::optional<double>();
  if (!number || !std::isfinite(*number)) {
    ThrowBadLine(path, line, expected);
  }
  return *number;
}

}  // namespace sqslam
