#include "render/synthetic/textured_mesh.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/core/utility.hpp>

#include "slam/geometry/span_in_box.h"

namespace sqslam {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kObjectPixelsPerMetre = 1400.0;
constexpr double kFurniturePixelsPerMetre = 600.0;
constexpr double kHiddenPixelsPerMetre = 100.0;  // undersides
constexpr double kPanelPixelsPerMetre = 700.0;
constexpr double kMaxTextureSide = 2048.0;  // pixels per side

// Applies display gamma to light, as it multiplies textures stored with that gamma.
std::array<std::uint8_t, 3> EncodeLight(const Eigen::Vector3d& irradiance) {
  std::array<std::uint8_t, 3> encoded{};
  for (int i = 0; i < 3; ++i) {
    const double value = std::pow(std::clamp(irradiance[i], 0.0, 1.0), 1.0 / 2.2);
    encoded[static_cast<std::size_t>(i)] = static_cast<std::uint8_t>(std::lround(255.0 * value));
  }
  return encoded;
}

void AddLight(const SceneLighting& lighting, TexturedMesh& mesh) {
  mesh.light.resize(mesh.vertices.size());
  cv::parallel_for_(cv::Range(0, static_cast<int>(mesh.vertices.size())), [&](const cv::Range& range) {
    for (int i = range.start; i < range.end; ++i) {
      const auto k = static_cast<std::size_t>(i);
      mesh.light[k] =
          EncodeLight(lighting.IrradianceAt(mesh.vertices[k].cast<double>(), mesh.normals[k].cast<double>()));
    }
  });
}

cv::Mat PaintFor(const TextureDescription& texture, double width, double height, double pixels_per_metre,
                 int variation) {
  const double scale = std::min(pixels_per_metre, kMaxTextureSide / std::max(width, height));
  return PaintTexture(texture, std::max(width, 0.01), std::max(height, 0.01), scale, variation);
}

// Returns ordered samples that are dense at corners (for the silhouette) and on flat sides (for the light).
std::vector<SuperellipsePoint> DenseSamples(double e, double first, double last, int segments) {
  std::vector<SuperellipsePoint> samples = SampleUniformInParameter(e, first, last, segments);
  const std::vector<SuperellipsePoint> flat = SampleUniformInPolarAngle(e, first, last, segments);
  samples.insert(samples.end() - 1, flat.begin() + 1, flat.end() - 1);
  const auto angle = [](const SuperellipsePoint& p) { return std::atan2(p.y, p.x); };
  std::sort(samples.begin() + 1, samples.end() - 1,
            [&](const auto& a, const auto& b) { return angle(a) < angle(b); });
  return samples;
}

// Returns the arc length at each sample of the polyline scaled by (scale_x, scale_y).
std::vector<double> ArcLengths(const std::vector<SuperellipsePoint>& samples, double scale_x,
                               double scale_y) {
  std::vector<double> lengths(samples.size(), 0.0);
  for (std::size_t i = 1; i < samples.size(); ++i) {
    lengths[i] = lengths[i - 1] + std::hypot(scale_x * (samples[i].x - samples[i - 1].x),
                                             scale_y * (samples[i].y - samples[i - 1].y));
  }
  return lengths;
}

struct BodySamples {
  std::vector<SuperellipsePoint> profile;
  std::vector<SuperellipsePoint> section;
  std::vector<double> along_section;  // metres, at the equator
  std::vector<double> along_profile;  // metres
};

enum class Chart { kBottom, kLateral, kTop };

TexturedMesh BuildChart(const SceneBody& body, const SceneLighting& lighting, const BodySamples& samples,
                        Chart chart, std::size_t first, std::size_t last) {
  const Superquadric& shape = body.superquadric.shape;
  const Rigid3d& T_world_object = body.superquadric.T_map_object;
  const bool side = chart == Chart::kLateral;
  const double width = side ? samples.along_section.back() : 2.0 * shape.half_size.x();
  const double height =
      side ? samples.along_profile[last] - samples.along_profile[first] : 2.0 * shape.half_size.y();
  TexturedMesh mesh;
  mesh.id = body.id;
  for (std::size_t row = first; row <= last; ++row) {
    for (std::size_t column = 0; column < samples.section.size(); ++column) {
      const SuperellipsePoint& p = samples.profile[row];
      const SuperellipsePoint& q = samples.section[column];
      const Eigen::Vector3d p_object = SurfacePoint(shape, p, q);
      const Eigen::Vector3d from_above =
          Eigen::Vector3d::Constant(0.5) + 0.5 * p_object.cwiseQuotient(shape.half_size);
      const Eigen::Vector2d unrolled(samples.along_section[column] / width,
                                     (samples.along_profile[row] - samples.along_profile[first]) / height);
      mesh.vertices.push_back((T_world_object * p_object).cast<float>());
      mesh.normals.push_back((T_world_object.rotation * SurfaceNormal(shape, p, q)).cast<float>());
      mesh.texture_coordinates.push_back((side ? unrolled : from_above.head<2>().eval()).cast<float>());
    }
  }
  AppendGridTriangles(last - first + 1, samples.section.size(), false, mesh);
  AddLight(lighting, mesh);
  const double detail = body.id > 0 ? kObjectPixelsPerMetre : kFurniturePixelsPerMetre;
  mesh.texture = PaintFor(body.texture, width, height,
                          chart == Chart::kBottom ? kHiddenPixelsPerMetre : detail, static_cast<int>(chart));
  return mesh;
}

// Returns the first row of the top cap, where the normal is more than about 50 degrees above the horizon.
std::size_t CapRow(const BodySamples& samples, const Superquadric& shape) {
  constexpr double kSlope = 1.2;
  const double radius = 0.5 * (shape.half_size.x() + shape.half_size.y());
  for (std::size_t row = samples.profile.size() / 2; row + 1 < samples.profile.size(); ++row) {
    const SuperellipsePoint& p = samples.profile[row];
    if (p.normal_y / shape.half_size.z() > kSlope * p.normal_x / radius) {
      return row;
    }
  }
  return samples.profile.size() - 2;
}

constexpr int kLampSamples = 5;        // per side
constexpr int kAmbientSamples = 20;    // directions in the hemisphere
constexpr double kAmbientReach = 0.5;  // metres; bodies farther away do not dim ambient light
constexpr double kLift = 2e-3;         // metres; offset to avoid self-shadowing

// Returns true if the segment from a to b (object frame) enters the body. The radial scale is a norm and thus
// convex along the segment: a golden-section search finds its minimum.
bool Enters(const Superquadric& shape, const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  const Eigen::Vector3d d = b - a;
  const Eigen::Vector3d low = -shape.half_size;
  const auto span = SpanInBox(a, d, low, shape.half_size, 1.0);
  if (!span) {
    return false;
  }
  auto [begin, end, axis] = *span;
  constexpr double kGolden = 0.381966;
  double left = begin + kGolden * (end - begin);
  double right = end - kGolden * (end - begin);
  double f_left = shape.RadialScale(a + left * d);
  double f_right = shape.RadialScale(a + right * d);
  for (int i = 0; i < 10; ++i) {
    if (std::min(f_left, f_right) < 1.0) {
      return true;
    }
    if (f_left < f_right) {
      end = right;
      right = left;
      f_right = f_left;
      left = begin + kGolden * (end - begin);
      f_left = shape.RadialScale(a + left * d);
    } else {
      begin = left;
      left = right;
      f_left = f_right;
      right = end - kGolden * (end - begin);
      f_right = shape.RadialScale(a + right * d);
    }
  }
  return std::min(f_left, f_right) < 1.0;
}

// Returns direction i of n of a cosine-weighted hemisphere about z (Fibonacci spiral).
Eigen::Vector3d HemisphereDirection(int i, int n) {
  const double radius = std::sqrt((i + 0.5) / n);
  const double angle = 2.0 * std::numbers::pi * std::fmod(i * 0.6180339887, 1.0);
  return {radius * std::cos(angle), radius * std::sin(angle), std::sqrt(1.0 - radius * radius)};
}

}  // namespace

