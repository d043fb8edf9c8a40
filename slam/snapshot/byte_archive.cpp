#include "slam/snapshot/byte_archive.h"

#include <zlib.h>

namespace sqslam {

std::string PackBytes(std::string_view raw) {
  const auto raw_size = static_cast<std::uint64_t>(raw.size());
  uLongf packed_size = compressBound(raw.size());
  std::string bytes(sizeof(raw_size) + packed_size, '\0');
  std::memcpy(bytes.data(), &raw_size, sizeof(raw_size));
  compress2(reinterpret_cast<Bytef*>(bytes.data() + sizeof(raw_size)), &packed_size,
            reinterpret_cast<const Bytef*>(raw.data()), raw.size(), 1);
  bytes.resize(sizeof(raw_size) + packed_size);
  return bytes;
}

std::string UnpackBytes(std::string_view packed, const std::string& what) {
  std::uint64_t raw_size = 0;
  constexpr std::uint64_t kMaxRatio = 1100;  // zlib cannot compress further: a larger ratio is a broken size
  if (packed.size() < sizeof(raw_size)) {
    throw InputError(what + " is cut off");
  }
  std::memcpy(&raw_size, packed.data(), sizeof(raw_size));
  packed.remove_prefix(sizeof(raw_size));
  if (raw_size > kMaxRatio * packed.size()) {
    throw InputError(what + " is broken");
  }
  std::string raw(raw_size, '\0');
  uLongf size = raw.size();
  if (uncompress(reinterpret_cast<Bytef*>(raw.data()), &size, reinterpret_cast<const Bytef*>(packed.data()),
                 packed.size()) != Z_OK ||
      size != raw_size) {
    throw InputError(what + " is broken");
  }
  return raw;
}

}  // namespace sqslam
