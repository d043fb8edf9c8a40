#include "slam/io/point_cloud.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <iterator>
#include <optional>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>

#include "slam/util/enum_names.h"
#include "slam/util/limits.h"
#include "slam/util/text_table.h"
#include "slam/util/throw_if.h"

namespace sqslam {
namespace fs = std::filesystem;
namespace {

static_assert(std::endian::native == std::endian::little, "binary bodies are swapped on this assumption");

template <typename T>
double ReadAs(const char* bytes) {
  T value;
  std::memcpy(&value, bytes, sizeof(T));
  return static_cast<double>(value);
}

// A type of number in a PLY file.
struct Scalar {
  std::array<std::string_view, 2> names;
  std::size_t size;                   // bytes
  double (*read)(const char* bytes);  // in this machine's order
  float full;  // value of full brightness in a colour channel; 0: 1, or 255 as some programs write
};
template <typename T>
constexpr Scalar ScalarOf(std::string_view name, std::string_view alias, float full) {
  return {{name, alias}, sizeof(T), ReadAs<T>, full};
}
constexpr std::array<Scalar, 8> kScalars = {
    ScalarOf<std::int8_t>("char", "int8", 255.0F),    ScalarOf<std::uint8_t>("uchar", "uint8", 255.0F),
    ScalarOf<std::int16_t>("short", "int16", 255.0F), ScalarOf<std::uint16_t>("ushort", "uint16", 65535.0F),
    ScalarOf<std::int32_t>("int", "int32", 255.0F),   ScalarOf<std::uint32_t>("uint", "uint32", 255.0F),
    ScalarOf<float>("float", "float32", 0.0F),        ScalarOf<double>("double", "float64", 0.0F)};

const Scalar* ScalarNamed(std::string_view name) {
  const auto found = std::ranges::find_if(
      kScalars, [name](const Scalar& scalar) { return scalar.names[0] == name || scalar.names[1] == name; });
  return found == kScalars.end() ? nullptr : &*found;
}

struct Property {
  std::string name;
  const Scalar* type = nullptr;
  const Scalar* count_type = nullptr;  // of lists
};

struct Element {
  std::string name;
  std::uint64_t count = 0;
  std::vector<Property> properties;
};

enum class Encoding { kAscii, kLittleEndian, kBigEndian };
constexpr auto EnumNames(Encoding) {
  return std::array{"ascii", "binary_little_endian", "binary_big_endian"};
}

struct Header {
  Encoding encoding = Encoding::kAscii;
  std::vector<Element> elements;
  std::size_t end = 0;  // first byte of the body
  int lines = 0;
};

std::vector<std::string> WordsOf(const std::string& text) {
  std::istringstream words(text);
  return {std::istream_iterator<std::string>(words), {}};
}

Property ReadProperty(const fs::path& path, const TextLine& line) {
  const std::vector<std::string>& words = line.words;
  const bool list = words.size() == 5 && words[1] == "list";
  Property property{words.back()};
  property.count_type = list ? ScalarNamed(words[2]) : nullptr;
  property.type = list ? ScalarNamed(words[3]) : words.size() == 3 ? ScalarNamed(words[1]) : nullptr;
  if (property.type == nullptr || (list && property.count_type == nullptr)) {
    ThrowBadLine(path, line,
                 "property TYPE NAME or property list TYPE TYPE NAME, with TYPE one of char, uchar, short, "
                 "ushort, int, uint, float, double");
  }
  return property;
}

Header ReadHeader(const fs::path& path, const std::string& bytes) {
  Header header;
  TextLine line;
  std::optional<Encoding> encoding;
  const std::vector<std::string>& words = line.words;
  do {
    const std::size_t end = bytes.find('\n', header.end);
    if (end == std::string::npos) {
      throw InputError("{}:{}: the header ends here, expected end_header", path.string(), line.number);
    }
    line.text = bytes.substr(header.end, end - header.end);
    line.text.erase(line.text.find_last_not_of('\r') + 1);
    line.words = WordsOf(line.text);
    header.end = end + 1;
    ++line.number;
    if (words.empty() || words[0] == "comment" || words[0] == "obj_info" || words[0] == "ply" ||
        words[0] == "end_header") {
      continue;
    }
    if (words[0] == "format" && words.size() >= 2) {
      encoding = FromName<Encoding>(words[1]);
      if (!encoding) {
        ThrowBadLine(path, line, "format ascii, binary_little_endian or binary_big_endian");
      }
    } else if (words[0] == "element" && words.size() == 3) {
      const auto count = ParseNumber<std::uint64_t>(words[2]);
      if (!count) {
        ThrowBadLine(path, line, "element NAME COUNT");
      }
      header.elements.push_back({words[1], *count, {}});
    } else if (words[0] == "property" && !header.elements.empty()) {
      header.elements.back().properties.push_back(ReadProperty(path, line));
    } else {
      ThrowBadLine(path, line, "a PLY header: format, element NAME COUNT, property TYPE NAME, end_header");
    }
  } while (words.empty() || words[0] != "end_header");
  if (!encoding) {
    ThrowBadLine(path, line, "a line 'format ascii|binary_little_endian|binary_big_endian 1.0' before");
  }
  header.encoding = *encoding;
  header.lines = line.number;
  return header;
}

// Reads the numbers of a body, item by item: an ascii body has one item per line.
class Body {
 public:
  Body(const fs::path& path, const std::string& bytes, const Header& header)
      : path_(path), bytes_(bytes), encoding_(header.encoding), position_(header.end) {
    line_.number = header.lines;
  }

