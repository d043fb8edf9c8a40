#include "render/synthetic/textured_mesh.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/core/utility.hpp>

#include "render/solids/tessellation.h"
#include "render/synthetic/texture.h"

namespace sqslam {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kObjectPixelsPerMetre = 1400.0;
constexpr double kFurniturePixelsPerMetre = 600.0;
constexpr double kHiddenPixelsPerMetre = 100.0;  // undersides
constexpr double kPanelPixelsPerMetre = 700.0;
constexpr double kLargestTexture = 2048.0;  // pixels a side

// Light as the eye sees it: the texture is stored with the gamma of screens, so light multiplies it in gamma
// too.
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

void AddGridTriangles(int rows, int columns, TexturedMesh& mesh) {
  for (int row = 0; row + 1 < rows; ++row) {
    for (int column = 0; column + 1 < columns; ++column) {
      const int a = row * columns + column;
      const int b = a + columns;
      mesh.triangles.push_back({a, a + 1, b + 1});
      mesh.triangles.push_back({a, b + 1, b});
    }
  }
}

cv::Mat PaintFor(const TextureDescription& texture, double width, double height, double pixels_per_metre,
                 int variation) {
  const double scale = std::min(pixels_per_metre, kLargestTexture / std::max(width, height));
  return PaintTexture(texture, std::max(width, 0.01), std::max(height, 0.01), scale, variation);
}

// Parameter samples dense at corners (for the silhouette) and on flat sides (for the light), in order.
std::vector<SuperellipsePoint> DenseSamples(double e, double first, double last, int segments) {
  std::vector<SuperellipsePoint> samples = SampleUniformInParameter(e, first, last, segments);
  const std::vector<SuperellipsePoint> flat = SampleUniformInPolarAngle(e, first, last, segments);
  samples.insert(samples.end() - 1, flat.begin() + 1, flat.end() - 1);
  const auto angle = [](const SuperellipsePoint& p) { return std::atan2(p.y, p.x); };
  std::sort(samples.begin() + 1, samples.end() - 1,
            [&](const auto& a, const auto& b) { return angle(a) < angle(b); });
  return samples;
}

// Lengths along the polyline of samples scaled by (scale_x, scale_y).
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

enum class Chart { kBottom, kSide, kTop };

Eigen::Vector2f ChartCoordinates(const BodySamples& samples, const Superquadric& shape, Chart chart,
                                 std::size_t row, std::size_t column, std::size_t first, std::size_t last) {
  if (chart == Chart::kSide) {
    const double height = samples.along_profile[last] - samples.along_profile[first];
    return {static_cast<float>(samples.along_section[column] / samples.along_section.back()),
            static_cast<float>((samples.along_profile[row] - samples.along_profile[first]) / height)};
  }
  const Eigen::Vector3d p =
      SurfacePoint(shape, samples.profile[row], samples.section[column]).cwiseQuotient(shape.half_size);
  return {static_cast<float>(0.5 + 0.5 * p.x()), static_cast<float>(0.5 + 0.5 * p.y())};
}

TexturedMesh BuildChart(const SceneBody& body, const SceneLighting& lighting, const BodySamples& samples,
                        Chart chart, std::size_t first, std::size_t last) {
  const Superquadric& shape = body.superquadric.shape;
  const Rigid3d& T_world_object = body.superquadric.T_map_object;
  TexturedMesh mesh;
  mesh.id = body.id;
  for (std::size_t row = first; row <= last; ++row) {
    for (std::size_t column = 0; column < samples.section.size(); ++column) {
      const SuperellipsePoint& p = samples.profile[row];
      const SuperellipsePoint& q = samples.section[column];
      mesh.vertices.push_back((T_world_object * SurfacePoint(shape, p, q)).cast<float>());
      mesh.normals.push_back((T_world_object.rotation * SurfaceNormal(shape, p, q)).cast<float>());
      mesh.texture_coordinates.push_back(ChartCoordinates(samples, shape, chart, row, column, first, last));
    }
  }
  AddGridTriangles(static_cast<int>(last - first + 1), static_cast<int>(samples.section.size()), mesh);
  AddLight(lighting, mesh);
  const bool side = chart == Chart::kSide;
  const double width = side ? samples.along_section.back() : 2.0 * shape.half_size.x();
  const double height =
      side ? samples.along_profile[last] - samples.along_profile[first] : 2.0 * shape.half_size.y();
  const double detail = body.id > 0 ? kObjectPixelsPerMetre : kFurniturePixelsPerMetre;
  mesh.texture = PaintFor(body.texture, width, height,
                          chart == Chart::kBottom ? kHiddenPixelsPerMetre : detail, static_cast<int>(chart));
  return mesh;
}

// First row of the top cap: from where on the surface looks up by more than about 50 degrees.
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
          BuildChart(body, lighting, samples, Chart::kSide, bottom, top),
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
  AddGridTriangles(rows, columns, mesh);
  AddLight(lighting, mesh);
  mesh.texture = PaintFor(panel.texture, width, height, kPanelPixelsPerMetre, 0);
  return mesh;
}

}  // namespace sqslam
