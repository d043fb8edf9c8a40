#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "slam/map/map.h"
#include "slam/objects/gravity.h"
#include "slam/objects/object_mapper.h"
#include "slam/objects/support.h"

namespace sqslam {

// Keeps the map upright: estimates the direction of its z axis and the rotation that aligns it.
class UprightEstimator {
 public:
  // `gravity`: auto | level-start | [x, y, z] (direction of gravity in the first camera). Throws UsageError.
  UprightEstimator(const std::string& gravity, const GravityOptions& options, std::uint64_t seed);

  // Call after each keyframe. Returns the rotation T_new_old that the map needs, if any. `last`: no keyframe
  // will follow. The map frame starts as the first camera's frame.
  std::optional<Rigid3d> Update(const Map& map, const ObjectMapper& objects, const Camera& camera, bool last);

  // Returns the surfaces that objects may stand on; none before the up direction is known.
  SupportSurfaces FindSurfaces(const Map& map) const;

  bool Known() const { return known_; }
  std::optional<double> SupportHeight() const { return support_height_; }

  static void VisitState(auto& self, auto&& visit) {
    visit(self.known_, self.evidence_, self.support_height_);
  }

 private:
  // Finds the plane that objects stand on, or a plane perpendicular to the vertical edges of many objects.
  std::optional<SupportPlane> FindPlane(const Map& map, std::span<const Rigid3d> poses,
                                        const ObjectMapper& objects, const Camera& camera) const;
  std::optional<Rigid3d> UpdateFromMap(const Map& map, const ObjectMapper& objects, const Camera& camera,
                                       bool last);

  std::optional<Eigen::Vector3d> given_up_;  // in the first camera's frame; empty: estimated from the map
  GravityOptions options_;
  std::uint64_t seed_;
  bool known_ = false;
  double evidence_ = 0.0;  // of the best estimate so far
  std::optional<double> support_height_;
};

}  // namespace sqslam
