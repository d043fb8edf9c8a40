#pragma once

#include <Eigen/Core>
#include <map>
#include <string>

namespace sqslam {

// A style's own colours of classes, "#rrggbb" by label (`objects.colors`). Any label is allowed.
struct ClassColors : std::map<std::string, std::string> {
  void VisitFields(auto&& visit) {
    for (auto& [label, color] : *this) {
      visit(label, color);
    }
  }
};

// The colour of each class, which depends on its label alone: it is the same in every picture, video, page
// and exported file, whatever else a map holds. The classes of configs/classes.yaml have fixed colours
// (docs/rendering.md), any other label one that follows from its letters. Case, blanks and underscores make
// no difference.
class LabelColors {
 public:
  LabelColors() = default;
  // `own` replaces the built-in colours. Throws UsageError on an invalid one.
  explicit LabelColors(const ClassColors& own);

  Eigen::Vector3d operator()(const std::string& label) const;  // red, green, blue in [0, 1]

 private:
  std::map<std::string, Eigen::Vector3d> own_;  // by normalised label
};

}  // namespace sqslam
