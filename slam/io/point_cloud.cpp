#include "slam/io/point_cloud.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <iterator>
#include <optional>
#include <sstream>
#include <string>
#include <string_view>

#include "slam/io/ply_header.h"
#include "slam/util/error.h"
#include "slam/util/text_lines.h"

namespace sqslam {
namespace fs = std::filesystem;
namespace {

static_assert(std::endian::native == std::endian::little, "binary bodies are swapped on this assumption");

using ply::Element;
using ply::Encoding;
using ply::Header;
using ply::Property;
using ply::Scalar;

// Values of a binary body, one after the other.
class BinaryBody {
 public:
  BinaryBody(const fs::path& path, const std::string& bytes, const Header& header)
      : path_(path), bytes_(bytes), position_(header.end), swap_(header.encoding == Encoding::kBigEndian) {}

  double Next(Scalar type, const Element& element, std::uint64_t index) {
    const std::size_t size = ply::SizeOf(type);
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
    const auto value = ParseNumber<double>(next_ < line_.words.size() ? line_.words[next_++] : "");
    if (!value) {
      ThrowBadLine(path_, line_, fmt::format("a number for each property of '{}'", element.name));
    }
    return *value;
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

bool AddPoint(const Eigen::Vector3d& point, PointCloud& cloud) {
  if (!point.allFinite()) {
    ++cloud.skipped;
    return false;
  }
  cloud.points.push_back(point);
  return true;
}

// Index of the coordinate that the property holds, or -1.
int CoordinateOf(const Property& property) {
  const bool coordinate =
      !property.count_type && property.name.size() == 1 && property.name[0] >= 'x' && property.name[0] <= 'z';
  return coordinate ? property.name[0] - 'x' : -1;
}

// Channel of the colour that the property holds, or -1.
int ChannelOf(const Property& property) {
  constexpr std::array<std::array<std::string_view, 3>, 3> kNames = {
      {{"red", "r", "diffuse_red"}, {"green", "g", "diffuse_green"}, {"blue", "b", "diffuse_blue"}}};
  for (std::size_t i = 0; !property.count_type && i < kNames.size(); ++i) {
    if (std::find(kNames[i].begin(), kNames[i].end(), property.name) != kNames[i].end()) {
      return static_cast<int>(i);
    }
  }
  return -1;
}

// Number that stands for full brightness: the largest number of 8 or 16 bits; real numbers go to 1, or where
// any is far above that to 255, as some programs write them.
float FullBrightness(Scalar type, const std::vector<std::array<float, 3>>& colors) {
  constexpr float kFarAboveOne = 2.0F;
  if (type == Scalar::kUint16) {
    return 65535.0F;
  }
  if (type != Scalar::kFloat && type != Scalar::kDouble) {
    return 255.0F;
  }
  const bool bytes = std::any_of(colors.begin(), colors.end(), [](const std::array<float, 3>& color) {
    return std::any_of(color.begin(), color.end(), [](float channel) { return channel > kFarAboveOne; });
  });
  return bytes ? 255.0F : 1.0F;
}

// `type`: of the property that holds red. What is no number is dark.
std::vector<std::array<std::uint8_t, 3>> InEightBits(const std::vector<std::array<float, 3>>& colors,
                                                     Scalar type) {
  const float full = FullBrightness(type, colors);
  std::vector<std::array<std::uint8_t, 3>> rgb(colors.size());
  for (std::size_t i = 0; i < colors.size(); ++i) {
    for (std::size_t c = 0; c < 3; ++c) {
      rgb[i][c] = static_cast<std::uint8_t>(
          std::lround(255.0F * std::fmin(std::fmax(colors[i][c] / full, 0.0F), 1.0F)));
    }
  }
  return rgb;
}

// Meaning of a property of a vertex.
struct Role {
  int coordinate = -1;
  int channel = -1;
};

std::vector<Role> RolesOf(const Element& element) {
  std::vector<Role> roles;
  int channels = 0;
  for (const Property& property : element.properties) {
    roles.push_back({CoordinateOf(property), ChannelOf(property)});
    channels |= roles.back().channel >= 0 ? 1 << roles.back().channel : 0;
  }
  if (channels != 7) {  // not all three: no colour
    for (Role& role : roles) {
      role.channel = -1;
    }
  }
  return roles;
}

template <typename Body>
void ReadVertex(Body& body, const Element& element, const std::vector<Role>& roles, std::uint64_t index,
                PointCloud& cloud, std::vector<std::array<float, 3>>& colors) {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  std::array<float, 3> color{};
  bool colored = false;
  for (std::size_t p = 0; p < roles.size(); ++p) {
    const Property& property = element.properties[p];
    if (property.count_type) {
      const double count = body.Next(*property.count_type, element, index);
      for (double k = 0.0; k < count; ++k) {
        body.Next(property.type, element, index);
      }
      continue;
    }
    const double value = body.Next(property.type, element, index);
    if (roles[p].coordinate >= 0) {
      point[roles[p].coordinate] = value;
    } else if (roles[p].channel >= 0) {
      color[static_cast<std::size_t>(roles[p].channel)] = static_cast<float>(value);
      colored = true;
    }
  }
  body.EndOfItem(element, index);
  if (element.name == "vertex" && AddPoint(point, cloud) && colored) {
    colors.push_back(color);
  }
}

template <typename Body>
PointCloud ReadVertices(Body body, const Header& header) {
  PointCloud cloud;
  std::vector<std::array<float, 3>> colors;
  for (const Element& element : header.elements) {
    if (element.properties.empty() && header.encoding != Encoding::kAscii) {
      continue;  // takes no bytes, however many there are
    }
    const std::vector<Role> roles = RolesOf(element);
    for (std::uint64_t i = 0; i < element.count; ++i) {
      ReadVertex(body, element, roles, i, cloud, colors);
    }
    if (element.name == "vertex") {
      const auto red =
          std::find_if(roles.begin(), roles.end(), [](const Role& role) { return role.channel == 0; });
      if (red != roles.end()) {
        cloud.rgb =
            InEightBits(colors, element.properties[static_cast<std::size_t>(red - roles.begin())].type);
      }
      break;  // the rest (faces) is not needed
    }
  }
  return cloud;
}

PointCloud ReadPly(const fs::path& path, const std::string& bytes) {
  const Header header = ply::ReadHeader(path, bytes);
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
      const auto number =
          ParseNumber<double>(static_cast<std::size_t>(i) < line.words.size() ? line.words[i] : "");
      if (!number) {
        ThrowBadLine(path, line, "x y z (or a PLY file, whose first line is 'ply')");
      }
      point[i] = *number;
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
