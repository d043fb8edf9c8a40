#include "render/picture/label_layout.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <utility>

#include "slam/util/to_vector.h"

namespace sqslam {
namespace {

constexpr int kMaxLinesAway =
    7;  // lines by which a text may be moved away before all free places are searched

// Costs in lines of text that a leader is long.
constexpr double kRankCost = 0.2;    // of one place less in the list of candidates
constexpr double kCoverCost = 1.0;   // of a text that lies on other objects only
constexpr double kHideCost = 8.0;    // of another object that a text hides altogether
constexpr double kLeaderCost = 1.0;  // of the need for a leader
constexpr double kCrossCost = 2.5;   // of a leader through another text, or a text on another leader

int GapOf(const cv::Size& text) { return std::max(2, text.height / 4); }

// Returns areas in order of preference.
std::vector<cv::Rect> Candidates(const LabelRequest& request) {
  const cv::Rect& b = request.part.bounds;
  const cv::Size& s = request.size;
  const int gap = GapOf(s);
  const int centered = b.x + (b.width - s.width) / 2;
  const int middle = b.y + (b.height - s.height) / 2;
  std::vector<cv::Rect> areas = {{{centered, b.y - gap - s.height}, s},
                                 {{centered, b.br().y + gap}, s},
                                 {{b.br().x + gap, middle}, s},
                                 {{b.x - gap - s.width, middle}, s}};
  const int side = s.width / 2 + gap, line = s.height + gap;
  for (int step = 0; step <= kMaxLinesAway; ++step) {  // rows above and below, and beside them
    for (const int shift : {0, side, -side, b.width / 2 + side, -b.width / 2 - side}) {
      areas.push_back({{centered + shift, b.y - (step + 1) * line}, s});
      areas.push_back({{centered + shift, b.br().y + gap + step * line}, s});
    }
    areas.push_back({{b.br().x + gap + step * s.height, middle}, s});
    areas.push_back({{b.x - gap - s.width - step * s.height, middle}, s});
  }
  return areas;
}

// Returns all places of a coarse grid, nearest to the anchor first.
std::vector<cv::Rect> AllPlaces(const LabelRequest& request, const cv::Size& picture) {
  const cv::Size& s = request.size;
  std::vector<cv::Rect> areas;
  for (int y = 0; y + s.height <= picture.height; y += std::max(1, s.height / 3)) {
    for (int x = 0; x + s.width <= picture.width; x += std::max(1, s.height / 2)) {
      areas.push_back({{x, y}, s});
    }
  }
  const cv::Point2d to(request.part.anchor);
  std::ranges::stable_sort(areas, {}, [&](const cv::Rect& area) {
    return cv::norm(cv::Point2d(area.x + 0.5 * area.width, area.y + 0.5 * area.height) - to);
  });
  return areas;
}

class LabelLayout {
 public:
  LabelLayout(const cv::Mat1i& number, std::span<const cv::Rect> taken)
      : number_(number), whole_({0, 0}, number.size()), used_(taken.begin(), taken.end()) {
    pixels_ = CountPixels(whole_);
  }

  LabelPlace Place(const LabelRequest& request) {
    LabelPlace best;
    double least = std::numeric_limits<double>::infinity();
    std::vector<cv::Rect> candidates = Candidates(request);
    if (request.first) {
      candidates.insert(candidates.begin(), *request.first);
    }
    for (std::size_t rank = 0; rank < candidates.size(); ++rank) {
      if (const std::optional<LabelPlace> place = At(candidates[rank], request)) {
        const double preference = kRankCost * static_cast<double>(std::min<std::size_t>(rank, 4));
        const double cost = preference + CostOf(*place, request.number);
        best = cost < least ? *place : best;
        least = std::min(least, cost);
      }
    }
    if (best.area.empty()) {
      for (const cv::Rect& area : AllPlaces(request, whole_.size())) {
        if (const std::optional<LabelPlace> place = At(area, request)) {
          best = *place;
          break;
        }
      }
    }
    if (!best.area.empty()) {
      used_.push_back(best.area);
      placed_.push_back(best);
    }
    return best;
  }

 private:
  // Returns the place there, unless something else is there.
  std::optional<LabelPlace> At(const cv::Rect& area, const LabelRequest& request) const {
    const bool free =
        std::ranges::none_of(used_, [&](const cv::Rect& other) { return !(other & area).empty(); });
    if (!free || (area & whole_) != area) {
      return std::nullopt;
    }
    LabelPlace place{area, true, request.part.anchor};
    const bool wanted = request.first == area && number_((area.tl() + area.br()) / 2) == request.number;
    if (wanted || cv::countNonZero(number_(area) != request.number) == 0) {  // on the object itself
      return LabelPlace{area, false, (area.tl() + area.br()) / 2};
    }
    const int gap = GapOf(area.size());
    const cv::Rect around =
        cv::Rect(area.x - 2 * gap, area.y - 2 * gap, area.width + 4 * gap, area.height + 4 * gap) & whole_;
    if (const std::optional<cv::Point> own = OnlyNeighbour(around, area, request.number)) {
      place.leader = false;
      place.anchor = *own;
      return place;
    }
    place.anchor = LeaderEnd(place, request.number);
    return place;
  }

  // Returns where the way from the text to the anchor has come a little into the object: a short leader is
  // easier to follow.
  cv::Point LeaderEnd(const LabelPlace& place, int number) const {
    const int inset = std::max(3, place.area.height / 3);
    int inside = 0;
    for (cv::LineIterator at(number_, LeaderStart(place), place.anchor);; ++at) {
      const cv::Point pixel = at.pos();
      inside = number_(pixel) == number ? inside + 1 : 0;
      if (inside == inset || pixel == place.anchor) {
        return pixel;
      }
    }
    return place.anchor;
  }

