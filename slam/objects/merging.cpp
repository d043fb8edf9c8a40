#include "slam/objects/merging.h"

#include <algorithm>

#include "slam/objects/association.h"
#include "slam/objects/landmark_geometry.h"

namespace sqslam {

int FramesSeenApart(const Landmark& a, const Landmark& b, bool parts_are_one, int enough) {
  constexpr double kOneThing = 0.4;  // IoU
  constexpr double kPart = 0.6;      // of the smaller box
  int count = 0;
  auto i = a.views.begin();
  auto j = b.views.begin();
  while (i != a.views.end() && j != b.views.end() && count < enough) {
    if (i->frame_index < j->frame_index) {
      ++i;
    } else if (j->frame_index < i->frame_index) {
      ++j;
    } else {
      const bool one =
          IoU(i->box, j->box) >= kOneThing || (parts_are_one && ShareOfSmaller(i->box, j->box) >= kPart);
      count += one ? 0 : 1;
      ++i;
      ++j;
    }
  }
  return count;
}

bool AreSameObject(const Landmark& a, const Landmark& b, const AssociationOptions& association,
                   const MergingOptions& options) {
  constexpr double kPart = 0.75;  // of the smaller volume
  const AssociationParts parts = PartsOf(association);
  const bool same_label = a.labels.Best() == b.labels.Best();
  const int limit = std::max(options.max_seen_together,
                             static_cast<int>(options.max_seen_together_share *
                                              static_cast<double>(std::min(a.views.size(), b.views.size()))));
  // Neighbours are soon seen apart: that spares nearly all pairs the shared volume.
  if (FramesSeenApart(a, b, same_label, limit + 1) > limit) {
    return false;
  }
  const double size_a = a.estimated ? a.superquadric.shape.half_size.maxCoeff() : 0.0;
  const double size_b = b.estimated ? b.superquadric.shape.half_size.maxCoeff() : 0.0;
  bool same = false;
  bool is_part = false;
  if (parts.merge_by_test && same_label && a.centroids.count >= options.min_samples &&
      b.centroids.count >= options.min_samples) {
    // The spread of centroids is at least a tenth of the object; else long histories would never agree.
    const double min_sigma = 0.1 * std::min(size_a, size_b);
    same = AreSamePopulation(a.centroids, b.centroids, options.alpha, min_sigma, MeanTestOf(association));
  }
  if (!same && parts.merge_by_volume && a.estimated && b.estimated) {
    const double needed = same_label ? options.overlap : options.overlap_other_label;
    const double shared = OverlapOfSmaller(a.superquadric, b.superquadric);
    same = shared > needed;
    is_part = same_label && shared > kPart;
  }
  return same && FramesSeenApart(a, b, is_part, limit + 1) <= limit;
}

}  // namespace sqslam
