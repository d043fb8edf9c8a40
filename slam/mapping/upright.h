#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "slam/map/map.h"
#include "slam/objects/gravity.h"
#include "slam/objects/object_types.h"
#include "slam/objects/support.h"

namespace sqslam {

// Keeps the map upright: finds the direction that its z axis should have, and the turn that takes it there.
class UprightEstimator {
 public:
  // `gravity`: auto | level-start | [x, y, z] (direction of gravity in the first camera). Throws UsageError.
  UprightEstimator(const std::string& gravity, const GravityOptions& options, std::uint64_t seed);

  // After a keyframe: the turn T_new_old that the map needs, if any; `last`: no keyframe will follow. The map
  // frame begins as the first camera's frame.
  std::optional<Rigid3d> Update(const Map& map, std::span<const ObjectLandmarkView> objects, bool last);

  // Surfaces that things may stand on; none before the up direction is known.
  SupportSurfaces FindSurfaces(const Map& map) const;

  bool Known() const { return known_; }
  std::optional<double> SupportHeight() const { return support_height_; }

  template <typename Self, typename Visit>
  static void VisitState(Self& self, Visit&& visit) {
    visit(self.known_, self.evidence_, self.support_height_);
  }

 private:
  std::optional<Rigid3d> UpdateFromMap(const Map& map, std::span<const ObjectLandmarkView> objects,
                                       bool last);

  std::optional<Eigen::Vector3d> given_up_;  // in the first camera's frame; empty: from the map
  GravityOptions options_;
  std::uint64_t seed_;
  bool known_ = false;
  double evidence_ = 0.0;  // evidence of the best estimate so far
  std::optional<double> support_height_;
};

}  // namespace sqslam
