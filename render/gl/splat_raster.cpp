#include "render/gl/splat_raster.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <thread>
#include <vector>

#include "slam/util/parallel.h"
#include "slam/util/wide_registers.h"

namespace sqslam {
namespace {

// A point in the picture; samples from the lower left.
struct Disc {
  float x = 0.0F;
  float y = 0.0F;
  float depth = 0.0F;
  float diameter = 0.0F;
  std::int32_t rgba = 0;
};

// Returns the visible points of a range.
std::vector<Disc> VisibleDiscs(std::span<const PointSplats::Vertex> vertices, float least_size,
                               const PointSplats::Look& look, const Eigen::Matrix4f& T_device_map,
                               float focal, cv::Size picture) {
  constexpr float kMaxDiameter = 60.0F;  // samples; as in kSplatVertex
  const Eigen::Vector2f half = 0.5F * Eigen::Vector2i(picture.width, picture.height).cast<float>();
  std::vector<Disc> discs;
  discs.reserve(vertices.size());
  for (const PointSplats::Vertex& v : vertices) {
    if (v.frame > look.newest || look.cut.head<3>().dot(v.p_map) > look.cut.w()) {
      continue;
    }
    const Eigen::Vector4f device = T_device_map * v.p_map.homogeneous();
    const float w = device.w();
    if ((device.head<3>().array().abs() > w).any()) {
      continue;
    }
    const float diameter =
        std::max(v.size, least_size) * (look.in_map_units ? look.scale * focal / w : look.scale);
    discs.push_back({half.x() * (device.x() / w + 1.0F), half.y() * (device.y() / w + 1.0F),
                     0.5F * (device.z() / w + 1.0F), std::clamp(diameter, look.least, kMaxDiameter),
                     std::bit_cast<std::int32_t>(v.rgba)});
  }
  return discs;
}

// Draws the parts of discs in these rows that are nearer than everything drawn before.
SQSLAM_WIDE_REGISTERS void Fill(std::span<const Disc> discs, cv::Range rows, cv::Mat1f& all_depths,
                                cv::Mat1i& all_colors) {
  const auto first_from = [](float edge) { return static_cast<int>(std::ceil(edge - 0.5F)); };
  for (const Disc& disc : discs) {
    const float radius = 0.5F * disc.diameter;
    const int end = std::min(first_from(disc.y + radius), rows.end);
    for (int row = std::max(first_from(disc.y - radius), rows.start); row < end; ++row) {
      const float dy = static_cast<float>(row) + 0.5F - disc.y;
      const float reach = std::sqrt(std::max(radius * radius - dy * dy, 0.0F));
      const int last = std::min(first_from(disc.x + reach), all_depths.cols);
      float* depths = all_depths[row];
      std::int32_t* colors = all_colors[row];
      for (int column = std::max(first_from(disc.x - reach), 0); column < last; ++column) {
        const bool nearest = disc.depth <= depths[column];
        depths[column] = nearest ? disc.depth : depths[column];
        colors[column] = nearest ? disc.rgba : colors[column];
      }
    }
  }
}

}  // namespace

void SplatRaster::Clear(cv::Size size, const std::array<std::uint8_t, 4>& rgba) {
  colors_.create(size);
  depths_.create(size);
  colors_ = std::bit_cast<std::int32_t>(rgba);
  depths_ = 1.0F;
}

void SplatRaster::Draw(std::span<const PointSplats::Vertex> vertices,
                       std::span<const PointSplats::Range> ranges, const PointSplats::Look& look,
                       const Eigen::Matrix4f& T_device_map, float focal) {
  std::vector<PointSplats::Range> parts;
  constexpr int kPartVertices = 8192;
  for (const PointSplats::Range& range : ranges) {
    for (int done = 0; done < range.count; done += kPartVertices) {
      parts.push_back({range.first + done, std::min(kPartVertices, range.count - done), range.least_size});
    }
  }
  std::vector<std::vector<Disc>> discs(parts.size());
  ParallelFor(parts.size(), 0, [&](std::size_t i) {
    const auto members =
        vertices.subspan(static_cast<std::size_t>(parts[i].first), static_cast<std::size_t>(parts[i].count));
    discs[i] = VisibleDiscs(members, parts[i].least_size, look, T_device_map, focal, colors_.size());
  });
  // Each band of rows takes the points in their order: the picture does not depend on the threads.
  const int bands = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  ParallelFor(static_cast<std::size_t>(bands), 0, [&](std::size_t band) {
    const int i = static_cast<int>(band);
    const cv::Range rows(colors_.rows * i / bands, colors_.rows * (i + 1) / bands);
    for (const std::vector<Disc>& part : discs) {
      Fill(part, rows, depths_, colors_);
    }
  });
}

}  // namespace sqslam
