#include "slam/util/text_lines.h"

#include <fmt/format.h>

#include <cerrno>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <sstream>

#include "slam/util/error.h"

namespace sqslam {

std::string ReadFile(const std::filesystem::path& path, std::string_view expected) {
  errno = 0;
  std::ifstream file(path, std::ios::binary);
  if (!file || std::filesystem::is_directory(path)) {
    throw InputError(fmt::format("{}: cannot be read ({}), expected {}", path.string(),
                                 errno != 0 ? std::strerror(errno) : "not a file", expected));
  }
  return {std::istreambuf_iterator<char>(file), {}};
}

std::vector<TextLine> ReadTextLines(const std::filesystem::path& path, std::string_view expected) {
  std::istringstream stream(ReadFile(path, expected));
  std::vector<TextLine> lines;
  int number = 0;
  for (std::string text; std::getline(stream, text);) {
    ++number;
    const std::size_t begin = text.find_first_not_of(" \t\r");
    if (begin == std::string::npos || text[begin] == '#') {
      continue;
    }
    TextLine line{number, text.substr(begin, text.find_last_not_of(" \t\r") + 1 - begin), {}};
    std::istringstream words(line.text);
    line.words.assign(std::istream_iterator<std::string>(words), {});
    lines.push_back(std::move(line));
  }
  return lines;
}

void ThrowBadLine(const std::filesystem::path& path, const TextLine& line, std::string_view expected) {
  constexpr std::size_t kShown = 80;  // a binary file taken for text must not flood the terminal
  std::string shown = line.text.substr(0, kShown) + (line.text.size() > kShown ? "..." : "");
  for (char& c : shown) {
    c = static_cast<unsigned char>(c) < 0x20 ? '?' : c;
  }
  throw InputError(fmt::format("{}:{}: '{}', expected {}", path.string(), line.number, shown, expected));
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
