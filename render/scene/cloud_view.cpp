#include "render/scene/cloud_view.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

namespace sqslam {

void CloudView::Show(const CloudLayerPtr& cloud) {
  constexpr std::size_t kPartPoints = 6000;  // consecutive points, which are near each other
  parts_.clear();
  spacing_ = cloud ? cloud->spacing : 0.0;
  std::vector<PointSplats::Vertex> vertices;
  if (cloud) {
    vertices.reserve(cloud->points.size());
    std::span<const CloudPoint> left(cloud->points);
    while (!left.empty()) {
      const std::span<const CloudPoint> members = left.first(std::min(kPartPoints, left.size()));
      left = left.subspan(members.size());
      Part& part = parts_.emplace_back();
      part.first = static_cast<int>(vertices.size());
      part.frame = members.front().frame;
      Eigen::AlignedBox3f box;
      for (int rank = CloudLayer::kRanks - 1; rank >= 0; --rank) {
        for (const CloudPoint& point : members) {
          if (point.rank == rank) {
            box.extend(point.p_map);
            vertices.push_back({point.p_map,
                                point.spacing,
                                static_cast<float>(point.frame),
                                {point.rgb[0], point.rgb[1], point.rgb[2], 255}});
          }
        }
        part.counts[static_cast<std::size_t>(rank)] = static_cast<int>(vertices.size()) - part.first;
      }
      part.center = box.center().cast<double>();
      part.radius = 0.5 * box.diagonal().norm();
    }
  }
  splats_.SetVertices(std::move(vertices));
}

void CloudView::LookFrom(const ViewCamera& camera, double height, double aspect, double detail,
                         std::int64_t newest) {
  const auto [right, up, back] = AxesOf(camera);
  const double focal =
      camera.pinhole ? camera.pinhole->fy / camera.pinhole->height * height : camera.FocalLength(height);
  const double tan_y = 0.5 * height / focal;
  const Eigen::Vector2d tangents(tan_y * aspect, tan_y);
  const Eigen::Vector2d widening = (Eigen::Vector2d::Ones() + tangents.cwiseAbs2()).cwiseSqrt();
  std::vector<PointSplats::Range> ranges;
  for (const Part& part : parts_) {
    const Eigen::Vector3d line = part.center - camera.position;
    const double depth = -line.dot(back);
    const Eigen::Vector2d across(std::abs(line.dot(right)), std::abs(line.dot(up)));
    const bool outside = ((across - part.radius * widening).array() > (tangents * depth).array()).any();
    if (part.frame > newest || depth < -part.radius || (outside && !camera.pinhole)) {
      continue;
    }
    const double nearest = std::max(line.norm() - part.radius, 1e-3 * part.radius);
    const double steps = 2.0 * std::log2(std::max(detail * nearest / (spacing_ * focal), 1.0));
    constexpr int kCoarsest = CloudLayer::kRanks - 1;  // also if `steps` is NaN
    const int level = steps < kCoarsest ? static_cast<int>(steps) : kCoarsest;
    ranges.push_back({part.first, part.counts[static_cast<std::size_t>(level)],
                      static_cast<float>(spacing_ * std::exp2(0.5 * level))});
  }
  splats_.SetRanges(std::move(ranges));
}

}  // namespace sqslam
