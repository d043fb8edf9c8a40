#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace sqslam::ply {

enum class Scalar { kInt8, kUint8, kInt16, kUint16, kInt32, kUint32, kFloat, kDouble };

std::size_t SizeOf(Scalar type);  // bytes

struct Property {
  std::string name;
  Scalar type = Scalar::kFloat;
  std::optional<Scalar> count_type;  // set for lists
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

// Reads the header of a PLY file. Throws InputError that names file, line and what was expected.
Header ReadHeader(const std::filesystem::path& path, const std::string& bytes);

}  // namespace sqslam::ply
