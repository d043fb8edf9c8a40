#pragma once

#include <array>
#include <cstddef>

#include "slam/objects/statistical_tests.h"

namespace sqslam {

// Tests that make up an association method.
//
// "box" is the overlap with the box predicted from the last frames, "projection" that with the outline of the
// landmark's superquadric, "points" the share of map points in common, "t-test" the two-sample test and
// "volume" the overlap of superquadrics.
struct AssociationParts {
  bool predicted_box = false;    // box, between consecutive frames
  bool projection = false;       // always
  bool points = false;           // always
  bool one_sample = false;       // one-sample t-test, after a gap
  bool rank_sum = false;         // after a gap; without the box also between consecutive frames
  bool other_labels = false;     // a box of another label may belong to a landmark
  bool merge_by_test = false;    // landmarks are merged by the two-sample t-test
  bool merge_by_volume = false;  // landmarks are merged by the overlap of their superquadrics
};

// Tests that assign a box to a landmark: the paper's (full), its ablations (iou, iou+points, iou+ttest), or
// those of other systems (nonparametric, ensemble).
enum class AssociationMethod { kFull, kIou, kIouPoints, kIouTTest, kNonparametric, kEnsemble };

struct NamedAssociation {
  const char* name;
  AssociationParts parts;
};

// The methods, in the order of AssociationMethod. A new one is a new row.
//
// | method        | in the next frames      | after a gap                           | merging        |
// | ------------- | ----------------------- | ------------------------------------- | -------------- |
// | full          | box, projection, points | projection, points, one-sample t-test | t-test, volume |
// | iou           | box                     | nothing: the object begins anew       | none           |
// | iou+points    | box, points             | points                                | none           |
// | iou+ttest     | box                     | one-sample t-test                     | t-test         |
// | nonparametric | rank-sum test           | rank-sum test                         | none           |
// | ensemble      | box                     | rank-sum test, else one-sample t-test | t-test         |
//
// full is the paper's association plus the tests on superquadrics; iou, iou+points and iou+ttest are its
// ablations. nonparametric: Iqbal and Gans, "Localization of Classified Objects in SLAM using Nonparametric
// Statistics and Clustering", IROS 2018 (with the depth gate instead of their clustering); ensemble: Wu et
// al., "EAO-SLAM", IROS 2020.
inline constexpr std::array<NamedAssociation, 6> kAssociations = {{
    {"full",
     {.predicted_box = true,
      .projection = true,
      .points = true,
      .one_sample = true,
      .other_labels = true,
      .merge_by_test = true,
      .merge_by_volume = true}},
    {"iou", {.predicted_box = true}},
    {"iou+points", {.predicted_box = true, .points = true}},
    {"iou+ttest", {.predicted_box = true, .one_sample = true, .merge_by_test = true}},
    {"nonparametric", {.rank_sum = true}},
    {"ensemble", {.predicted_box = true, .one_sample = true, .rank_sum = true, .merge_by_test = true}},
}};

constexpr auto EnumNames(AssociationMethod) {
  std::array<const char*, kAssociations.size()> names{};
  for (std::size_t i = 0; i < names.size(); ++i) {
    names[i] = kAssociations[i].name;
  }
  return names;
}

constexpr AssociationParts PartsOf(AssociationMethod method) {
  return kAssociations[static_cast<std::size_t>(method)].parts;
}

// Variants of the association steps.
struct AssociationRules {
  AssociationParts parts;
  OneSampleTest one_sample = OneSampleTest::kOfSingle;
  double least_spread = 0.1;  // least standard deviation of centroids, in units of the largest half size
  bool still = false;         // compares boxes with the last box instead of the predicted one
  bool points_later = true;   // shared points also count after a gap
};

}  // namespace sqslam
