#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "slam/evaluation/ground_truth.h"

namespace sqslam {

// The surfaces in the ground truth of a scene: solids, and the planes on which they stand, each within the
// hull of their footprints. World frame, metres.
class KnownSurfaces {
 public:
  // The surface of solids with a hull_fill below `min_hull_fill` counts as unknown. `objects` must outlive
  // this.
  KnownSurfaces(const std::vector<GroundTruthObject>& objects, double min_hull_fill);

  // Position of a point relative to the surface that a ray hits first.
  struct Miss {
    double distance = 0.0;                      // to the surface; negative inside a solid
    const GroundTruthObject* object = nullptr;  // null: a plane on which solids stand
  };

  // Empty if the ray hits nothing, or a surface that is not known well enough.
  std::optional<Miss> MissOf(const Eigen::Vector3d& origin, const Eigen::Vector3d& ray,
                             const Eigen::Vector3d& p_world) const;

  // Returns the points of a cloud on the table top: at most 30 mm above or below, except for its border and
  // the footprints of the solids on it, each with a margin of 20 mm. The top is that of the widest cuboid
  // labelled dining_table or, without one, the plane on which most of the solids stand (three or more). Empty
  // without a table.
  std::vector<Eigen::Vector3d> OnTable(const std::vector<Eigen::Vector3d>& cloud) const;

 private:
  // A plane on which solids stand: up . p = height.
  struct StandPlane {
    double height = 0.0;
    int solids = 0;
    std::vector<cv::Point2f> footprints;  // corners, along the plane's axes
    std::vector<cv::Point2f> hull;
  };

  cv::Point2f OnPlane(const Eigen::Vector3d& p) const;
  bool Within(const StandPlane& plane, const Eigen::Vector3d& p, double margin = 0.0) const;
  std::vector<cv::Point2f> Footprint(const Solid& solid) const;
  double Bottom(const Solid& solid) const;
  void AddFootprint(const Solid& solid);
  double DistanceToPlanes(double hit, double height) const;
  bool StandsOver(const Solid& solid, const StandPlane& plane, const Eigen::Vector3d& p, double margin) const;
  std::optional<StandPlane> Table() const;

  const std::vector<GroundTruthObject>& objects_;
  double min_hull_fill_;
  Eigen::Vector3d up_ = Eigen::Vector3d::UnitZ();
  Eigen::Vector3d along_ = Eigen::Vector3d::UnitX();
  Eigen::Vector3d across_ = Eigen::Vector3d::UnitY();
  std::vector<StandPlane> planes_;
};

}  // namespace sqslam