std::vector<TexturedMesh> BuildBody(const SceneBody& body, const SceneLighting& lighting) {
  const int segments = body.id > 0 ? 48 : 24;
  const Superquadric& shape = body.superquadric.shape;
  BodySamples samples;
  samples.profile = DenseSamples(shape.e1, -0.5 * kPi, 0.5 * kPi, segments / 2);
  samples.section = DenseSamples(shape.e2, -kPi, kPi, segments);
  samples.along_section = ArcLengths(samples.section, shape.half_size.x(), shape.half_size.y());
  samples.along_profile =
      ArcLengths(samples.profile, 0.5 * (shape.half_size.x() + shape.half_size.y()), shape.half_size.z());
  const std::size_t top = CapRow(samples, shape);
  const std::size_t bottom = samples.profile.size() - 1 - top;
  return {BuildChart(body, lighting, samples, Chart::kBottom, 0, bottom),
          BuildChart(body, lighting, samples, Chart::kLateral, bottom, top),
          BuildChart(body, lighting, samples, Chart::kTop, top, samples.profile.size() - 1)};
}

TexturedMesh BuildPanel(const ScenePanel& panel, const SceneLighting& lighting) {
  const double width = panel.edge_u.norm();
  const double height = panel.edge_v.norm();
  const int columns = std::max(2, static_cast<int>(std::ceil(width / panel.shading_step)) + 1);
  const int rows = std::max(2, static_cast<int>(std::ceil(height / panel.shading_step)) + 1);
  const Eigen::Vector3d normal = panel.edge_u.cross(panel.edge_v).normalized();
  TexturedMesh mesh;
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      const double s = static_cast<double>(column) / (columns - 1);
      const double t = static_cast<double>(row) / (rows - 1);
      mesh.vertices.push_back((panel.corner + s * panel.edge_u + t * panel.edge_v).cast<float>());
      mesh.normals.push_back(normal.cast<float>());
      mesh.texture_coordinates.emplace_back(static_cast<float>(s), static_cast<float>(t));
    }
  }
  AppendGridTriangles(static_cast<std::size_t>(rows), static_cast<std::size_t>(columns), false, mesh);
  AddLight(lighting, mesh);
  mesh.texture = PaintFor(panel.texture, width, height, kPanelPixelsPerMetre, 0);
  return mesh;
}

