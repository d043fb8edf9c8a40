#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "slam/dense/dense_options.h"
#include "slam/dense/view_choice.h"
#include "slam/geometry/box2.h"
#include "slam/io/sequence.h"
#include "slam/snapshot/depth_map.h"
#include "slam/snapshot/snapshot.h"

namespace sqslam {

// Bounding boxes of moving objects, which get no depth.
class MovingMask {
 public:
  MovingMask() = default;

  // Reads boxes.txt of the result folder, which every run with boxes writes; without it, nothing is masked.
  // `sequence`: opened with the camera of the map.
  MovingMask(const std::filesystem::path& result, const Sequence& sequence,
             const std::vector<std::string>& labels);

  // Removes the depth of pixels in the boxes of the map's frame.
  void Apply(DepthMap& map) const;

 private:
  std::map<std::int64_t, std::vector<Box2d>> boxes_;  // by frame, relative to the image's width and height
};

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
  void SetMap(const MapSnapshot& map, double scale);
};

// Reads the last state of the map in a result folder and finds its images in `images` or, if that is empty,
// where the recording says. Throws InputError if there is no map or no image, or if images were added or
// removed before others (CheckNumbering); warns about single missing ones.
DenseInput ReadDenseInput(const std::filesystem::path& result, const std::filesystem::path& images,
                          const DenseOptions& options);

// The views from which a keyframe's depth is estimated.
struct KeyframePlan {
  std::vector<Eigen::Vector3d> in_view;  // a sample of the map points that it sees
  std::optional<DepthRange> range;       // empty: no depth
  std::vector<std::size_t> views, fine;  // positions in DenseInput::frames
  std::string settings;                  // fingerprint of what its depth depends on, except images
};

// Returns a fingerprint of the options for depth estimation, without those for later steps.
std::string EstimationSettings(const DenseOptions& options);

// Plans a keyframe (a position in DenseInput::keyframes).
KeyframePlan PlanKeyframe(const DenseInput& input, std::size_t k, const DenseOptions& options);

// Plans all keyframes of the input, in their order.
std::vector<KeyframePlan> PlanKeyframes(const DenseInput& input, const DenseOptions& options);

}  // namespace sqslam
