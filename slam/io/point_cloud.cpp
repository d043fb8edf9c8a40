#include "slam/io/point_cloud.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cctype>
#include <charconv>
#include <cstdint>
#include <cstring>
#include <iterator>
#include <optional>
#include <sstream>
#include <string>
#include <string_view>

#include "slam/io/text_lines.h"
#include "slam/util/error.h"

namespace sqslam {
namespace fs = std::filesystem;
namespace {

static_assert(std::endian::native == std::endian::little, "binary bodies are swapped on this assumption");

enum class Scalar { kInt8, kUint8, kInt16, kUint16, kInt32, kUint32, kFloat, kDouble };

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

std::size_t SizeOf(Scalar type) {
  constexpr std::array<std::size_t, 8> kSizes = {1, 1, 2, 2, 4, 4, 4, 8};
  return kSizes[static_cast<std::size_t>(type)];
}

struct Property {
  std::string name;
  Scalar type = Scalar::kFloat;
  std::optional<Scalar> count_type;  // of a list
};

struct Element {
  std::string name;
  std::uint64_t count = 0;
  std::vector<Property> properties;
};

enum class Encoding { kAscii, kLittleEndian, kBigEndian };

struct Header {
  Encoding encoding = Encoding::kAscii;
  std::vector<Element> elements;
  std::size_t end = 0;  // first byte of the body
  int lines = 0;
};

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
    const std::string& count = line_.words[2];
    Element element{line_.words[1], 0, {}};
    const auto [end, error] = std::from_chars(count.data(), count.data() + count.size(), element.count);
    if (error != std::errc() || end != count.data() + count.size()) {
      ThrowBadLine(path_, line_, "element NAME COUNT");
    }
    header_.elements.push_back(std::move(element));
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

// Values of a binary body, one after the other.
class BinaryBody {
 public:
  BinaryBody(const fs::path& path, const std::string& bytes, const Header& header)
      : path_(path), bytes_(bytes), position_(header.end), swap_(header.encoding == Encoding::kBigEndian) {}

  double Next(Scalar type, const Element& element, std::uint64_t index) {
    const std::size_t size = SizeOf(type);
    if (bytes_.size() - position_ < size) {
      throw InputError(fmt::format("{}: ends at byte {} within {} {}, expected {} of them", path_.string(),
                                   bytes_.size(), element.name, index, element.count));
    }
    std::array<char, 8> raw{};
    std::memcpy(raw.data(), bytes_.data() + position_, size);
    if (swap_) {
      std::reverse(raw.begin(), raw.begin() + static_cast<std::ptrdiff_t>(size));
    }
    position_ += size;
    return Value(type, raw);
  }

  void EndOfItem(const Element&, std::uint64_t) {}

 private:
  template <typename T>
  static double As(const std::array<char, 8>& raw) {
    T value;
    std::memcpy(&value, raw.data(), sizeof(T));
    return static_cast<double>(value);
  }

  static double Value(Scalar type, const std::array<char, 8>& raw) {
    switch (type) {
      case Scalar::kInt8:
        return As<std::int8_t>(raw);
      case Scalar::kUint8:
        return As<std::uint8_t>(raw);
      case Scalar::kInt16:
        return As<std::int16_t>(raw);
      case Scalar::kUint16:
        return As<std::uint16_t>(raw);
      case Scalar::kInt32:
        return As<std::int32_t>(raw);
      case Scalar::kUint32:
        return As<std::uint32_t>(raw);
      case Scalar::kFloat:
        return As<float>(raw);
      case Scalar::kDouble:
        break;
    }
    return As<double>(raw);
  }

  const fs::path& path_;
  const std::string& bytes_;
  std::size_t position_;
  bool swap_;
};

// Values of an ascii body: one line an item.
class AsciiBody {
 public:
  AsciiBody(const fs::path& path, const std::string& bytes, const Header& header)
      : path_(path), stream_(bytes) {
    stream_.seekg(static_cast<std::streamoff>(header.end));
    line_.number = header.lines;
  }

  double Next(Scalar, const Element& element, std::uint64_t index) {
    if (fresh_) {
      NextLine(element, index);
    }
    const std::string word = next_ < line_.words.size() ? line_.words[next_++] : std::string();
    const char* begin = word.data() + (word.starts_with('+') ? 1 : 0);
    double value = 0.0;
    const auto [end, error] = std::from_chars(begin, word.data() + word.size(), value);
    if (word.empty() || error != std::errc() || end != word.data() + word.size()) {
      ThrowBadLine(path_, line_, fmt::format("a number for each property of '{}'", element.name));
    }
    return value;
  }

  void EndOfItem(const Element& element, std::uint64_t index) {
    if (fresh_) {
      NextLine(element, index);  // an element without properties still has its line
    }
    fresh_ = true;
  }

