#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <span>

#include "slam/features/frame_features.h"

namespace sqslam {

// A 256-bit descriptor as whole machine words, for counting bits four times instead of 32.
using DescriptorBits = std::array<std::uint64_t, 4>;

inline DescriptorBits ToBits(const Descriptor& descriptor) {
  return std::bit_cast<DescriptorBits>(descriptor);
}

struct NearestBits {
  int index = -1;
  int distance = 257;  // differing bits, 0 to 256; more where there was no candidate
};

// The candidate with the fewest bits that differ from the query; of equals the first.
NearestBits FindNearest(std::span<const DescriptorBits> candidates, const DescriptorBits& query);

// Bit by bit what more than half of the descriptors say: their median under the Hamming distance.
DescriptorBits MajorityOf(std::span<const DescriptorBits> descriptors);

}  // namespace sqslam
