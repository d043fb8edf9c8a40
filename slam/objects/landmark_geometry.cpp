#include "slam/objects/landmark_geometry.h"

#include <algorithm>
#include <cmath>

namespace sqslam {
namespace {

// Computes the smallest or largest u = x / z (axis 0) or y / z (axis 1) of the solid, which lies in front of
// the camera. The distance beyond the plane x = u z, max over the solid of sign * (x - u z), is convex in u
// with the depth of the farthest point as its slope (up to sign), so Newton's step goes to the u of that
// point. It approaches the extreme from inside and never overshoots.
double SilhouetteExtreme(const PosedSuperquadric& superquadric, const Rigid3d& T_camera_object,
                         const Eigen::Matrix3d& R_camera_object, int axis, double sign) {
  constexpr int kMaxSteps = 30;
  constexpr double kPrecise = 1e-8;  // of the tangent of the viewing angle
  const Eigen::Vector3d& centre = T_camera_object.translation;
  double u = centre[axis] / centre.z();
  for (int i = 0; i < kMaxSteps; ++i) {
    const Eigen::Vector3d n = sign * (R_camera_object.row(axis) - u * R_camera_object.row(2)).transpose();
    const Eigen::Vector3d p = centre + R_camera_object * superquadric.shape.SupportPoint(n);
    const double next = p[axis] / p.z();
    const double step = sign * (next - u);
    u = next;
    if (step < kPrecise) {
      break;
    }
  }
  return u;
}

// `bounds`: left, top, right, bottom.
Box2d ClipTo(const std::array<double, 4>& bounds, const Box2d& box) {
  std::array<double, 4> edges = box.Edges();
  for (std::size_t i = 0; i < 4; ++i) {
    edges[i] = std::clamp(edges[i], bounds[i % 2], bounds[i % 2 + 2]);
  }
  return Box2d::FromEdges(edges);
}

// True if the axis-aligned bounding boxes in the map frame do not overlap.
bool AreFarApart(const PosedSuperquadric& a, const PosedSuperquadric& b) {
  const Eigen::Vector3d reach_a = a.T_map_object.RotationMatrix().cwiseAbs() * a.shape.half_size;
  const Eigen::Vector3d reach_b = b.T_map_object.RotationMatrix().cwiseAbs() * b.shape.half_size;
  const Eigen::Vector3d distance = (a.T_map_object.translation - b.T_map_object.translation).cwiseAbs();
  return ((distance - reach_a - reach_b).array() > 0.0).any();
}

}  // namespace

std::optional<Box2d> ProjectToBox(const PosedSuperquadric& superquadric, const Rigid3d& T_map_camera,
                                  const Camera& camera) {
  const Rigid3d T_camera_object = T_map_camera.Inverse() * superquadric.T_map_object;
  const Eigen::Vector3d forward = T_camera_object.rotation.conjugate() * Eigen::Vector3d::UnitZ();
  if (T_camera_object.translation.z() - superquadric.shape.SupportExtent(forward) <= 1e-6) {
    return std::nullopt;
  }
  const Eigen::Matrix3d R = T_camera_object.RotationMatrix();
  const auto extreme = [&](int axis, double sign) {
    return SilhouetteExtreme(superquadric, T_camera_object, R, axis, sign);
  };
  const double left = camera.fx * extreme(0, -1.0) + camera.cx;
  const double right = camera.fx * extreme(0, 1.0) + camera.cx;
  const double top = camera.fy * extreme(1, -1.0) + camera.cy;
  const double bottom = camera.fy * extreme(1, 1.0) + camera.cy;
  return Box2d::FromEdges({left, top, right, bottom});
}

std::optional<Box2d> ProjectToBox(const PosedSuperquadric& hull, std::span<const SolidPart> parts,
                                  const Rigid3d& T_map_camera, const Camera& camera) {
  if (parts.empty()) {
    return ProjectToBox(hull, T_map_camera, camera);
  }
  std::optional<Box2d> around;
  for (const SolidPart& part : parts) {
    const std::optional<Box2d> box = ProjectToBox(PlacedIn(hull, part), T_map_camera, camera);
    if (!box) {
      return std::nullopt;
    }
    if (around) {
      const std::array<double, 4> a = around->Edges(), b = box->Edges();
      around = Box2d::FromEdges(
          {std::min(a[0], b[0]), std::min(a[1], b[1]), std::max(a[2], b[2]), std::max(a[3], b[3])});
    } else {
      around = box;
    }
  }
  return around;
}

double LogSizeSigma(const Superquadric& shape, const Eigen::Matrix<double, 9, 9>& covariance) {
  return std::sqrt(covariance.diagonal().segment<3>(3).cwiseQuotient(shape.half_size.cwiseAbs2()).mean());
}

Box2d ClipToImage(const Box2d& box, const Camera& camera) {
  return ClipTo({0.0, 0.0, static_cast<double>(camera.width), static_cast<double>(camera.height)}, box);
}

Box2d ClipToShown(const Box2d& box, const Camera& camera) { return ClipTo(camera.ShownBounds(), box); }

Box2d UndistortBox(const Box2d& box, const Camera& camera) {
  return !camera.HasDistortion()
             ? box
             : MoveEdges(box, [&](const Eigen::Vector2d& pixel) { return camera.Undistort(pixel); });
}

Box2d DistortBox(const Box2d& box, const Camera& camera) {
  return !camera.HasDistortion() ? box : MoveEdges(box, [&](const Eigen::Vector2d& pixel) {
    return camera.ProjectDistorted(camera.Unproject(pixel));
  });
}

Box2d Continued(const Box2d& box, const std::array<bool, 4>& edge_free, const Box2d& projected) {
  std::array<double, 4> edges = box.Edges();
  const std::array<double, 4> farther = projected.Edges();
  for (std::size_t i = 0; i < 4; ++i) {
    if (!edge_free[i]) {
      edges[i] = i < 2 ? std::min(edges[i], farther[i]) : std::max(edges[i], farther[i]);
    }
  }
  return Box2d::FromEdges(edges);
}

std::array<double, 4> NormalisedBounds(const Box2d& box, const Camera& camera) {
  const auto [left, top, right, bottom] = box.Edges();
  return {(left - camera.cx) / camera.fx, (top - camera.cy) / camera.fy, (right - camera.cx) / camera.fx,
          (bottom - camera.cy) / camera.fy};
}

namespace {

// Repeated test whether points, in units of the half sizes, lie in a solid. Evaluates powers only between
// simple inner and outer bounds.
class Interior {
 public:
  explicit Interior(const Superquadric& shape)
      : unit_{Eigen::Vector3d::Ones(), shape.e1, shape.e2},
        holds_ball_(std::max(shape.e1, shape.e2) <= 1.0),
        in_ball_(std::min(shape.e1, shape.e2) >= 1.0) {}

