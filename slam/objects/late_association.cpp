#include "slam/objects/late_association.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>

#include "slam/geometry/ray.h"
#include "slam/objects/detection_filter.h"
#include "slam/objects/landmark_estimation.h"
#include "slam/objects/landmark_geometry.h"
#include "slam/objects/merging.h"
#include "slam/objects/visibility.h"
#include "slam/util/thinned.h"

namespace sqslam {
namespace {

// A box of a fragment.
struct Sight {
  std::size_t fragment;
  const BoxView* view;
  Box2d box;  // undistorted px
  Rigid3d T_camera_map;
  Eigen::Vector3d direction;    // of its centre, map frame, of length 1
  Eigen::Array2d half_tangent;  // half its width and height at depth 1
  std::array<bool, 2> free;     // whether both edges across x and across y are
};

// A hypothesis of an object: its centre, and half the width and height of its image in map units; 0: unknown.
struct Place {
  Eigen::Vector3d centre;
  Eigen::Array2d half = Eigen::Array2d::Zero();
};

std::vector<Sight> SightsOf(std::span<const Landmark* const> fragments,
                            const std::vector<std::size_t>& members, const Camera& camera) {
  std::vector<Sight> sights;
  for (const std::size_t i : members) {
    for (const BoxView& view : fragments[i]->views) {
      const Box2d box = UndistortBox(view.box, camera);
      const EdgeFlags& free = view.edge_free;
      sights.push_back({i,
                        &view,
                        box,
                        view.T_map_camera.Inverse(),
                        (view.T_map_camera.rotation * camera.Unproject(box.Center())).normalized(),
                        {0.5 * box.width / camera.fx, 0.5 * box.height / camera.fy},
                        {free[0] && free[2], free[1] && free[3]}});
    }
  }
  return sights;
}

// Between the widths, or the heights, of one object in two views: it may be longer than deep.
constexpr double kMaxRatio = 2.0;

// Returns where two lines of sight meet; empty if they are nearly parallel, pass each other, meet behind a
// camera or show things of different size.
std::optional<Place> Meeting(const Sight& a, const Sight& b) {
  constexpr double kMinAngle = 0.05;  // radians
  constexpr double kMiss = 0.5;       // of half the size
  if (a.view->frame_index == b.view->frame_index || a.direction.cross(b.direction).norm() < kMinAngle) {
    return std::nullopt;
  }
  RaySum rays;
  rays.Add({a.view->T_map_camera.translation, a.direction});
  rays.Add({b.view->T_map_camera.translation, b.direction});
  Place place = {rays.Nearest()};
  const double depth_a = (a.T_camera_map * place.centre).z();
  const double depth_b = (b.T_camera_map * place.centre).z();
  if (depth_a <= 0.0 || depth_b <= 0.0) {
    return std::nullopt;
  }
  for (int axis = 0; axis < 2; ++axis) {
    const double size_a = depth_a * a.half_tangent[axis];
    const double size_b = depth_b * b.half_tangent[axis];
    if (a.free[axis] && b.free[axis]) {
      place.half[axis] = std::sqrt(size_a * size_b);
      if (std::max(size_a, size_b) > kMaxRatio * std::min(size_a, size_b)) {
        return std::nullopt;
      }
    }
  }
  const auto distance = [&](const Sight& sight) {
    return (place.centre - sight.view->T_map_camera.translation).cross(sight.direction).norm();
  };
  return distance(a) < kMiss * place.half.maxCoeff() ? std::optional(place) : std::nullopt;
}

// Share of the box's width (axis 0) or height in which the centre of its object lies.
double MiddleShare(const Sight& sight, int axis) { return sight.free[axis] ? 0.5 : 1.0; }

// True if the box may show an object at the place: its centre lies in the middle of the box, and they are
// about as large. Where an edge is not free, the box may end anywhere on the object.
bool Shows(const Sight& sight, const Place& place, const Camera& camera) {
  const Eigen::Vector3d p = sight.T_camera_map * place.centre;
  if (p.z() <= 0.0) {
    return false;
  }
  const Eigen::Array2d off(camera.fx * p.x() / p.z() + camera.cx - sight.box.Center().x(),
                           camera.fy * p.y() / p.z() + camera.cy - sight.box.Center().y());
  const Eigen::Array2d extent(sight.box.width, sight.box.height);
  for (int axis = 0; axis < 2; ++axis) {
    const bool free = sight.free[axis];
    const double shown = p.z() * sight.half_tangent[axis];
    const bool as_large = place.half[axis] == 0.0 || (shown < kMaxRatio * place.half[axis] &&
                                                      (!free || kMaxRatio * shown > place.half[axis]));
    if (!as_large || std::abs(off[axis]) > 0.5 * MiddleShare(sight, axis) * extent[axis]) {
      return false;
    }
  }
  return true;
}

constexpr double kMaxFalseAlarms = 0.05;  // of a group

// Fragments that show an object at one place, and the number of frames that do.
struct Group {
  std::vector<std::size_t> fragments;
  std::size_t frames = 0;
};

// Returns the fragments of which most boxes show the place, those of the most boxes first to claim a frame.
Group GroupAt(const Place& place, const std::vector<Sight>& sights,
              std::span<const Landmark* const> fragments, const Camera& camera) {
  std::map<std::size_t, std::size_t> boxes;  // of each fragment that show the place
  for (const Sight& sight : sights) {
    boxes[sight.fragment] += Shows(sight, place, camera) ? 1 : 0;
  }
  std::vector<std::size_t> order;
  for (const auto& [fragment, count] : boxes) {
    if (2 * count > fragments[fragment]->views.size()) {
      order.push_back(fragment);
    }
  }
  std::ranges::stable_sort(order, std::greater(), [&](std::size_t i) { return fragments[i]->views.size(); });
  Group group;
  std::set<std::int64_t> frames;
  for (const std::size_t i : order) {
    const auto& views = fragments[i]->views;
    if (std::ranges::none_of(views, [&](const BoxView& view) { return frames.contains(view.frame_index); })) {
      group.fragments.push_back(i);
      for (const BoxView& view : views) {
        frames.insert(view.frame_index);
      }
    }
  }
  group.frames = frames.size();
  return group;
}

// Returns how many groups as large, of boxes as small, arise by chance from as many boxes anywhere in the
// image, if each pair of them makes a hypothesis (a contrario: Desolneux, Moisan and Morel, IJCV 2000).
double FalseAlarms(const Group& group, const std::vector<Sight>& sights, const Camera& camera) {
  double log_shown =
      0.0;  // of the share of the image in which a place is shown by a box, mean over the group
  int grouped = 0;
  for (const Sight& sight : sights) {
    if (std::ranges::count(group.fragments, sight.fragment) > 0) {
      log_shown += std::log(MiddleShare(sight, 0) * MiddleShare(sight, 1) * ShareOfImage(sight.box, camera));
      ++grouped;
    }
  }
  log_shown /= grouped;
  const auto count = static_cast<double>(sights.size());
  const auto others = static_cast<double>(group.frames) - 2.0;  // two made the hypothesis
  const double log_choices =
      std::lgamma(count + 1.0) - std::lgamma(others + 1.0) - std::lgamma(count - others + 1.0);
  return 0.5 * count * count * std::exp(log_choices + others * std::min(0.0, log_shown));
}

// Returns the group of the fewest false alarms, over all pairs of sights; an empty one if all could be
// chance.
Group BestGroup(const std::vector<Sight>& sights, std::span<const Landmark* const> fragments,
                const Camera& camera) {
  constexpr std::size_t kMaxTried = 60;  // sights, of which all pairs are tried
  constexpr std::size_t kMinFrames = 3;
  const std::vector<Sight> tried = sqslam::Thinned(sights, kMaxTried);
  Group best;
  double fewest = kMaxFalseAlarms;
  for (std::size_t a = 0; a < tried.size(); ++a) {
    for (std::size_t b = a + 1; b < tried.size(); ++b) {
      if (const std::optional<Place> place = Meeting(tried[a], tried[b])) {
        Group group = GroupAt(*place, sights, fragments, camera);
        const double alarms = group.frames < kMinFrames ? fewest : FalseAlarms(group, sights, camera);
        if (alarms < fewest) {
          fewest = alarms;
          best = std::move(group);
        }
      }
    }
  }
  return best;
}

// Returns the index of the mapped object that the boxes of the fragment show; empty if there is none.
std::optional<std::size_t> ObjectShownBy(const Landmark& fragment, std::span<const Landmark* const> mapped,
                                         const Camera& camera) {
  constexpr double kAgrees = 0.5;  // mean IoU
  constexpr double kAgreesOtherLabel = 0.7;
  std::optional<std::size_t> best;
  double most = 0.0;
  for (std::size_t i = 0; i < mapped.size(); ++i) {
    const double least = mapped[i]->labels.Best() == fragment.labels.Best() ? kAgrees : kAgreesOtherLabel;
    const double agreement = BoxAgreement(mapped[i]->visible, fragment.views, camera);
    if (agreement > std::max(least, most) && !AreSeenTogether(*mapped[i], fragment)) {
      best = i;
      most = agreement;
    }
  }
  return best;
}

// Returns groups of those `among` the fragments (indices) that show one object each.
std::vector<std::vector<std::size_t>> GroupsOfOnePlace(std::span<const Landmark* const> fragments,
                                                       const std::vector<std::size_t>& among,
                                                       const Camera& camera) {
  std::map<std::string, std::vector<std::size_t>> by_label;
  for (const std::size_t i : among) {
    by_label[fragments[i]->labels.Best()].push_back(i);
  }
  std::vector<std::vector<std::size_t>> groups;
  for (auto& [label, members] : by_label) {
    while (members.size() > 1) {
      const std::vector<Sight> sights = SightsOf(fragments, members, camera);
      const Group group = BestGroup(sights, fragments, camera);
      if (group.fragments.empty()) {
        break;
      }
      std::erase_if(members, [&](std::size_t i) { return std::ranges::count(group.fragments, i) > 0; });
      if (group.fragments.size() > 1) {
        groups.push_back(group.fragments);
      }
    }
  }
  return groups;
}

}  // namespace

FragmentAssociation AssociateFragments(std::span<const Landmark* const> fragments,
                                       std::span<const Landmark* const> mapped, const Camera& camera) {
  FragmentAssociation association;
  std::vector<std::size_t> rest;
  for (std::size_t i = 0; i < fragments.size(); ++i) {
    if (const std::optional<std::size_t> object = ObjectShownBy(*fragments[i], mapped, camera)) {
      association.shown.emplace_back(i, *object);
    } else {
      rest.push_back(i);
    }
  }
  association.groups = GroupsOfOnePlace(fragments, rest, camera);
  return association;
}

}  // namespace sqslam
