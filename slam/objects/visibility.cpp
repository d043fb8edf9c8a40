#include "slam/objects/visibility.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <ranges>

#include "slam/geometry/span_in_box.h"
#include "slam/objects/landmark_geometry.h"
#include "slam/objects/support.h"
#include "slam/util/statistics.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace {

constexpr double kHidden = 0.25;   // share of an edge in another box that hides it
constexpr double kTouching = 2.0;  // px; another box this close to an edge probably hides it

// Returns the share of an edge of `box` that lies inside `other`.
double CoveredShare(const Box2d& box, std::size_t edge, const Box2d& other) {
  const std::array<double, 4> own = box.Edges();
  const std::array<double, 4> others = other.Edges();
  const std::size_t across = edge % 2;  // axis
  const std::size_t along = 1 - across;
  if (own[edge] < others[across] - kTouching || own[edge] > others[across + 2] + kTouching) {
    return 0.0;
  }
  const double length = along == 0 ? box.width : box.height;
  const double overlap = std::min(own[along + 2], others[along + 2]) - std::max(own[along], others[along]);
  return length > 0.0 ? std::max(0.0, overlap) / length : 0.0;
}

// True if the box comes within kTouching of the other one.
bool Touches(const Box2d& a, const Box2d& b) {
  return b.x <= a.x + a.width + kTouching && b.x + b.width >= a.x - kTouching &&
         b.y <= a.y + a.height + kTouching && b.y + b.height >= a.y - kTouching;
}

// True if what is in the other box may hide the far end of what is in this one. Objects side by side reach
// over the same depths: then each may hide the far end of the other. Without depths: of two objects on one
// support, the nearer one ends lower in the image.
bool ReachesNearer(const BoxAtDepth& other, const BoxAtDepth& one) {
  const bool depths_known = one.median_depth > 0.0 && other.median_depth > 0.0;
  return depths_known ? other.near_depth < one.median_depth
                      : other.box.y + other.box.height > one.box.y + one.box.height;
}

// True if the solid hides what lies at `depth` on the line of sight through `pixel`. It must leave the solid
// before, unless it enters through the top of a low one: the hull of a chair is empty at its corners, but
// tables have tops.
bool IsBlocked(const Eigen::Vector2d& pixel, double depth, const Rigid3d& T_other_camera,
               const Camera& camera, const Superquadric& other) {
  constexpr int kSteps = 16;
  constexpr double kNearest = 0.1;  // shares of the depth
  constexpr double kFarthest = 0.92;
  constexpr double kForever = std::numeric_limits<double>::infinity();
  const Eigen::Vector3d ray = depth * camera.Unproject(pixel);
  for (int i = 0; i <= kSteps; ++i) {
    const double share = kNearest + (kFarthest - kNearest) * i / kSteps;
    const Eigen::Vector3d p = T_other_camera * (share * ray);
    // Most are outside the bounding box, which saves the powers.
    if ((p.cwiseAbs() - other.half_size).maxCoeff() < 0.0 && other.RadialScale(p) < 1.0) {
      const auto span = SpanInBox<Eigen::Vector3d>(T_other_camera.translation, T_other_camera.rotation * ray,
                                                   -other.half_size, other.half_size, kForever, -kForever);
      const bool low = other.half_size.z() < std::sqrt(other.half_size.head<2>().prod());
      return span && (span->end < 1.0 || (low && span->axis == 2));
    }
  }
  return false;
}

// True if the solid comes close enough to the line of sight through the centre of the box to matter at all.
// `far_end`: the point at `depth` on this line, camera frame.
bool IsNearSight(const Superquadric& other, const Rigid3d& T_other_camera, const Eigen::Vector3d& far_end,
                 const Box2d& box, const Camera& camera) {
  const double reach =
      other.half_size.norm() + 0.5 * std::hypot(box.width, box.height) * far_end.z() / camera.fx;
  const Eigen::Vector3d camera_centre = T_other_camera.translation;
  const Eigen::Vector3d way = T_other_camera * far_end - camera_centre;
  const double nearest = std::clamp(-camera_centre.dot(way) / way.squaredNorm(), 0.0, 1.0);
  return (camera_centre + nearest * way).norm() <= reach;
}

