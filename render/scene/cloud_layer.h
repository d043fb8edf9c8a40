#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "slam/snapshot/depth_map.h"
#include "slam/util/key_index.h"

namespace sqslam {

// A point of a dense cloud for drawing, map frame.
struct CloudPoint {
  Eigen::Vector3f p_map = Eigen::Vector3f::Zero();
  float spacing = 0.0F;  // to its neighbours, map units
  std::array<std::uint8_t, 3> rgb{};
  std::uint8_t rank = 0;   // coarsest level that it belongs to
  std::int32_t frame = 0;  // first frame that shows it in a growing map
};

// A dense cloud, in the order in which a growing map gets its points. Level k consists of the points of rank
// k or more, which are 2^(k/2) times as far apart as those of level 0; distant parts are drawn at a coarse
// level.
struct CloudLayer {
  static constexpr int kRanks = 9;

  double spacing = 0.0;  // of level 0, map units
  std::vector<CloudPoint> points;
};
using CloudLayerPtr = std::shared_ptr<const CloudLayer>;

// Merges all points in a cube into one at their mean, with the frame of the first.
class CloudLayerBuilder {
 public:
  static constexpr std::int32_t kEveryFrame = std::numeric_limits<std::int32_t>::min();

  // `spacing`: edge of the cubes, map units; doubled whenever there are more than `most` points.
  explicit CloudLayerBuilder(double spacing, std::size_t most = 3'000'000);

  struct Source {
    Eigen::Vector3f p_map;
    std::array<std::uint8_t, 3> rgb;
    float distance = 0.0F;  // to its neighbours in its source, map units
    float weight = 1.0F;
    std::int32_t frame = kEveryFrame;
  };

  // Frames must not decrease.
  void Add(std::span<const Source> points);
  void Add(const Eigen::Vector3f& p_map, const std::array<std::uint8_t, 3>& rgb, float distance,
           float weight = 1.0F, std::int32_t frame = kEveryFrame) {
    Add(std::array{Source{p_map, rgb, distance, weight, frame}});
  }
  void Add(const DepthMap& map);

  CloudLayerPtr Finish() const;

 private:
  struct Cell {
    Eigen::Vector3f position = Eigen::Vector3f::Zero();  // weighted sum, relative to `first`
    Eigen::Vector3f rgb = Eigen::Vector3f::Zero();
    Eigen::Vector3f first = Eigen::Vector3f::Zero();
    float weight = 0.0F;
    float distance = 0.0F;  // minimum
    std::int32_t frame = 0;
  };
  void Coarsen();
  void Rank(CloudLayer& layer) const;

  double spacing_;
  std::size_t most_;
  KeyIndex<3> cubes_;  // to cells_
  std::vector<Cell> cells_;
};

// Samples up to `most` points of a cloud, evenly over its surfaces.
std::vector<Eigen::Vector3d> EvenSample(const CloudLayer& cloud, std::size_t most);

// Estimates the distance between neighbouring points of a cloud that samples surfaces, in its unit.
double SpacingOf(const std::vector<Eigen::Vector3f>& points);

// Reads the dense cloud of a recording densified by `sqslam densify`; null if there is none. Throws
// InputError that names the file if a depth map is broken.
CloudLayerPtr ReadCloudLayer(const std::filesystem::path& recording);

}  // namespace sqslam
