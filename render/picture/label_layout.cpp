#include "render/picture/label_layout.h"

#include <algorithm>
#include <limits>
#include <numeric>

namespace sqslam {
namespace {

constexpr int kSteps = 7;  // how many lines further away a text may stand

constexpr double kCoverCost = 4.0;  // of a text wholly on another thing, in places of the list

// Places in the order of preference, as top-left corners.
std::vector<LabelPlace> Candidates(const LabelRequest& request) {
  const cv::Rect& b = request.bounds;
  const cv::Size& s = request.size;
  const int gap = std::max(2, s.height / 4);
  const int centered = b.x + (b.width - s.width) / 2;
  const int middle = b.y + (b.height - s.height) / 2;
  std::vector<LabelPlace> places = {
      {{{centered, b.y - gap - s.height}, s}, false},
      {{{centered, b.br().y + gap}, s}, false},
      {{{b.br().x + gap, middle}, s}, false},
      {{{b.x - gap - s.width, middle}, s}, false},
  };
  for (int step = 1; step <= kSteps; ++step) {
    for (const int shift : {0, s.width / 2 + gap, -s.width / 2 - gap}) {
      places.push_back({{{centered + shift, b.y - gap - s.height - step * (s.height + gap)}, s}, true});
      places.push_back({{{centered + shift, b.br().y + gap + step * (s.height + gap)}, s}, true});
    }
  }
  return places;
}

// How many other things the text would stand on, as shares of the text.
double Covered(const cv::Rect& area, std::span<const LabelRequest> requests, std::size_t own) {
  double sum = 0.0;
  for (std::size_t i = 0; i < requests.size(); ++i) {
    sum += i == own ? 0.0 : (requests[i].bounds & area).area();
  }
  return sum / std::max(1, area.area());
}

}  // namespace

std::vector<LabelPlace> PlaceLabels(std::span<const LabelRequest> requests, cv::Size picture,
                                    std::span<const cv::Rect> taken) {
  std::vector<std::size_t> order(requests.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return requests[a].depth < requests[b].depth; });
  const cv::Rect whole({0, 0}, picture);
  std::vector<cv::Rect> used(taken.begin(), taken.end());
  std::vector<LabelPlace> places(requests.size());
  for (const std::size_t index : order) {
    double least = std::numeric_limits<double>::infinity();
    const std::vector<LabelPlace> candidates = Candidates(requests[index]);
    for (std::size_t rank = 0; rank < candidates.size(); ++rank) {
      const cv::Rect& area = candidates[rank].area;
      const bool inside = (area & whole) == area;
      const bool free = std::none_of(used.begin(), used.end(),
                                     [&](const cv::Rect& other) { return !(other & area).empty(); });
      const double cost = static_cast<double>(rank) + kCoverCost * Covered(area, requests, index);
      if (inside && free && cost < least) {
        least = cost;
        places[index] = candidates[rank];
      }
    }
    if (!places[index].area.empty()) {
      used.push_back(places[index].area);
    }
  }
  return places;
}

}  // namespace sqslam
