#include "slam/detection/suppression.h"

#include <algorithm>

namespace sqslam {

std::vector<ScoredBox> SuppressDoubles(std::vector<ScoredBox> boxes, double iou) {
  std::stable_sort(boxes.begin(), boxes.end(),
                   [](const ScoredBox& a, const ScoredBox& b) { return a.score > b.score; });
  std::vector<ScoredBox> kept;
  for (const ScoredBox& box : boxes) {
    const bool doubled = std::any_of(kept.begin(), kept.end(), [&](const ScoredBox& stronger) {
      return stronger.class_number == box.class_number && IoU(stronger.box, box.box) > iou;
    });
    if (!doubled) {
      kept.push_back(box);
    }
  }
  return kept;
}

}  // namespace sqslam
