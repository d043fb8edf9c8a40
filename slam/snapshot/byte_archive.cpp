#include "slam/snapshot/byte_archive.h"

#include <zlib.h>

namespace sqslam {

std::string Deflate(std::string_view raw) {
  uLongf size = compressBound(raw.size());
  std::string packed(size, '\0');
  compress2(reinterpret_cast<Bytef*>(packed.data()), &size, reinterpret_cast<const Bytef*>(raw.data()),
            raw.size(), 1);
  packed.resize(size);
  return packed;
}

std::string Inflate(std::string_view packed, std::size_t size, const std::string& what) {
  std::string raw(size, '\0');
  uLongf raw_size = raw.size();
  if (uncompress(reinterpret_cast<Bytef*>(raw.data()), &raw_size,
                 reinterpret_cast<const Bytef*>(packed.data()), packed.size()) != Z_OK ||
      raw_size != size) {
    throw InputError(what + " is broken");
  }
  return raw;
}

std::string PackBytes(std::string_view raw) {
  ByteWriter size;
  size(static_cast<std::uint64_t>(raw.size()));
  return size.Take() + Deflate(raw);
}

std::string UnpackBytes(std::string_view packed, const std::string& what) {
  constexpr std::uint64_t kMaxRatio = 1100;  // zlib cannot compress further: a larger ratio is a broken size
  std::uint64_t raw_size = 0;
  ByteReader(packed, what)(raw_size);
  packed.remove_prefix(sizeof(raw_size));
  if (raw_size > kMaxRatio * packed.size()) {
    throw InputError(what + " is broken");
  }
  return Inflate(packed, raw_size, what);
}

}  // namespace sqslam
