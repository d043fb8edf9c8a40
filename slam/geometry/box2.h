#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstddef>
#include <string>

namespace sqslam {

// Axis-aligned image box in pixels; x, y is the top-left corner.
struct Box2d {
  double x = 0.0;
  double y = 0.0;
  double width = 0.0;
  double height = 0.0;

  double Area() const { return std::max(0.0, width) * std::max(0.0, height); }
  Eigen::Vector2d Center() const { return {x + 0.5 * width, y + 0.5 * height}; }

  // The coordinates of the edges: left, top, right, bottom.
  std::array<double, 4> Edges() const { return {x, y, x + width, y + height}; }
  static Box2d FromEdges(const std::array<double, 4>& edges) {
    return {edges[0], edges[1], edges[2] - edges[0], edges[3] - edges[1]};
  }

  bool Contains(const Eigen::Vector2d& pixel, double margin = 0.0) const {
    return pixel.x() >= x - margin && pixel.x() <= x + width + margin && pixel.y() >= y - margin &&
           pixel.y() <= y + height + margin;
  }
};

// Returns the box through the transformed midpoints of the box's edges.
Box2d MoveEdges(const Box2d& box, const auto& move) {
  const Eigen::Vector2d center = box.Center();
  const double left = move(Eigen::Vector2d(box.x, center.y())).x();
  const double right = move(Eigen::Vector2d(box.x + box.width, center.y())).x();
  const double top = move(Eigen::Vector2d(center.x(), box.y)).y();
  const double bottom = move(Eigen::Vector2d(center.x(), box.y + box.height)).y();
  return Box2d::FromEdges({left, top, right, bottom});
}

// Index of an edge in arrays with one value per edge.
enum BoxEdge : std::size_t { kLeftEdge, kTopEdge, kRightEdge, kBottomEdge };

// Returns true if a pixel is more than `margin` (px) outside one of the edges that count.
inline bool IsBeyondEdge(const Box2d& box, const std::array<bool, 4>& counts, const Eigen::Vector2d& pixel,
                         double margin) {
  return (counts[kLeftEdge] && pixel.x() < box.x - margin) ||
         (counts[kTopEdge] && pixel.y() < box.y - margin) ||
         (counts[kRightEdge] && pixel.x() > box.x + box.width + margin) ||
         (counts[kBottomEdge] && pixel.y() > box.y + box.height + margin);
}

// Returns the area of the intersection.
inline double SharedArea(const Box2d& a, const Box2d& b) {
  const double w = std::min(a.x + a.width, b.x + b.width) - std::max(a.x, b.x);
  const double h = std::min(a.y + a.height, b.y + b.height) - std::max(a.y, b.y);
  return w <= 0.0 || h <= 0.0 ? 0.0 : w * h;
}

// Returns the intersection over union in [0, 1]; 0 for empty boxes.
inline double IoU(const Box2d& a, const Box2d& b) {
  const double shared = SharedArea(a, b);
  return shared > 0.0 ? shared / (a.Area() + b.Area() - shared) : 0.0;
}

// Returns the intersection over the smaller area in [0, 1]; 0 for empty boxes.
inline double IntersectionOverSmaller(const Box2d& a, const Box2d& b) {
  const double shared = SharedArea(a, b);
  return shared > 0.0 ? shared / std::min(a.Area(), b.Area()) : 0.0;
}

// A detection in one image (distorted px).
struct Detection {
  std::string label;   // blanks written as underscores, e.g. "cereal_box"
  double score = 1.0;  // in [0, 1]
  Box2d box;           // clipped to the image
};

}  // namespace sqslam
