#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "slam/dense/dense_options.h"
#include "slam/dense/moving_mask.h"
#include "slam/dense/view_choice.h"
#include "slam/io/sequence.h"
#include "slam/snapshot/snapshot.h"

namespace sqslam {

// A map and the frames it was made from, as input for depth maps.
struct DenseInput {
  Sequence sequence;
  Camera recorded;                      // of the map
  Camera camera;                        // of the depth maps, without distortion
  std::vector<PosedFrame> frames;       // with a pose and an existing image
  std::vector<PosedFrame> keyframes;    // in the order of their frames
  std::vector<std::int64_t> ids;        // of the keyframes
  std::vector<Eigen::Vector3d> points;  // of the map
  double readout = 0.0;                 // seconds from the first to the last row of an image
  MovingMask moving;

  // Takes camera, keyframes and points from a snapshot. `scale`: see DenseOptions.
  void TakeMap(const MapSnapshot& map, double scale);
};

// Reads the last state of the map in a result folder and finds its images in `images` or, if that is empty,
// where the recording says. Throws InputError if there is no map or no image; warns about single missing
// ones.
DenseInput ReadDenseInput(const std::filesystem::path& result, const std::filesystem::path& images,
                          const DenseOptions& options);

}  // namespace sqslam