  void StartItem(const Element& element, std::uint64_t index) {
    element_ = &element;
    index_ = index;
    next_word_ = 0;
    line_.words.clear();
    while (encoding_ == Encoding::kAscii && line_.words.empty()) {
      if (position_ >= bytes_.size()) {
        throw InputError("{}:{}: ends before {} {}, expected {} of them", path_.string(), line_.number,
                         element.name, index, element.count);
      }
      const std::size_t end = std::min(bytes_.find('\n', position_), bytes_.size());
      line_.text = bytes_.substr(position_, end - position_);
      line_.words = WordsOf(line_.text);
      position_ = end + 1;
      ++line_.number;
    }
  }

  double Next(const Scalar& type) {
    if (encoding_ == Encoding::kAscii) {
      const auto value =
          ParseNumber<double>(next_word_ < line_.words.size() ? line_.words[next_word_++] : "");
      if (!value) {
        ThrowBadLine(path_, line_, fmt::format("a number for each property of '{}'", element_->name));
      }
      return *value;
    }
    if (bytes_.size() - position_ < type.size) {
      throw InputError("{}: ends at byte {} within {} {}, expected {} of them", path_.string(), bytes_.size(),
                       element_->name, index_, element_->count);
    }
    std::string raw = bytes_.substr(position_, type.size);
    if (encoding_ == Encoding::kBigEndian) {
      std::ranges::reverse(raw);
    }
    position_ += type.size;
    return type.read(raw.data());
  }

