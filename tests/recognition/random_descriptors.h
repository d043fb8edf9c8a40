#pragma once

#include <algorithm>
#include <random>
#include <vector>

#include "slam/features/frame_features.h"

namespace sqslam::testing {

inline Descriptor RandomDescriptor(std::mt19937& random) {
  Descriptor descriptor;
  std::generate(descriptor.begin(), descriptor.end(), [&] { return static_cast<std::uint8_t>(random()); });
  return descriptor;
}

inline void FlipBit(Descriptor& descriptor, unsigned bit) {
  descriptor[bit / 8] = static_cast<std::uint8_t>(descriptor[bit / 8] ^ (1U << (bit % 8)));
}

// The same with `bits` random bits flipped (fewer where one is hit twice).
inline Descriptor Disturbed(Descriptor descriptor, int bits, std::mt19937& random) {
  for (int i = 0; i < bits; ++i) {
    FlipBit(descriptor, static_cast<unsigned>(random() % 256));
  }
  return descriptor;
}

// Images of `features` descriptors each, all of them near one of `clusters` centres.
inline std::vector<std::vector<Descriptor>> ClusteredImages(int images, int features, int clusters,
                                                            unsigned seed) {
  std::mt19937 random(seed);
  std::vector<Descriptor> centers(static_cast<std::size_t>(clusters));
  std::generate(centers.begin(), centers.end(), [&] { return RandomDescriptor(random); });
  std::vector<std::vector<Descriptor>> result(static_cast<std::size_t>(images));
  for (std::vector<Descriptor>& image : result) {
    for (int i = 0; i < features; ++i) {
      image.push_back(Disturbed(centers[random() % centers.size()], 12, random));
    }
  }
  return result;
}

}  // namespace sqslam::testing
