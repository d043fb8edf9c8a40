#include "slam/io/ply_header.h"

#include <fmt/format.h>

#include <array>
#include <iterator>
#include <sstream>
#include <string_view>

#include "slam/util/error.h"
#include "slam/util/text_lines.h"

namespace sqslam::ply {
namespace fs = std::filesystem;
namespace {

std::optional<Scalar> ScalarNamed(std::string_view name) {
  constexpr std::array<std::array<std::string_view, 2>, 8> kNames = {{{"char", "int8"},
                                                                      {"uchar", "uint8"},
                                                                      {"short", "int16"},
                                                                      {"ushort", "uint16"},
                                                                      {"int", "int32"},
                                                                      {"uint", "uint32"},
                                                                      {"float", "float32"},
                                                                      {"double", "float64"}}};
  for (std::size_t i = 0; i < kNames.size(); ++i) {
    if (name == kNames[i][0] || name == kNames[i][1]) {
      return static_cast<Scalar>(i);
    }
  }
  return std::nullopt;
}

constexpr const char* kExpectedHeader =
    "a PLY header: format, element NAME COUNT, property TYPE NAME, end_header";

// Reads the header line by line.
class HeaderReader {
 public:
  HeaderReader(const fs::path& path, const std::string& bytes) : path_(path), bytes_(bytes) {}

  Header Read() {
    bool format_seen = false;
    while (true) {
      NextLine();
      const std::vector<std::string>& words = line_.words;
      if (words.empty() || words[0] == "comment" || words[0] == "obj_info" || words[0] == "ply") {
        continue;
      }
      if (words[0] == "end_header") {
        break;
      }
      if (words[0] == "format" && words.size() >= 2) {
        format_seen = true;
        ReadFormat();
      } else if (words[0] == "element" && words.size() == 3) {
        ReadElement();
      } else if (words[0] == "property" && !header_.elements.empty()) {
        ReadProperty();
      } else {
        ThrowBadLine(path_, line_, kExpectedHeader);
      }
    }
    if (!format_seen) {
      ThrowBadLine(path_, line_, "a line 'format ascii|binary_little_endian|binary_big_endian 1.0' before");
    }
    header_.end = position_;
    header_.lines = line_.number;
    return header_;
  }

 private:
  void NextLine() {
    const std::size_t end = bytes_.find('\n', position_);
    if (end == std::string::npos) {
      throw InputError(
          fmt::format("{}:{}: the header ends here, expected end_header", path_.string(), line_.number));
    }
    line_.text = bytes_.substr(position_, end - position_);
    while (!line_.text.empty() && line_.text.back() == '\r') {
      line_.text.pop_back();
    }
    std::istringstream words(line_.text);
    line_.words.assign(std::istream_iterator<std::string>(words), {});
    position_ = end + 1;
    ++line_.number;
  }

  void ReadFormat() {
    const std::string& name = line_.words[1];
    if (name == "ascii") {
      header_.encoding = Encoding::kAscii;
    } else if (name == "binary_little_endian") {
      header_.encoding = Encoding::kLittleEndian;
    } else if (name == "binary_big_endian") {
      header_.encoding = Encoding::kBigEndian;
    } else {
      ThrowBadLine(path_, line_, "format ascii, binary_little_endian or binary_big_endian");
    }
  }

  void ReadElement() {
    const auto count = ParseNumber<std::uint64_t>(line_.words[2]);
    if (!count) {
      ThrowBadLine(path_, line_, "element NAME COUNT");
    }
    header_.elements.push_back({line_.words[1], *count, {}});
  }

  void ReadProperty() {
    const std::vector<std::string>& words = line_.words;
    Property property;
    std::optional<Scalar> type;
    if (words.size() == 5 && words[1] == "list") {
      property.count_type = ScalarNamed(words[2]);
      type = property.count_type ? ScalarNamed(words[3]) : std::nullopt;
    } else if (words.size() == 3) {
      type = ScalarNamed(words[1]);
    }
    if (!type) {
      ThrowBadLine(path_, line_,
                   "property TYPE NAME or property list TYPE TYPE NAME, with TYPE one of char, "
                   "uchar, short, ushort, int, uint, float, double");
    }
    property.type = *type;
    property.name = words.back();
    header_.elements.back().properties.push_back(property);
  }

  const fs::path& path_;
  const std::string& bytes_;
  std::size_t position_ = 0;
  TextLine line_;
  Header header_;
};

}  // namespace

std::size_t SizeOf(Scalar type) {
  constexpr std::array<std::size_t, 8> kSizes = {1, 1, 2, 2, 4, 4, 4, 8};
  return kSizes[static_cast<std::size_t>(type)];
}

Header ReadHeader(const fs::path& path, const std::string& bytes) { return HeaderReader(path, bytes).Read(); }

}  // namespace sqslam::ply