 private:
  const fs::path& path_;
  const std::string& bytes_;
  Encoding encoding_;
  std::size_t position_;
  const Element* element_ = nullptr;  // of the item
  std::uint64_t index_ = 0;
  TextLine line_;  // of an ascii body
  std::size_t next_word_ = 0;
};

bool AddPoint(const Eigen::Vector3d& point, PointCloud& cloud) {
  if (!(point.array().abs() <= kMaxMapUnits).all()) {
    ++cloud.skipped;
    return false;
  }
  cloud.points.push_back(point);
  return true;
}

// Names of a vertex's properties by role: coordinates, colour channels, normal, standard deviation.
constexpr std::size_t kRed = 3;
constexpr std::size_t kNormal = 6;
constexpr std::size_t kSigma = 9;
constexpr std::array<std::array<std::string_view, 3>, 10> kRoles = {{{"x"},
                                                                     {"y"},
                                                                     {"z"},
                                                                     {"red", "r", "diffuse_red"},
                                                                     {"green", "g", "diffuse_green"},
                                                                     {"blue", "b", "diffuse_blue"},
                                                                     {"nx"},
                                                                     {"ny"},
                                                                     {"nz"},
                                                                     {"sigma"}}};

// Returns the role of each property, or the number of roles if it has none.
std::vector<std::size_t> RolesOf(const Element& element) {
  std::vector<std::size_t> roles;
  for (const Property& property : element.properties) {
    const auto found = std::ranges::find_if(kRoles, [&](const auto& names) {
      return property.count_type == nullptr && std::ranges::find(names, property.name) != names.end();
    });
    roles.push_back(static_cast<std::size_t>(found - kRoles.begin()));
  }
  return roles;
}

bool HasRoles(const std::vector<std::size_t>& roles, std::size_t first) {
  return std::ranges::count(roles, first) > 0 && std::ranges::count(roles, first + 1) > 0 &&
         std::ranges::count(roles, first + 2) > 0;
}

// NaN becomes 0. Floating-point colours range up to 1, or up to 255 if any is far above 1.
std::vector<std::array<std::uint8_t, 3>> InEightBits(const std::vector<std::array<float, 3>>& colors,
                                                     float full) {
  constexpr float kMaxUnitColour = 2.0F;
  if (full == 0.0F) {
    const bool bytes = std::ranges::any_of(colors, [](const std::array<float, 3>& color) {
      return std::ranges::any_of(color, [](float channel) { return channel > kMaxUnitColour; });
    });
    full = bytes ? 255.0F : 1.0F;
  }
  std::vector<std::array<std::uint8_t, 3>> rgb(colors.size());
  for (std::size_t i = 0; i < colors.size(); ++i) {
    for (std::size_t c = 0; c < 3; ++c) {
      rgb[i][c] = static_cast<std::uint8_t>(
          std::lround(255.0F * std::fmin(std::fmax(colors[i][c] / full, 0.0F), 1.0F)));
    }
  }
  return rgb;
}

// Returns the numbers of an item by role; lists are skipped.
std::array<double, kRoles.size() + 1> ReadItem(Body& body, const Element& element,
                                               const std::vector<std::size_t>& roles) {
  std::array<double, kRoles.size() + 1> values{};
  for (std::size_t p = 0; p < roles.size(); ++p) {
    const Property& property = element.properties[p];
    if (property.count_type == nullptr) {
      values[roles[p]] = body.Next(*property.type);
      continue;
    }
    const double count = body.Next(*property.count_type);
    for (double k = 0.0; k < count; ++k) {
      body.Next(*property.type);
    }
  }
  return values;
}

PointCloud ReadPly(const fs::path& path, const std::string& bytes) {
  const Header header = ReadHeader(path, bytes);
  const auto vertices = std::ranges::find(header.elements, "vertex", &Element::name);
  ThrowIf<InputError>(vertices == header.elements.end() || !HasRoles(RolesOf(*vertices), 0),
                      "{}:{}: the header names no vertices with coordinates, expected an element 'vertex' "
                      "with the properties x, y and z",
                      path.string(), header.lines);
  PointCloud cloud;
  std::vector<std::array<float, 3>> colors;
  Body body(path, bytes, header);
  for (auto element = header.elements.begin(); element <= vertices; ++element) {  // faces are not needed
    if (element->properties.empty() && header.encoding != Encoding::kAscii) {
      continue;  // takes no bytes, however many there are
    }
    const std::vector<std::size_t> roles = RolesOf(*element);
    const bool colored = HasRoles(roles, kRed);
    const bool oriented = HasRoles(roles, kNormal);
    const bool uncertain = std::ranges::count(roles, kSigma) > 0;
    for (std::uint64_t i = 0; i < element->count; ++i) {
      body.StartItem(*element, i);
      const auto v = ReadItem(body, *element, roles);
      if (element != vertices || !AddPoint({v[0], v[1], v[2]}, cloud)) {
        continue;
      }
      if (colored) {
        colors.push_back({static_cast<float>(v[3]), static_cast<float>(v[4]), static_cast<float>(v[5])});
      }
      if (oriented) {
        cloud.normals.push_back(Eigen::Vector3d(v[6], v[7], v[8]).normalized());
      }
      if (uncertain) {
        cloud.sigmas.push_back(v[kSigma]);
      }
    }
    if (element == vertices && colored) {
      const auto red = static_cast<std::size_t>(std::ranges::find(roles, kRed) - roles.begin());
      cloud.rgb = InEightBits(colors, element->properties[red].type->full);
    }
  }
  return cloud;
}

// Returns the columns of x, y and z: those of these names, or else the first three.
std::array<std::size_t, 3> CoordinateColumns(const std::vector<std::string>& names) {
  std::array<std::size_t, 3> columns = {0, 1, 2};
  std::array<std::size_t, 3> named{};
  for (std::size_t i = 0; i < 3; ++i) {
    named[i] = static_cast<std::size_t>(std::ranges::find(names, kRoles[i].front()) - names.begin());
  }
  return std::ranges::max(named) < names.size() ? named : columns;
}

PointCloud ReadTextCloud(const fs::path& path, std::string bytes) {
  const TextTable table = TableIn(DecodedText(std::move(bytes)));
  const std::array<std::size_t, 3> columns = CoordinateColumns(table.names);
  PointCloud cloud;
  for (const TextLine& line : table.rows) {
    Eigen::Vector3d point;
    for (std::size_t i = 0; i < 3; ++i) {
      const auto number =
          ParseNumber<double>(columns[i] < line.words.size() ? line.words[columns[i]] : std::string());
      if (!number) {
        ThrowBadLine(path, line, "x y z (or a PLY file, whose first line is 'ply')");
      }
      point[static_cast<Eigen::Index>(i)] = *number;
    }
    AddPoint(point, cloud);
  }
  return cloud;
}

}  // namespace

PointCloud ReadPointCloud(const fs::path& path) {
  std::string bytes = ReadFile(path, "a PLY file, or a text file with x y z on each line");
  const bool ply = bytes.starts_with("ply\n") || bytes.starts_with("ply\r\n");
  return ply ? ReadPly(path, bytes) : ReadTextCloud(path, std::move(bytes));
}

}  // namespace sqslam
