#include "render/picture/png_density.h"

#include <zlib.h>

#include <cmath>
#include <cstddef>
#include <cstdint>

namespace sqslam {

std::string WithDensity(const std::string& png, double dpi) {
  constexpr std::size_t kHeaderEnd = 8 + 25;  // signature and IHDR
  constexpr double kInchesPerMetre = 1.0 / 0.0254;
  const auto per_metre = static_cast<std::uint32_t>(std::lround(dpi * kInchesPerMetre));
  const auto big_endian = [](std::uint32_t value) {
    std::string bytes;
    for (const unsigned shift : {24u, 16u, 8u, 0u}) {
      bytes += static_cast<char>((value >> shift) & 255u);
    }
    return bytes;
  };
  const std::string body = "pHYs" + big_endian(per_metre) + big_endian(per_metre) + '\1';  // per metre
  const auto checksum = static_cast<std::uint32_t>(
      crc32(0, reinterpret_cast<const Bytef*>(body.data()), static_cast<uInt>(body.size())));
  const auto length = static_cast<std::uint32_t>(body.size() - 4);
  return png.substr(0, kHeaderEnd) + big_endian(length) + body + big_endian(checksum) +
         png.substr(kHeaderEnd);
}

}  // namespace sqslam
