#include "slam/util/fingerprint.h"

#include <fmt/format.h>

#include <cstdint>

namespace sqslam {

std::string Fingerprint(std::string_view text) {
  std::uint64_t hash = 14695981039346656037ULL;
  for (const char c : text) {
    hash = (hash ^ static_cast<unsigned char>(c)) * 1099511628211ULL;
  }
  return fmt::format("{:016x}", hash);
}

}  // namespace sqslam
