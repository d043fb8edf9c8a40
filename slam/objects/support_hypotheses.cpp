#include "slam/objects/support_hypotheses.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <ranges>

#include "slam/objects/support.h"
#include "slam/util/statistics.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace {

std::vector<double> AllOf(const SupportHeights& supports) {
  std::vector<double> heights = supports.near;
  heights.insert(heights.end(), supports.far.begin(), supports.far.end());
  for (const SupportHeights::Top& top : supports.tops) {
    heights.push_back(top.height);
  }
  return heights;
}

bool StandsOnHiddenFloor(const SupportHeights& supports, const ObjectClass& prior) {
  return prior.on_floor && !supports.floor;
}

// Returns the tops of mapped objects under the place that are none of the heights.
std::vector<SupportHeights::Top> TopsUnder(const Eigen::Vector2d& place, double highest,
                                           const std::vector<double>& heights,
                                           std::span<const PosedSuperquadric> others) {
  constexpr double kPrecise = 0.1;  // standard deviation of a mapped height, share of half of it
  std::vector<SupportHeights::Top> tops;
  for (const PosedSuperquadric& other : others) {
    const double half = other.shape.half_size.z();
    const double sigma = kPrecise * half;
    const double top = other.T_map_object.translation.z() + half;
    const bool is_new =
        std::ranges::none_of(heights, [&](double height) { return std::abs(height - top) < 2.0 * sigma; });
    if (top <= highest && is_new && IsOver(place, other)) {
      tops.push_back({top, sigma});
    }
  }
  return tops;
}

}  // namespace

SupportHeights PossibleSupports(const NamedPoints& points, const EstimationContext& context) {
  constexpr double kBelow = 0.35;  // share of points that may lie below a surface: noise
  constexpr double kReach = 1.5;
  if (points.empty()) {
    return {};
  }
  std::vector<double> heights;
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();
  for (const auto& [id, p] : points) {
    heights.push_back(p.z());
    centre += p.head<2>() / static_cast<double>(points.size());
  }
  const SupportSurfaces surfaces = context.supports->Around(centre, context.surroundings.others);
  std::vector<double> radii = ToVector(
      points | std::views::values, [&](const Eigen::Vector3d& p) { return (p.head<2>() - centre).norm(); });
  const double low =
      NthSmallest(heights, static_cast<std::size_t>(kBelow * static_cast<double>(heights.size())));
  const double highest = low + 3.0 * surfaces.Tolerance();
  SupportHeights supports;
  supports.floor = surfaces.Floor();
  supports.near = surfaces.Under(
      centre, 2.0 * kReach * UpperMedian(std::move(radii)) + 8.0 * surfaces.Tolerance(), highest);
  supports.tops = TopsUnder(centre, highest, supports.near, context.surroundings.others);
  supports.sigma = 0.5 * surfaces.Tolerance();
  for (const SupportSurface& surface : surfaces.All()) {
    if (surface.height <= highest &&
        std::ranges::find(supports.near, surface.height) == supports.near.end()) {
      supports.far.push_back(surface.height);
    }
  }
  return supports;
}

double SupportHeights::SigmaOf(double height) const {
  const auto top = std::ranges::find(tops, height, &Top::height);
  return top == tops.end() ? sigma : top->sigma;
}

std::optional<double> SupportOf(const Landmark& landmark, const SupportHeights& supports) {
  constexpr double kSame = 0.25;  // of the object's height
  const bool completed = landmark.superquadric.shape.half_size.z() != landmark.visible.shape.half_size.z();
  if (!landmark.support || completed) {
    return std::nullopt;
  }
  const std::vector<double> heights = AllOf(supports);
  const auto distance = [&](double height) { return std::abs(height - *landmark.support); };
  const auto nearest = std::ranges::min_element(heights, {}, distance);
  const bool found =
      nearest != heights.end() && distance(*nearest) < kSame * 2.0 * landmark.visible.shape.half_size.z();
  return found ? *nearest : *landmark.support;
}

std::optional<double> LowestOf(const SupportHeights& supports, const ObjectClass& prior) {
  const bool unbounded = supports.near.empty() || StandsOnHiddenFloor(supports, prior);
  return unbounded ? std::nullopt : std::optional(std::ranges::max(supports.near));
}

std::vector<Assumption> Assumptions(const SupportHeights& supports, const RefinementInput& input,
                                    const RefinementOptions& options, bool all_far) {
  constexpr double kPast = 0.5;  // of the floating cost: an object on a lower surface reaches through others
  const auto is_floor = [&](double height) { return supports.floor && height <= *supports.floor; };
  const double misplaced = 2.0 * options.floating_cost;  // elsewhere than on the floor, against the class
  const auto cost_of = [&](double height, double least) {
    if (input.prior.on_floor) {
      return is_floor(height) ? 0.0 : misplaced;
    }
    const auto is_above = [&](double other) { return other > height; };
    const auto above = std::ranges::count_if(supports.near, is_above) +
                       std::ranges::count_if(supports.tops, is_above, &SupportHeights::Top::height);
    return kPast * options.floating_cost * std::max(least, static_cast<double>(above));
  };
  std::vector<Assumption> assumptions = ToVector(supports.near, [&](const double height) {
    return Assumption{height, {}, cost_of(height, 0.0), supports.sigma};
  });
  for (const auto& [height, sigma] : supports.tops) {
    assumptions.push_back({height, {}, cost_of(height, 0.0), sigma});
  }
  assumptions.push_back({{},
                         LowestOf(supports, input.prior),
                         StandsOnHiddenFloor(supports, input.prior) ? 0.0 : options.floating_cost,
                         supports.sigma});
  // A quick search leaves out surfaces elsewhere but the floor of those that stand there by their class, and
  // an object that stands above a low one may well stand on one that begins beside it.
  const double lowest =
      supports.near.empty() ? std::numeric_limits<double>::infinity() : std::ranges::min(supports.near);
  for (const double height : supports.far) {
    if (all_far || height > lowest || (input.prior.on_floor && is_floor(height))) {
      assumptions.push_back({height, {}, cost_of(height, 2.0), supports.sigma});
    }
  }
  for (std::size_t i = 0, count = input.may_show_back ? assumptions.size() : 0; i < count; ++i) {
    assumptions.push_back(assumptions[i]);
    assumptions.back().shows_back = true;
  }
  return assumptions;
}

}  // namespace sqslam
