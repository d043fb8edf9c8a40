#include "slam/objects/tapered_solid.h"

#include <algorithm>
#include <cmath>

#include "slam/geometry/superquadric_norm.h"

namespace sqslam {

TaperedSupport::TaperedSupport(const Eigen::Vector3d& u, double taper, double p1, double p2) {
  const SuperquadricNorm<PNormWithSlope> end({taper * u.x(), taper * u.y(), u.z()}, p1, p2);
  if (taper < 1.0) {
    const PNormWithSlope middle(u.x(), u.y(), p2);
    if (middle.value > end.Value()) {
      value = middle.value;
      by_u = {middle.by_x, middle.by_y, 0.0};
      by_p2 = middle.by_p;
      return;
    }
  }
  value = end.Value();
  by_u = end.Gradient().cwiseProduct(Eigen::Vector3d(taper, taper, 1.0));
  by_log_taper = by_u.head<2>().dot(u.head<2>());
  by_p1 = end.whole.by_p;
  by_p2 = end.whole.by_x * end.section.by_p;
}

TaperedWidth::TaperedWidth(double z, double half, double taper) {
  const double height = std::min(1.0, std::abs(z) / half);
  value = 1.0 - (1.0 - taper) * height;
  by_log_taper = taper * height;
  if (height < 1.0) {
    by_z = std::copysign(1.0, z) * (taper - 1.0) / half;
    by_log_half = (1.0 - taper) * height;
  }
}

}  // namespace sqslam