  bool Contains(const Eigen::Vector3d& unit) const {
    const Eigen::Vector3d p = unit.cwiseAbs();
    const double square = p.squaredNorm();
    if (p.maxCoeff() > 1.0 || (in_ball_ && square > 1.0)) {
      return false;
    }
    return p.sum() <= 1.0 || (holds_ball_ && square <= 1.0) || unit_.RadialScale(p) <= 1.0;
  }

 private:
  Superquadric unit_;
  bool holds_ball_;
  bool in_ball_;
};

}  // namespace

double OverlapOfSmaller(const PosedSuperquadric& a, const PosedSuperquadric& b, int samples) {
  const bool a_smaller = a.shape.Volume() <= b.shape.Volume();
  const PosedSuperquadric& small = a_smaller ? a : b;
  const PosedSuperquadric& large = a_smaller ? b : a;
  if (AreFarApart(a, b)) {
    return 0.0;
  }
  const Rigid3d T_large_small = large.T_map_object.Inverse() * small.T_map_object;
  const Eigen::Matrix3d R = large.shape.half_size.cwiseInverse().asDiagonal() *
                            T_large_small.RotationMatrix() * small.shape.half_size.asDiagonal();
  const Eigen::Vector3d t = T_large_small.translation.cwiseQuotient(large.shape.half_size);
  const Interior in_small(small.shape);
  const Interior in_large(large.shape);
  // The grid has the symmetry of the solid, so one octant is enough to find the points inside.
  const int half = std::max(1, samples / 2);
  int inside_small = 0;
  int inside_both = 0;
  for (int i = 0; i < half * half * half; ++i) {
    const Eigen::Vector3d cell(i % half, (i / half) % half, i / (half * half));
    const Eigen::Vector3d p = (cell.array() + 0.5) / half;
    if (!in_small.Contains(p)) {
      continue;
    }
    for (int octant = 0; octant < 8; ++octant) {
      const Eigen::Vector3d signs((octant & 1) != 0 ? -1.0 : 1.0, (octant & 2) != 0 ? -1.0 : 1.0,
                                  (octant & 4) != 0 ? -1.0 : 1.0);
      ++inside_small;
      inside_both += in_large.Contains(R * signs.cwiseProduct(p) + t) ? 1 : 0;
    }
  }
  return inside_small > 0 ? static_cast<double>(inside_both) / inside_small : 0.0;
}

bool MayBeInView(const PosedSuperquadric& superquadric, const Rigid3d& T_map_camera, const Camera& camera) {
  const Eigen::Vector3d p = T_map_camera.Inverse() * superquadric.T_map_object.translation;
  const double radius = superquadric.shape.half_size.norm();
  const auto [left, top, right, bottom] = camera.ShownBounds();
  const auto beyond = [&](double offset, double edge) {  // the plane offset = edge * z
    return (offset - edge * p.z()) / std::hypot(1.0, edge) > radius;
  };
  return p.z() > 0.0 && !beyond(p.x(), (right - camera.cx) / camera.fx) &&
         !beyond(-p.x(), (camera.cx - left) / camera.fx) &&
         !beyond(p.y(), (bottom - camera.cy) / camera.fy) && !beyond(-p.y(), (camera.cy - top) / camera.fy);
}

PosedSuperquadric StretchedTo(PosedSuperquadric superquadric, double height) {
  Eigen::Vector3d& centre = superquadric.T_map_object.translation;
  const double top = std::max(centre.z() + superquadric.shape.half_size.z(),
                              height + 1e-3 * superquadric.shape.half_size.norm());
  superquadric.shape.half_size.z() = 0.5 * (top - height);
  centre.z() = 0.5 * (top + height);
  return superquadric;
}

}  // namespace sqslam