// Returns the edges just outside of which the solid blocks the view of what lies at `depth`.
EdgeFlags BlockedEdges(const Box2d& box, double depth, const Rigid3d& T_other_camera, const Camera& camera,
                       const Superquadric& other) {
  const double outward = 3.0 + 0.05 * std::max(box.width, box.height);
  EdgeFlags blocked{};
  for (int edge = 0; edge < 4; ++edge) {
    int count = 0;
    for (const double along : {0.25, 0.5, 0.75}) {
      const double x = edge == 0   ? box.x - outward
                       : edge == 2 ? box.x + box.width + outward
                                   : box.x + along * box.width;
      const double y = edge == 1   ? box.y - outward
                       : edge == 3 ? box.y + box.height + outward
                                   : box.y + along * box.height;
      count += IsBlocked({x, y}, depth, T_other_camera, camera, other) ? 1 : 0;
    }
    blocked[static_cast<std::size_t>(edge)] = count >= 2;
  }
  return blocked;
}

// Frees the edges of views that the boxes of what is beneath the object seem to hide.
void FreeEdgesAbove(std::span<const Landmark* const> beneath, const Camera& camera,
                    const DetectionFilterOptions& options, std::vector<BoxView>& views) {
  for (BoxView& view : views) {
    const EdgeFlags cut = CutEdges(view.box, camera, options);
    for (const Landmark* other : beneath) {
      const auto same = std::ranges::lower_bound(other->views, view.frame_index, {}, &BoxView::frame_index);
      if (same == other->views.end() || same->frame_index != view.frame_index) {
        continue;
      }
      for (std::size_t edge = 0; edge < 4; ++edge) {
        view.edge_free[edge] =
            view.edge_free[edge] || (!cut[edge] && CoveredShare(view.box, edge, same->box) > kHidden);
      }
    }
  }
}

}  // namespace

EdgeFlags BoxEdges::Free() const {
  EdgeFlags free{};
  std::ranges::transform(cut, hidden, free.begin(),
                         [](bool is_cut, bool is_hidden) { return !is_cut && !is_hidden; });
  return free;
}

void BoxEdges::Hide(const EdgeFlags& more) {
  std::ranges::transform(hidden, more, hidden.begin(), std::logical_or());
}

bool BoxEdges::AnyCut() const { return std::ranges::any_of(cut, std::identity()); }

bool IsWhole(const EdgeFlags& edge_free) { return std::ranges::all_of(edge_free, std::identity()); }

EdgeFlags CutEdges(const Box2d& box, const Camera& camera, const DetectionFilterOptions& options) {
  const double x_margin = options.border_margin + options.border_share * box.width;
  const double y_margin = options.border_margin + options.border_share * box.height;
  return {box.x <= x_margin, box.y <= y_margin, box.x + box.width >= camera.width - 1.0 - x_margin,
          box.y + box.height >= camera.height - 1.0 - y_margin};
}

std::vector<EdgeFlags> EdgesHiddenByBoxes(std::span<const BoxAtDepth> boxes) {
  std::vector<EdgeFlags> hidden(boxes.size());
  for (std::size_t one = 0; one < boxes.size(); ++one) {
    for (std::size_t i = 0; i < boxes.size(); ++i) {
      const Box2d& other = boxes[i].box;
      if (i == one || !Touches(boxes[one].box, other) || !ReachesNearer(boxes[i], boxes[one])) {
        continue;
      }
      for (std::size_t edge = 0; edge < 4; ++edge) {
        // If it also covers the opposite edge, it is rather what this object stands on: a table under a cup.
        const bool covered = CoveredShare(boxes[one].box, edge, other) > kHidden;
        const bool through = CoveredShare(boxes[one].box, (edge + 2) % 4, other) > kHidden;
        hidden[one][edge] = hidden[one][edge] || (covered && !through);
      }
    }
  }
  return hidden;
}

