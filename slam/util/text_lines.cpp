#include "slam/util/text_lines.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <cmath>
#include <cstdint>
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

namespace {

// Appends a character of Unicode as UTF-8; U+FFFD for none.
void AppendUtf8(char32_t character, std::string& text) {
  const bool valid = character < 0xD800 || (character > 0xDFFF && character < 0x110000);
  const char32_t c = valid ? character : 0xFFFD;
  const auto tail = [&](int shift) { text += static_cast<char>(0x80 | ((c >> shift) & 0x3F)); };
  if (c < 0x80) {
    text += static_cast<char>(c);
  } else if (c < 0x800) {
    text += static_cast<char>(0xC0 | (c >> 6));
    tail(0);
  } else if (c < 0x10000) {
    text += static_cast<char>(0xE0 | (c >> 12));
    tail(6);
    tail(0);
  } else {
    text += static_cast<char>(0xF0 | (c >> 18));
    tail(12);
    tail(6);
    tail(0);
  }
}

std::string FromUtf16(std::string_view bytes, bool big_endian) {
  const auto unit = [&](std::size_t at) {
    const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(bytes[i]); };
    return static_cast<char32_t>(big_endian ? byte(at) << 8 | byte(at + 1) : byte(at + 1) << 8 | byte(at));
  };
  std::string text;
  for (std::size_t at = 0; at + 1 < bytes.size(); at += 2) {
    char32_t character = unit(at);
    const bool high = character >= 0xD800 && character < 0xDC00 && at + 3 < bytes.size();
    if (const char32_t low = high ? unit(at + 2) : 0; low >= 0xDC00 && low < 0xE000) {
      character = 0x10000 + ((character - 0xD800) << 10) + (low - 0xDC00);
      at += 2;
    }
    AppendUtf8(character, text);
  }
  return text;
}

// Returns the first byte of the low halves if text without a mark is UTF-16, as the zeros of its Latin
// letters show: 1 for big endian, 0 for little endian; nothing for other text.
std::optional<std::size_t> LowByteOfUtf16(std::string_view bytes) {
  constexpr std::size_t kMaxBytes = 64;
  const std::string_view start = bytes.substr(0, std::min(bytes.size(), kMaxBytes) / 2 * 2);
  std::array<std::size_t, 2> zeros{};
  for (std::size_t i = 0; i < start.size(); ++i) {
    zeros[i % 2] += start[i] == '\0' ? 1 : 0;
  }
  for (const std::size_t low : {0, 1}) {
    if (start.size() >= 4 && zeros[low] == 0 && 4 * zeros[1 - low] >= 3 * (start.size() / 2)) {
      return low;
    }
  }
  return std::nullopt;
}

// Returns the bytes of a character of UTF-8 at the start of the text; 0 if it is invalid or cut off.
std::size_t CharacterLength(std::string_view text) {
  const auto first = static_cast<unsigned char>(text[0]);
  const std::size_t length = first < 0x80 ? 1 : first < 0xC2 ? 0 : first < 0xE0 ? 2 : first < 0xF0 ? 3 : 4;
  const bool whole =
      length > 0 && first < 0xF5 && text.size() >= length &&
      std::ranges::all_of(text.substr(1, length - 1), [](char c) { return (c & 0xC0) == 0x80; });
  return whole ? length : 0;
}

// Returns true for control characters, spaces that look like a blank or like nothing, and marks of direction.
bool IsInvisible(char32_t c) {
  return c < 0x20 || (c >= 0x7F && c <= 0xA0) || c == 0xAD || (c >= 0x2000 && c <= 0x200F) ||
         (c >= 0x2028 && c <= 0x202F) || (c >= 0x205F && c <= 0x2064) || c == 0x3000 || c == 0xFEFF;
}

}  // namespace

std::string DecodedText(std::string bytes) {
  std::string text;
  const std::optional<std::size_t> low = LowByteOfUtf16(bytes);
  if (bytes.starts_with("\xEF\xBB\xBF")) {
    text = bytes.substr(3);
  } else if (bytes.starts_with("\xFF\xFE") || bytes.starts_with("\xFE\xFF")) {
    text = FromUtf16(std::string_view(bytes).substr(2), bytes[0] == '\xFE');
  } else {
    text = low ? FromUtf16(bytes, *low == 1) : std::move(bytes);
  }
  std::size_t end = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const bool carriage = text[i] == '\r';
    text[end++] = carriage ? '\n' : text[i];
    i += carriage && i + 1 < text.size() && text[i + 1] == '\n' ? 1 : 0;
  }
  text.resize(end);
  return text;
}

std::string ReadText(const std::filesystem::path& path, std::string_view expected) {
  return DecodedText(ReadFile(path, expected));
}

std::string VisibleText(std::string_view text) {
  std::string visible;
  while (!text.empty()) {
    const std::size_t length = CharacterLength(text);
    const auto first = static_cast<unsigned char>(text[0]);
    char32_t character = length < 2 ? first : first & (0xFFU >> (length + 1));
    for (std::size_t i = 1; i < length; ++i) {
      character = character << 6 | (text[i] & 0x3F);
    }
    if (text[0] == '\t') {
      visible += "\\t";
    } else if (length == 0) {
      visible += fmt::format("<{:02x}>", first);
    } else if (IsInvisible(character)) {
      visible += fmt::format("<U+{:04X}>", static_cast<std::uint32_t>(character));
    } else {
      visible += text.substr(0, length);
    }
    text.remove_prefix(std::max<std::size_t>(1, length));
  }
  return visible;
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
  return TextLinesIn(ReadText(path, expected));
}

std::vector<TextLine> TextLinesIn(std::string_view text) {
  constexpr std::string_view kStreamBlanks = " \t\r\v\f";  // what separates the words of a stream
  std::vector<TextLine> lines;
  for (int number = 1; !text.empty(); ++number) {
    const std::string_view whole = text.substr(0, text.find('\n'));
    text.remove_prefix(std::min(whole.size() + 1, text.size()));
    const std::size_t begin = whole.find_first_not_of(kStreamBlanks);
    if (begin == std::string_view::npos || whole[begin] == '#' || whole.substr(begin).starts_with("//")) {
      continue;
    }
    const std::size_t end = whole.find_last_not_of(kStreamBlanks) + 1;
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
      VisibleText(CutText(line.text, kMaxShown)) + (line.text.size() > kMaxShown ? "..." : "");
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