  // Returns the pixel of the object nearest to the text, if no other object is in the area around it.
  std::optional<cv::Point> OnlyNeighbour(const cv::Rect& around, const cv::Rect& text, int number) const {
    std::optional<cv::Point> nearest;
    double least = std::numeric_limits<double>::infinity();
    const cv::Point2d middle(text.x + 0.5 * text.width, text.y + 0.5 * text.height);
    for (int y = around.y; y < around.br().y; ++y) {
      for (int x = around.x; x < around.br().x; ++x) {
        const int there = number_(y, x);
        if (there >= 0 && there != number) {
          return std::nullopt;
        }
        const double away = std::hypot(x - middle.x, y - middle.y);
        if (there >= 0 && away < least) {
          least = away;
          nearest = {x, y};
        }
      }
    }
    return nearest;
  }

  // Returns the number of pixels of each object in an area.
  std::map<int, int> CountPixels(const cv::Rect& area) const {
    std::map<int, int> pixels;
    for (const int there : cv::Mat1i(number_(area))) {
      if (there >= 0) {
        ++pixels[there];
      }
    }
    return pixels;
  }

  double CostOf(const LabelPlace& place, int number) const {
    double covered = 0.0, hidden = 0.0;
    for (const auto& [other, count] : CountPixels(place.area)) {
      if (other != number) {
        covered += static_cast<double>(count) / std::max(1, place.area.area());
        hidden += static_cast<double>(count) / pixels_.at(other);
      }
    }
    int crossings = 0;
    for (const LabelPlace& other : placed_) {
      crossings += place.leader && Crosses(place, other.area) ? 1 : 0;
      crossings += other.leader && Crosses(other, place.area) ? 1 : 0;
    }
    const double length = cv::norm(LeaderStart(place) - place.anchor) / std::max(1, place.area.height);
    return kCoverCost * covered + kHideCost * hidden + (place.leader ? kLeaderCost + length : 0.0) +
           kCrossCost * crossings;
  }

  static bool Crosses(const LabelPlace& place, const cv::Rect& area) {
    cv::Point from = LeaderStart(place);
    cv::Point to = place.anchor;
    return cv::clipLine(area, from, to);
  }

  const cv::Mat1i& number_;
  cv::Rect whole_;
  std::map<int, int> pixels_;  // of each object
  std::vector<cv::Rect> used_;
  std::vector<LabelPlace> placed_;
};

}  // namespace

VisiblePart VisiblePartOf(const cv::Mat1b& mask) {
  VisiblePart part;
  part.bounds = cv::boundingRect(mask);
  if (part.bounds.empty()) {
    return part;
  }
  cv::Mat1b padded;  // so that the picture's border counts as an edge
  cv::copyMakeBorder(mask(part.bounds), padded, 1, 1, 1, 1, cv::BORDER_CONSTANT, cv::Scalar(0));
  cv::Mat1f inside;
  cv::distanceTransform(padded, inside, cv::DIST_L2, cv::DIST_MASK_3);
  cv::minMaxLoc(inside, nullptr, nullptr, nullptr, &part.anchor);
  part.anchor += part.bounds.tl() - cv::Point(1, 1);
  return part;
}

SeenSolids SeeSolids(std::span<const NamedSolid> solids, bool see_through, const Camera& camera,
                     const Rigid3d& T_map_camera, const cv::Mat1b& hidden,
                     const std::function<bool(const Eigen::Vector3d&)>& keeps) {
  std::vector<PosedSuperquadric> opaque;
  std::vector<int> numbers;
  for (std::size_t i = 0; i < solids.size(); ++i) {
    if (solids[i].opaque) {
      opaque.push_back(solids[i].solid);
      numbers.push_back(static_cast<int>(i));
    }
  }
  SolidImage image = RasterizeSolids(opaque, camera, T_map_camera, keeps);
  image.number.forEach([&](int& number, const int*) {
    number = number < 0 ? number : numbers[static_cast<std::size_t>(number)];
  });
  if (!hidden.empty()) {
    image.number.setTo(-1, hidden);
  }
  SeenSolids seen{image.number, {}};
  for (std::size_t i = 0; i < solids.size(); ++i) {
    cv::Mat1b mask = image.number == static_cast<int>(i);
    if (!solids[i].opaque || (see_through && cv::countNonZero(mask) == 0)) {
      const SolidImage alone = RasterizeSolids({&solids[i].solid, 1}, camera, T_map_camera, keeps);
      mask = alone.number == 0;
      if (!see_through) {
        mask &= alone.depth < image.depth;
      }
      if (!hidden.empty()) {
        mask.setTo(0, hidden);
      }
    }
    seen.parts.push_back(VisiblePartOf(mask));
  }
  return seen;
}

std::vector<LabelPlace> PlaceLabels(std::span<const LabelRequest> requests, const cv::Mat1i& number,
                                    std::span<const cv::Rect> taken) {
  std::vector<std::size_t> order(requests.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, {}, [&](std::size_t i) { return requests[i].depth; });
  LabelLayout layout(number, taken);
  std::vector<LabelPlace> places(requests.size());
  for (const std::size_t i : order) {
    places[i] = requests[i].part.bounds.empty() ? LabelPlace() : layout.Place(requests[i]);
  }
  return places;
}

cv::Point LeaderStart(const LabelPlace& place) {
  return {std::clamp(place.anchor.x, place.area.x, place.area.br().x),
          std::clamp(place.anchor.y, place.area.y, place.area.br().y)};
}

}  // namespace sqslam
