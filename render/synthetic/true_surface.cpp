#include "render/synthetic/true_surface.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <opencv2/core/utility.hpp>
#include <set>

#include "slam/geometry/span_in_box.h"
#include "slam/util/atomic_file.h"
#include "slam/util/thinned.h"

namespace sqslam {
namespace {

constexpr double kMinDistance = 0.05;  // metres from the camera, as in the pictures
constexpr double kMaxDistance = 30.0;

// Returns where a ray (object frame, t in lengths of `way`) enters a solid before `end`. RadialScale is a
// norm and thus convex along the ray: from outside, Newton's method does not pass the surface if it takes the
// slope just behind the present point.
std::optional<double> EntryInto(const Superquadric& shape, const Eigen::Vector3d& start,
                                const Eigen::Vector3d& way, double end) {
  constexpr double kTolerance = 1e-7;
  constexpr double kSlopeStep = 1e-7;
  constexpr int kMaxSteps = 60;
  const Eigen::Vector3d low = -shape.half_size;
  const auto span = SpanInBox(start, way, low, shape.half_size, end);
  const auto height = [&](double t) { return shape.RadialScale(start + t * way) - 1.0; };
  if (!span || height(span->begin) < -kTolerance) {  // misses the bounding box, or begins inside
    return std::nullopt;
  }
  double t = span->begin;
  for (int i = 0; i < kMaxSteps && t <= span->end; ++i) {
    const double above = height(t);
    if (above < kTolerance) {
      return t;
    }
    const double slope = (above - height(t - kSlopeStep)) / kSlopeStep;
    if (slope >= 0.0) {
      return std::nullopt;
    }
    t -= above / slope;
  }
  return std::nullopt;
}

// A hit along a ray: distance, and normal in the world frame.
struct Hit {
  double distance = kMaxDistance;
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
};

void HitBody(const SceneBody& body, const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
             Hit& first) {
  const auto& [shape, T_world_object] = body.superquadric;
  const double along = (T_world_object.translation - origin).dot(direction);
  const double apart2 = (origin + along * direction - T_world_object.translation).squaredNorm();
  if (apart2 > shape.half_size.squaredNorm()) {
    return;
  }
  const Eigen::Vector3d start = T_world_object.Inverse() * origin;
  const Eigen::Vector3d way = T_world_object.rotation.conjugate() * direction;
  const auto entry = EntryInto(shape, start, way, first.distance);
  if (entry && *entry > kMinDistance) {
    const Eigen::Vector3d gradient = shape.RadialDistanceWithGradient(start + *entry * way).by_point;
    first = {*entry, (T_world_object.rotation * gradient).normalized()};
  }
}

void HitPanel(const ScenePanel& panel, const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
              Hit& first) {
  const Eigen::Vector3d normal = panel.edge_u.cross(panel.edge_v).normalized();
  const double distance = (panel.corner - origin).dot(normal) / direction.dot(normal);
  if (direction.dot(normal) >= 0.0 || distance <= kMinDistance || distance >= first.distance) {
    return;
  }
  Eigen::Matrix<double, 3, 2> edges;
  edges << panel.edge_u, panel.edge_v;
  const Eigen::Vector2d place = (edges.transpose() * edges).inverse() *
                                (edges.transpose() * (origin + distance * direction - panel.corner));
  if (place.minCoeff() >= 0.0 && place.maxCoeff() <= 1.0) {
    first = {distance, normal};
  }
}

}  // namespace

std::optional<TruePoint> CastRay(const SceneDescription& scene, const Eigen::Vector3d& origin,
                                 const Eigen::Vector3d& direction) {
  const Eigen::Vector3d unit = direction.normalized();
  Hit first;
  for (const ScenePanel& panel : scene.panels) {
    HitPanel(panel, origin, unit, first);
  }
  for (const SceneBody& body : scene.bodies) {
    HitBody(body, origin, unit, first);
  }
  return first.distance < kMaxDistance
             ? std::optional(TruePoint{origin + first.distance * unit, first.normal})
             : std::nullopt;
}

std::vector<TruePoint> SeenSurface(const SceneDescription& scene, const std::vector<Rigid3d>& poses) {
  constexpr std::size_t kFrameStep = 12;
  constexpr std::size_t kMaxFrames = 40;
  constexpr int kPixelStep = 4;
  constexpr double kMaxRays = 20000.0;  // of a frame
  constexpr double kSpacing = 0.007;    // metres
  const Camera& camera = scene.camera;
  const std::size_t frame_step = std::max(kFrameStep, StepThrough(poses.size(), kMaxFrames));
  const int step = std::max(
      kPixelStep, static_cast<int>(std::ceil(std::sqrt(1.0 * camera.width * camera.height / kMaxRays))));
  const int columns = (camera.width + step - 1) / step;
  std::vector<std::optional<TruePoint>> hits(
      static_cast<std::size_t>(columns * ((camera.height + step - 1) / step)));
  std::set<std::array<std::int64_t, 3>> taken;
  std::vector<TruePoint> points;
  for (std::size_t frame = 0; frame < poses.size(); frame += frame_step) {
    const Rigid3d& pose = poses[frame];
    cv::parallel_for_(cv::Range(0, static_cast<int>(hits.size())), [&](const cv::Range& range) {
      for (int i = range.start; i < range.end; ++i) {
        const Eigen::Vector2d pixel(i % columns * step, i / columns * step);  // NOLINT: whole rows
        hits[static_cast<std::size_t>(i)] =
            CastRay(scene, pose.translation, pose.rotation * camera.Unproject(camera.Undistort(pixel)));
      }
    });
    for (const std::optional<TruePoint>& hit : hits) {
      if (hit) {
        const Eigen::Array3d cube = (hit->position.array() / kSpacing).floor();
        if (taken.insert({std::int64_t(cube.x()), std::int64_t(cube.y()), std::int64_t(cube.z())}).second) {
          points.push_back(*hit);
        }
      }
    }
  }
  return points;
}

void WriteSurface(const std::filesystem::path& path, const std::vector<TruePoint>& points) {
  std::string ply = fmt::format(
      "ply\nformat binary_little_endian 1.0\ncomment true surface points, world frame, m\n"
      "element vertex {}\nproperty float x\nproperty float y\nproperty float z\n"
      "property float nx\nproperty float ny\nproperty float nz\nend_header\n",
      points.size());
  for (const TruePoint& point : points) {
    Eigen::Matrix<float, 6, 1> numbers;
    numbers << point.position.cast<float>(), point.normal.cast<float>();
    ply.append(reinterpret_cast<const char*>(numbers.data()), sizeof(float) * 6);
  }
  WriteFileAtomically(path, ply);
}

}  // namespace sqslam
