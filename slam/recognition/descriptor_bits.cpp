#include "slam/recognition/descriptor_bits.h"

#include <vector>

namespace sqslam {
namespace {

__attribute__((always_inline)) inline NearestBits FindNearestInline(
    std::span<const DescriptorBits> candidates, const DescriptorBits& query) {
  NearestBits nearest;
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    int distance = 0;
    for (std::size_t w = 0; w < query.size(); ++w) {
      distance += __builtin_popcountll(candidates[i][w] ^ query[w]);
    }
    if (distance < nearest.distance) {
      nearest = {static_cast<int>(i), distance};
    }
  }
  return nearest;
}

NearestBits FindNearestAnywhere(std::span<const DescriptorBits> candidates, const DescriptorBits& query) {
  return FindNearestInline(candidates, query);
}

#if defined(__x86_64__)
// The program is built for every x86-64, of which the first had no instruction to count bits; chosen by hand
// because ifuncs (target_clones) do not get along with the sanitizers.
__attribute__((target("popcnt"))) NearestBits FindNearestPopcnt(std::span<const DescriptorBits> candidates,
                                                                const DescriptorBits& query) {
  return FindNearestInline(candidates, query);
}

bool HasPopcnt() {
  static const bool has = __builtin_cpu_supports("popcnt");
  return has;
}
#endif

}  // namespace

NearestBits FindNearest(std::span<const DescriptorBits> candidates, const DescriptorBits& query) {
#if defined(__x86_64__)
  if (HasPopcnt()) {
    return FindNearestPopcnt(candidates, query);
  }
#endif
  return FindNearestAnywhere(candidates, query);
}

DescriptorBits MajorityOf(std::span<const DescriptorBits> descriptors) {
  // 256 counters side by side: planes[p] holds bit p of each, and a descriptor is added to all of them at
  // once by carrying from plane to plane.
  std::vector<DescriptorBits> planes;
  for (const DescriptorBits& descriptor : descriptors) {
    DescriptorBits carry = descriptor;
    for (std::size_t p = 0; (carry[0] | carry[1] | carry[2] | carry[3]) != 0; ++p) {
      if (p == planes.size()) {
        planes.emplace_back();
      }
      for (std::size_t w = 0; w < carry.size(); ++w) {
        const std::uint64_t next = planes[p][w] & carry[w];
        planes[p][w] ^= carry[w];
        carry[w] = next;
      }
    }
  }
  DescriptorBits majority{};
  for (std::size_t bit = 0; bit < 256; ++bit) {
    std::size_t count = 0;
    for (std::size_t p = 0; p < planes.size(); ++p) {
      count |= static_cast<std::size_t>((planes[p][bit / 64] >> (bit % 64)) & 1U) << p;
    }
    if (2 * count > descriptors.size()) {
      majority[bit / 64] |= std::uint64_t{1} << (bit % 64);
    }
  }
  return majority;
}

}  // namespace sqslam