SceneLighting::SceneLighting(const SceneDescription& scene) : scene_(scene) {
  for (const SceneBody& body : scene.bodies) {
    occluders_.push_back({body.superquadric.shape, body.superquadric.T_map_object.Inverse(),
                          body.superquadric.T_map_object.translation,
                          body.superquadric.shape.half_size.squaredNorm()});
  }
}

bool SceneLighting::Blocked(const Eigen::Vector3d& from, const Eigen::Vector3d& to) const {
  const Eigen::Vector3d ray = to - from;
  const double length2 = ray.squaredNorm();
  return std::ranges::any_of(occluders_, [&](const Occluder& occluder) {
    const Eigen::Vector3d offset = occluder.center - from;
    const double t = std::clamp(offset.dot(ray) / length2, 0.0, 1.0);
    return (offset - t * ray).squaredNorm() < occluder.radius2 &&
           Enters(occluder.shape, occluder.T_object_world * from, occluder.T_object_world * to);
  });
}

Eigen::Vector3d SceneLighting::IrradianceAt(const Eigen::Vector3d& p_world,
                                            const Eigen::Vector3d& normal) const {
  const Eigen::Vector3d origin = p_world + kLift * normal;
  Eigen::Vector3d irradiance = Eigen::Vector3d::Zero();
  for (const SceneLight& light : scene_.lights) {
    const Eigen::Vector3d area = 4.0 * light.half_u.cross(light.half_v);
    double sum = 0.0;
    for (int i = 0; i < kLampSamples * kLampSamples; ++i) {
      const double s = 2.0 * (i % kLampSamples + 0.5) / kLampSamples - 1.0;
      const double t = 2.0 * (i / kLampSamples + 0.5) / kLampSamples - 1.0;  // NOLINT: whole rows
      const Eigen::Vector3d lamp = light.center + s * light.half_u + t * light.half_v;
      const Eigen::Vector3d ray = lamp - origin;
      const double distance2 = ray.squaredNorm();
      const double cosines = normal.dot(ray) * std::max(0.0, -area.dot(ray)) / distance2;
      if (cosines > 0.0 && !Blocked(origin, lamp)) {
        sum += cosines / distance2;
      }
    }
    irradiance += light.rgb * (sum / (kLampSamples * kLampSamples));
  }
  const Eigen::Quaterniond to_normal = RotationBetween(Eigen::Vector3d::UnitZ(), normal);
  int open = 0;
  for (int i = 0; i < kAmbientSamples; ++i) {
    open += Blocked(origin, origin + kAmbientReach * (to_normal * HemisphereDirection(i, kAmbientSamples)))
                ? 0
                : 1;
  }
  return irradiance + scene_.ambient * (static_cast<double>(open) / kAmbientSamples);
}

}  // namespace sqslam
