#include "render/solids/solid_image.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "render/solids/tessellation.h"

namespace sqslam {
namespace {

constexpr int kSegments = 96;       // chords deviate by at most 0.05 % of a half axis
constexpr double kMinDepth = 1e-6;  // map units

// A corner of a triangle in the picture.
struct SeenCorner {
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  double inverse_depth = 0.0;  // linear over the picture; 0: not drawn
};

double Cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

void FillTriangle(const std::array<SeenCorner, 3>& corners, int number, SolidImage& image) {
  const auto& [a, b, c] = corners;
  const double area = Cross(b.pixel - a.pixel, c.pixel - a.pixel);
  if (area == 0.0) {
    return;
  }
  const Eigen::Vector2d low = a.pixel.cwiseMin(b.pixel).cwiseMin(c.pixel).cwiseMax(0.0);
  const Eigen::Vector2d last(image.number.cols - 1, image.number.rows - 1);
  const Eigen::Vector2d high = a.pixel.cwiseMax(b.pixel).cwiseMax(c.pixel).cwiseMin(last);
  for (int y = static_cast<int>(std::ceil(low.y())); y <= high.y(); ++y) {
    for (int x = static_cast<int>(std::ceil(low.x())); x <= high.x(); ++x) {
      const Eigen::Vector2d at(x, y);
      const double of_b = Cross(at - a.pixel, c.pixel - a.pixel) / area;
      const double of_c = Cross(b.pixel - a.pixel, at - a.pixel) / area;
      if (of_b < 0.0 || of_c < 0.0 || of_b + of_c > 1.0) {
        continue;
      }
      const double inverse = a.inverse_depth + of_b * (b.inverse_depth - a.inverse_depth) +
                             of_c * (c.inverse_depth - a.inverse_depth);
      if (const auto depth = static_cast<float>(1.0 / inverse); depth < image.depth(y, x)) {
        image.depth(y, x) = depth;
        image.number(y, x) = number;
      }
    }
  }
}

}  // namespace

SolidImage RasterizeSolids(std::span<const PosedSuperquadric> solids, const Camera& camera,
                           const Rigid3d& T_map_camera,
                           const std::function<bool(const Eigen::Vector3d&)>& keeps) {
  SolidImage image{cv::Mat1i(camera.height, camera.width, -1),
                   cv::Mat1f(camera.height, camera.width, std::numeric_limits<float>::infinity())};
  const Rigid3d T_camera_map = T_map_camera.Inverse();
  for (std::size_t i = 0; i < solids.size(); ++i) {
    const TriangleMesh mesh = Tessellate(solids[i].shape, kSegments);
    std::vector<SeenCorner> corners(mesh.vertices.size());
    for (std::size_t k = 0; k < corners.size(); ++k) {
      const Eigen::Vector3d p_map = solids[i].T_map_object * mesh.vertices[k].cast<double>();
      const Eigen::Vector3d p = T_camera_map * p_map;
      if (p.z() > kMinDepth && (!keeps || keeps(p_map))) {
        corners[k] = {camera.Project(p), 1.0 / p.z()};
      }
    }
    for (const auto& triangle : mesh.triangles) {
      std::array<SeenCorner, 3> seen;
      std::ranges::transform(triangle, seen.begin(),
                             [&](std::int32_t k) { return corners[static_cast<std::size_t>(k)]; });
      if (std::ranges::all_of(seen, [](const SeenCorner& corner) { return corner.inverse_depth > 0.0; })) {
        FillTriangle(seen, static_cast<int>(i), image);
      }
    }
  }
  return image;
}

}  // namespace sqslam
