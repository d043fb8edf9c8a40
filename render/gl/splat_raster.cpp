#include "render/gl/splat_raster.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <thread>

#include "slam/util/parallel.h"
#include "slam/util/wide_registers.h"

namespace sqslam {
namespace {

// Draws discs where they are the nearest so far, in these rows only.
SQSLAM_WIDE_REGISTERS void Fill(std::span<const SplatDisc> discs, cv::Range rows, cv::Mat1f& all_depths,
                                cv::Mat1i& all_colors) {
  const auto first_from = [](float edge) { return static_cast<int>(std::ceil(edge - 0.5F)); };
  for (const SplatDisc& disc : discs) {
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
  std::fill_n(colors_[0], colors_.total(), std::bit_cast<std::int32_t>(rgba));
  std::fill_n(depths_[0], depths_.total(), 1.0F);
}

void SplatRaster::Draw(std::span<const PointSplats::Vertex> vertices,
                       std::span<const PointSplats::Range> ranges, const PointSplats::Look& look,
                       const Eigen::Matrix4f& T_device_map, float focal) {
  constexpr int kPart = 8192;
  std::vector<PointSplats::Range> parts;
  for (const PointSplats::Range& range : ranges) {
    for (int done = 0; done < range.count; done += kPart) {
      parts.push_back({range.first + done, std::min(kPart, range.count - done), range.least_size});
    }
  }
  discs_.resize(parts.size());
  ParallelFor(parts.size(), 0, [&](std::size_t i) {
    const PointSplats::Range& part = parts[i];
    discs_[i].clear();
    Place(vertices.subspan(static_cast<std::size_t>(part.first), static_cast<std::size_t>(part.count)),
          part.least_size, look, T_device_map, focal, discs_[i]);
  });
  // Each band of rows takes the points in their order, so that the picture does not depend on the threads.
  const int bands = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  ParallelFor(static_cast<std::size_t>(bands), 0, [&](std::size_t band) {
    const int i = static_cast<int>(band);
    const cv::Range rows(colors_.rows * i / bands, colors_.rows * (i + 1) / bands);
    for (const std::vector<SplatDisc>& part : discs_) {
      Fill(part, rows, depths_, colors_);
    }
  });
}

void SplatRaster::Place(std::span<const PointSplats::Vertex> vertices, float least_size,
                        const PointSplats::Look& look, const Eigen::Matrix4f& T_device_map, float focal,
                        std::vector<SplatDisc>& discs) const {
  constexpr float kLargest = 60.0F;  // as kSplatVertex has it
  const Eigen::Vector2f half(0.5F * static_cast<float>(colors_.cols),
                             0.5F * static_cast<float>(colors_.rows));
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
                     0.5F * (device.z() / w + 1.0F), std::clamp(diameter, look.least, kLargest),
                     std::bit_cast<std::int32_t>(v.rgba)});
  }
}

}  // namespace sqslam
