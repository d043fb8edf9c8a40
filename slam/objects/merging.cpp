#include "slam/objects/merging.h"

#include <algorithm>
#include <utility>

#include "slam/objects/association.h"
#include "slam/objects/landmark_estimation.h"
#include "slam/objects/landmark_geometry.h"

namespace sqslam {

namespace {

// Counts frames, up to `enough`, in which both have a box and the predicate holds for the two boxes.
template <typename Predicate>
int CountFrames(const Landmark& a, const Landmark& b, int enough, Predicate&& are_as_asked) {
  if (a.views.empty() || b.views.empty()) {
    return 0;
  }
  // Earlier frames lack one of the two. Of most pairs in a long run no frame is left.
  const std::int64_t first = std::max(a.views.front().frame_index, b.views.front().frame_index);
  auto i = std::ranges::lower_bound(a.views, first, {}, &BoxView::frame_index);
  auto j = std::ranges::lower_bound(b.views, first, {}, &BoxView::frame_index);
  int count = 0;
  while (i != a.views.end() && j != b.views.end() && count < enough) {
    if (i->frame_index < j->frame_index) {
      ++i;
    } else if (j->frame_index < i->frame_index) {
      ++j;
    } else {
      count += are_as_asked(i->box, j->box) ? 1 : 0;
      ++i;
      ++j;
    }
  }
  return count;
}

bool AreRarelySeenTogether(const Landmark& a, const Landmark& b, const MergingOptions& options) {
  return !AreSeenTogether(a, b, options.max_seen_together);
}

// Returns the overlap, share of the smaller volume, above which two landmarks are duplicates.
double OverlapOfOne(const Landmark& a, const Landmark& b, bool same_label, const MergingOptions& options) {
  constexpr double kReachIn = 0.15;  // distinct objects do not intersect, so little is enough
  if (!same_label) {
    return options.overlap_other_label;
  }
  return AreSeenTogether(a, b) ? options.overlap : std::min(kReachIn, options.overlap);
}

constexpr double kAgrees = 0.5;  // mean IoU from which on one explains the boxes of another

// Mean IoU of some boxes of the landmark with the projection of another.
double AgreementWith(const Landmark& other, const Landmark& landmark, const Camera& camera) {
  constexpr int kMaxViews = 10;
  return BoxAgreement(other.superquadric, SpreadViews(landmark.views, kMaxViews), camera);
}

// True if each explains the other's boxes about as well as its own.
bool ExplainEachOther(const Landmark& a, const Landmark& b, const Camera& camera) {
  constexpr double kShareOfOwn = 0.9;
  const auto explains = [&](const Landmark& one, const Landmark& other) {
    return AgreementWith(one, other, camera) >=
           std::max(kAgrees, kShareOfOwn * AgreementWith(other, other, camera));
  };
  return explains(a, b) && explains(b, a);
}

// True if the boxes of the rarer one, which has another label, are those of the other. Overlap alone says
// little: a chair pushed under a table lies within the table's superquadric.
bool IsOneOfTwoLabels(const Landmark& a, const Landmark& b, const Camera& camera) {
  const bool a_is_rarer = a.observations < b.observations;
  return (a_is_rarer ? AgreementWith(b, a, camera) : AgreementWith(a, b, camera)) >= kAgrees;
}

// A detector boxes many objects twice for a while, such as a chair and its back; but what it boxes twice in
// most frames is two objects: stacked books.
bool AreMostlySeenTogether(const Landmark& a, const Landmark& b) {
  constexpr double kMajority = 0.5;
  constexpr double kFew = 5.0;
  const double more = static_cast<double>(std::max(a.views.size(), b.views.size()));
  const int enough = static_cast<int>(std::max(kFew, kMajority * more)) + 1;
  return CountFrames(a, b, enough, [](auto&&...) { return true; }) >= enough;
}

// True if nearly all boxes of `part` lie within the projection of `whole`, and neither is behind the other. A
// detector often boxes the picture on a screen instead of the screen; seen from one side, the superquadric of
// such boxes hardly overlaps the screen's.
bool ShowsPartOf(const Landmark& part, const Landmark& whole, double shared, const MergingOptions& options,
                 const Camera& camera) {
  constexpr double kInside = 0.8;  // of a box
  constexpr double kViews = 0.8;
  constexpr double kShared = 0.05;  // of the smaller volume
  constexpr int kMaxViews = 10;
  if (shared < kShared || 2 * part.observations > whole.observations ||
      !AreRarelySeenTogether(part, whole, options)) {
    return false;
  }
  const std::vector<BoxView> views = SpreadViews(part.views, kMaxViews);
  const auto inside = std::ranges::count_if(views, [&](const BoxView& view) {
    const auto box = ProjectToBox(whole.superquadric, view.T_map_camera, camera);
    const Box2d own = UndistortBox(view.box, camera);
    return box && own.Area() <= box->Area() && IntersectionOverSmaller(own, *box) >= kInside;
  });
  return static_cast<double>(inside) >= kViews * static_cast<double>(views.size());
}

}  // namespace

bool AreSeenTogether(const Landmark& a, const Landmark& b, int more_than) {
  return CountFrames(a, b, more_than + 1, [](auto&&...) { return true; }) > more_than;
}

int FramesSeenApart(const Landmark& a, const Landmark& b, bool parts_are_one, int enough) {
  constexpr double kOneThing = 0.4;  // IoU
  constexpr double kPart = 0.6;      // of the smaller box
  return CountFrames(a, b, enough, [&](const Box2d& box_a, const Box2d& box_b) {
    return IoU(box_a, box_b) < kOneThing &&
           !(parts_are_one && IntersectionOverSmaller(box_a, box_b) >= kPart);
  });
}

bool OccupySamePlace(const Landmark& a, const Landmark& b, const Camera& camera) {
  constexpr double kShared = 0.6;       // of the smaller volume
  constexpr double kLeastShared = 0.3;  // the same, if no frame shows them apart, of two labels, or if each
                                        // explains the other's boxes
  constexpr double kFlatShared = 0.1;   // the same, of two labels that are rarely boxed in one frame
  constexpr double kApart = 0.25;       // of the views of the rarer one, in which they may seem apart
  if (!a.refined || !b.refined || AreMostlySeenTogether(a, b)) {
    return false;
  }
  const int limit = static_cast<int>(kApart * static_cast<double>(std::min(a.views.size(), b.views.size())));
  const int apart = FramesSeenApart(a, b, true, limit + 1);
  if (apart > limit) {
    return false;
  }
  const double shared = OverlapOfSmaller(a.superquadric, b.superquadric);
  if (a.labels.Best() == b.labels.Best()) {
    return shared > kShared || (shared > kLeastShared && (apart == 0 || ExplainEachOther(a, b, camera)));
  }
  return shared > (AreSeenTogether(a, b, limit) ? kLeastShared : kFlatShared) &&
         AgreementWith(a, b, camera) >= kAgrees && AgreementWith(b, a, camera) >= kAgrees;
}

bool AreDuplicates(const Landmark& a, const Landmark& b, const ObjectOptions& all, const Camera& camera) {
  const AssociationRules rules = RulesOf(all.association);
  const AssociationParts& parts = rules.parts;
  const MergingOptions& options = all.merging;
  const bool same_label = a.labels.Best() == b.labels.Best();
  const double size_a = a.estimated ? a.superquadric.shape.half_size.maxCoeff() : 0.0;
  const double size_b = b.estimated ? b.superquadric.shape.half_size.maxCoeff() : 0.0;
  const auto passes_t_test = [&] {
    // The spread of centroids has a lower bound, or long histories would never agree.
    return parts.merge_by_test && same_label && a.centroids.count >= options.min_samples &&
           b.centroids.count >= options.min_samples &&
           AreSamePopulation(a.centroids, b.centroids, options.alpha,
                             rules.least_spread * std::min(size_a, size_b));
  };
  if (options.by_test_alone) {
    return passes_t_test();
  }
  // A detector boxes one thing apart under one label now and then, but hardly ever under two at once.
  const int share = static_cast<int>(options.max_seen_together_share *
                                     static_cast<double>(std::min(a.views.size(), b.views.size())));
  const int limit = same_label ? std::max(options.max_seen_together, share) : share;
  // Neighbours are soon seen apart, so nearly all pairs skip the costly overlap.
  if (FramesSeenApart(a, b, same_label, limit + 1) > limit || AreMostlySeenTogether(a, b)) {
    return false;
  }
  bool same = passes_t_test();
  bool is_part = false;
  if (!same && parts.merge_by_volume && a.estimated && b.estimated) {
    const double shared = OverlapOfSmaller(a.superquadric, b.superquadric);
    same = shared > OverlapOfOne(a, b, same_label, options) && (same_label || IsOneOfTwoLabels(a, b, camera));
    is_part = same_label &&
              (ShowsPartOf(a, b, shared, options, camera) || ShowsPartOf(b, a, shared, options, camera));
    same = same || is_part;
  }
  return same && FramesSeenApart(a, b, is_part, limit + 1) <= limit;
}

}  // namespace sqslam
