#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "slam/evaluation/evaluation.h"
#include "slam/objects/object_options.h"

namespace sqslam {

// Evidence on an object that an error budget replaces by the truth, one part at a time, and all together.
//   poses        of the cameras that saw it
//   boxes        around the projected true solid, with what is hidden
//   edges        which edges of its boxes are free, neither hidden nor cut off
//   association  the boxes that overlap with the true solid's, and the map points that lie in it
//   yaw, support, shape   about the vertical, height of what it stands on, box or cylinder or ellipsoid
enum class TruePart { kPoses, kBoxes, kEdges, kAssociation, kYaw, kSupport, kShape, kAll };
constexpr auto EnumNames(TruePart) {
  return std::array{"poses", "boxes", "edges", "association", "yaw", "support", "shape", "all"};
}
inline constexpr std::size_t kTrueParts = EnumNames(TruePart()).size();

// 3D IoU of one mapped object with the truth.
struct ObjectBudget {
  int mapped = 0;        // index into Evaluation::mapped
  int truth = 0;         // index into Evaluation::truth
  double run_iou = 0.0;  // of the run
  double iou = 0.0;      // of the refit with the run's own evidence
  // IoU of refits with one part replaced by the truth; empty if too little evidence was left.
  std::array<std::optional<double>, kTrueParts> with;

  std::optional<double> Gain(std::size_t part) const {
    return with[part] ? std::optional(*with[part] - iou) : std::nullopt;
  }
};

struct ErrorBudget {
  Evaluation evaluation;
  std::vector<ObjectBudget> objects;  // in the order of the ground truth
};

// Refits every matched object from its evidence in the recording (boxes of the recorded frames, map points)
// and from lines in the images of these frames, with the estimator of the end of a run: once with the run's
// own evidence, then with one part replaced by the truth. The other objects stay as in the run. `options`:
// those of the run. Throws InputError if the truth or the recording lacks the required data.
ErrorBudget ComputeErrorBudget(const std::filesystem::path& result, const std::filesystem::path& sequence,
                               const ObjectOptions& options, const EvaluationOptions& evaluation = {});

std::string FormatBudget(const ErrorBudget& budget);                             // table for the terminal
void WriteBudget(const std::filesystem::path& path, const ErrorBudget& budget);  // budget.json

}  // namespace sqslam