bool IsMuchLarger(const Superquadric& other, const Superquadric& object) {
  constexpr double kMuchLarger = 4.0;  // volumes
  // Every superquadric fills between 1/6 (the octahedron) and all of its bounding box, which usually decides.
  return other.half_size.prod() >= kMuchLarger / 6.0 * object.half_size.prod() &&
         other.Volume() >= kMuchLarger * object.Volume();
}

bool MayOcclude(const PosedSuperquadric& other, const PosedSuperquadric& object, bool on_floor) {
  if (!IsMuchLarger(other.shape, object.shape)) {
    return false;
  }
  if (on_floor) {
    return true;
  }
  const double bottom = object.T_map_object.translation.z() - object.shape.half_size.z();
  return !IsOver(object.T_map_object.translation.head<2>(), other) ||
         bottom < other.T_map_object.translation.z();
}

EdgeFlags EdgesHiddenBy(const PosedSuperquadric& other, const PosedSuperquadric& object, const Box2d& box,
                        const Rigid3d& T_map_camera, const Camera& camera) {
  const double depth = (T_map_camera.Inverse() * object.T_map_object.translation).z();
  const Box2d undistorted = UndistortBox(box, camera);
  const Eigen::Vector3d far_end = depth * camera.Unproject(undistorted.Center());
  const Rigid3d T_other_camera = other.T_map_object.Inverse() * T_map_camera;
  if (depth <= 0.0 || !IsNearSight(other.shape, T_other_camera, far_end, undistorted, camera)) {
    return {};
  }
  const EdgeFlags blocked = BlockedEdges(undistorted, depth, T_other_camera, camera, other.shape);
  EdgeFlags hidden{};
  for (std::size_t edge = 0; edge < 4; ++edge) {
    hidden[edge] = blocked[edge] && !blocked[(edge + 2) % 4];
  }
  const double bottom = other.T_map_object.translation.z() - other.shape.half_size.z();
  if (bottom < (T_map_camera * far_end).z()) {
    hidden[kTopEdge] = false;
  }
  return hidden;
}

void JudgeHiddenEdges(const PosedSuperquadric& object, std::span<const Landmark* const> beneath,
                      std::span<const PosedSuperquadric> occluders, const Camera& camera,
                      const DetectionFilterOptions& options, std::vector<BoxView>& views) {
  FreeEdgesAbove(beneath, camera, options, views);
  for (BoxView& view : views) {
    for (const PosedSuperquadric& other : occluders) {
      const EdgeFlags hidden = EdgesHiddenBy(other, object, view.box, view.T_map_camera, camera);
      for (std::size_t edge = 0; edge < 4; ++edge) {
        view.edge_free[edge] = view.edge_free[edge] && !hidden[edge];
      }
    }
  }
}

const PosedSuperquadric* OccluderOfBottom(const Landmark& landmark, bool on_floor,
                                          std::span<const PosedSuperquadric> others,
                                          const std::vector<BoxView>& views, const Camera& camera) {
  const PosedSuperquadric* occluder = nullptr;
  auto most = static_cast<std::ptrdiff_t>(views.size() / 2);
  for (const PosedSuperquadric& other : others) {
    if (!MayOcclude(other, landmark.visible, on_floor)) {  // the visible part is new
      continue;
    }
    const auto hidden = std::ranges::count_if(views, [&](const BoxView& view) {
      return EdgesHiddenBy(other, landmark.visible, view.box, view.T_map_camera, camera)[kBottomEdge];
    });
    if (hidden > most) {
      most = hidden;
      occluder = &other;
    }
  }
  return occluder;
}

bool IsBottomSeen(const std::vector<BoxView>& views) {
  constexpr double kMostlyHidden = 0.33;
  const auto free =
      std::ranges::count_if(views, [](const BoxView& view) { return view.edge_free[kBottomEdge]; });
  return static_cast<double>(free) >= kMostlyHidden * static_cast<double>(views.size());
}

EdgeFlags ExactEdges(const BoxView& view, bool bottom_seen) {
  EdgeFlags exact = view.edge_free;
  exact[kBottomEdge] = exact[kBottomEdge] && bottom_seen;
  return exact;
}

}  // namespace sqslam
