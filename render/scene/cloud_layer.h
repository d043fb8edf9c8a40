#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <memory>
#include <vector>

#include "slam/snapshot/depth_map.h"

namespace sqslam {

// A point of a dense cloud as pictures draw it, map frame.
struct CloudPoint {
  Eigen::Vector3f p_map = Eigen::Vector3f::Zero();
  float spacing = 0.0F;  // to its neighbours, map units
  std::array<std::uint8_t, 3> rgb{};
  std::uint8_t rank = 0;   // of the coarsest level that it belongs to
  std::int32_t frame = 0;  // from which it is seen in a growing map
};

// A dense cloud, in the order in which a growing map gets its points. Level k, the points of rank k or more,
// is a cloud of its own whose points are 2^(k/2) times as far apart: of far parts no more need be drawn.
struct CloudLayer {
  static constexpr int kRanks = 9;

  double spacing = 0.0;  // of level 0, map units
  std::vector<CloudPoint> points;
};
using CloudLayerPtr = std::shared_ptr<const CloudLayer>;

// Indices by cube, with open addressing: it takes most of the time that a cloud takes.
class CubeMap {
 public:
  explicit CubeMap(std::size_t expected = 0);
  // The index of the cube around a point; `fresh`, which is then remembered, for a new cube.
  std::int32_t At(const Eigen::Vector3f& p, double edge, std::int32_t fresh);
  std::size_t Size() const { return used_; }

 private:
  struct Slot {
    std::uint64_t key = 0;
    std::int32_t index = -1;
  };
  Slot& SlotOf(std::uint64_t key);  // that of the key, or the free one where it belongs
  std::vector<Slot> slots_;
  std::size_t used_ = 0;
};

// Makes one point of all that lie in a cube, at their mean; it is there from the first of them on.
class CloudLayerBuilder {
 public:
  static constexpr std::int32_t kAlways = std::numeric_limits<std::int32_t>::min();

  // `spacing`: edge of the cubes, map units; doubled whenever more than `most` points would be made.
  explicit CloudLayerBuilder(double spacing, std::size_t most = 3'000'000);

  // `distance`: to its neighbours in its source, map units. Frames must not fall.
  void Add(const Eigen::Vector3f& p_map, const std::array<std::uint8_t, 3>& rgb, float distance,
           float weight = 1.0F, std::int32_t frame = kAlways);
  void Add(const DepthMap& map);

  CloudLayerPtr Finish() const;

 private:
  struct Cell {
    Eigen::Vector3f position = Eigen::Vector3f::Zero();  // sums, weighted, from the first point in it
    Eigen::Vector3f rgb = Eigen::Vector3f::Zero();
    Eigen::Vector3f first = Eigen::Vector3f::Zero();
    float weight = 0.0F;
    float distance = 0.0F;  // the least
    std::int32_t frame = 0;
  };
  void Coarsen();
  void Rank(CloudLayer& layer) const;

  double spacing_;
  std::size_t most_;
  CubeMap cubes_;
  std::vector<Cell> cells_;
};

// Points all over a cloud, about as many from each square of its surfaces: so many, or a few less.
std::vector<Eigen::Vector3d> EvenSample(const CloudLayer& cloud, std::size_t most);

// Distance between neighbouring points of a cloud of surfaces, in its unit.
double SpacingOf(const std::vector<Eigen::Vector3f>& points);

// The dense cloud that `sqslam densify` left in a recording; null where there is none. Throws InputError that
// names the file where a depth map is broken.
CloudLayerPtr ReadCloudLayer(const std::filesystem::path& recording);

}  // namespace sqslam