 private:
  void NextLine(const Element& element, std::uint64_t index) {
    do {
      if (!std::getline(stream_, line_.text)) {
        throw InputError(fmt::format("{}:{}: ends before {} {}, expected {} of them", path_.string(),
                                     line_.number, element.name, index, element.count));
      }
      ++line_.number;
      std::istringstream words(line_.text);
      line_.words.assign(std::istream_iterator<std::string>(words), {});
    } while (line_.words.empty());
    next_ = 0;
    fresh_ = false;
  }

  const fs::path& path_;
  std::istringstream stream_;
  TextLine line_;
  std::size_t next_ = 0;
  bool fresh_ = true;
};

void AddPoint(const Eigen::Vector3d& point, PointCloud& cloud) {
  if (point.allFinite()) {
    cloud.points.push_back(point);
  } else {
    ++cloud.skipped;
  }
}

// Index of the coordinate that the property holds, or -1.
int CoordinateOf(const Property& property) {
  const bool coordinate =
      !property.count_type && property.name.size() == 1 && property.name[0] >= 'x' && property.name[0] <= 'z';
  return coordinate ? property.name[0] - 'x' : -1;
}

template <typename Body>
PointCloud ReadVertices(Body body, const Header& header) {
  PointCloud cloud;
  for (const Element& element : header.elements) {
    if (element.properties.empty() && header.encoding != Encoding::kAscii) {
      continue;  // takes no bytes, however many there are
    }
    for (std::uint64_t i = 0; i < element.count; ++i) {
      Eigen::Vector3d point = Eigen::Vector3d::Zero();
      for (const Property& property : element.properties) {
        if (property.count_type) {
          const double count = body.Next(*property.count_type, element, i);
          for (double k = 0.0; k < count; ++k) {
            body.Next(property.type, element, i);
          }
          continue;
        }
        const double value = body.Next(property.type, element, i);
        const int coordinate = CoordinateOf(property);
        if (coordinate >= 0) {
          point[coordinate] = value;
        }
      }
      body.EndOfItem(element, i);
      if (element.name == "vertex") {
        AddPoint(point, cloud);
      }
    }
    if (element.name == "vertex") {
      break;  // what follows (faces) is not needed
    }
  }
  return cloud;
}

PointCloud ReadPly(const fs::path& path, const std::string& bytes) {
  const Header header = HeaderReader(path, bytes).Read();
  const auto vertex = std::find_if(header.elements.begin(), header.elements.end(),
                                   [](const Element& element) { return element.name == "vertex"; });
  std::array<bool, 3> found{};
  if (vertex != header.elements.end()) {
    for (const Property& property : vertex->properties) {
      if (CoordinateOf(property) >= 0) {
        found[CoordinateOf(property)] = true;
      }
    }
  }
  if (!found[0] || !found[1] || !found[2]) {
    throw InputError(
        fmt::format("{}:{}: the header names no vertices with coordinates, expected an element "
                    "'vertex' with the properties x, y and z",
                    path.string(), header.lines));
  }
  return header.encoding == Encoding::kAscii ? ReadVertices(AsciiBody(path, bytes, header), header)
                                             : ReadVertices(BinaryBody(path, bytes, header), header);
}

PointCloud ReadText(const fs::path& path, const std::string& bytes) {
  PointCloud cloud;
  std::istringstream stream(bytes);
  TextLine line;
  while (std::getline(stream, line.text)) {
    ++line.number;
    std::string separated = line.text;
    std::replace_if(
        separated.begin(), separated.end(), [](char c) { return c == ',' || c == ';'; }, ' ');
    std::istringstream words(separated);
    line.words.assign(std::istream_iterator<std::string>(words), {});
    const bool names =
        line.number == 1 && !line.words.empty() && (line.words[0] == "x" || line.words[0] == "X");
    if (line.words.empty() || line.words[0][0] == '#' || names) {
      continue;
    }
    Eigen::Vector3d point;
    for (int i = 0; i < 3; ++i) {
      const std::string word = static_cast<std::size_t>(i) < line.words.size() ? line.words[i] : "";
      const char* begin = word.data() + (word.starts_with('+') ? 1 : 0);
      const auto [end, error] = std::from_chars(begin, word.data() + word.size(), point[i]);
      if (word.empty() || error != std::errc() || end != word.data() + word.size()) {
        ThrowBadLine(path, line, "x y z (or a PLY file, whose first line is 'ply')");
      }
    }
    AddPoint(point, cloud);
  }
  return cloud;
}

}  // namespace

PointCloud ReadPointCloud(const fs::path& path) {
  const std::string bytes = ReadFile(path, "a PLY file, or a text file with x y z on each line");
  const bool ply = bytes.starts_with("ply\n") || bytes.starts_with("ply\r\n");
  return ply ? ReadPly(path, bytes) : ReadText(path, bytes);
}

}  // namespace sqslam
