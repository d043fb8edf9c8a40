#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <nlohmann/json.hpp>

#include "slam/evaluation/error_budget.h"
#include "slam/util/json_file.h"

namespace sqslam {
namespace fs = std::filesystem;
namespace {

// Mean IoU of the run and of the refit, and mean gain by part, over all or the scored objects.
struct MeanBudget {
  int objects = 0;
  double run_iou = 0.0;
  double iou = 0.0;
  std::array<double, kTrueParts> gain{};

  MeanBudget(const ErrorBudget& budget, bool only_scored) {
    std::array<int, kTrueParts> known{};
    for (const ObjectBudget& object : budget.objects) {
      if (only_scored && !budget.evaluation.Truth(object.truth).scored) {
        continue;
      }
      ++objects;
      run_iou += object.run_iou;
      iou += object.iou;
      for (std::size_t part = 0; part < kTrueParts; ++part) {
        known[part] += object.with[part] ? 1 : 0;
        gain[part] += object.Gain(part).value_or(0.0);
      }
    }
    run_iou /= std::max(1, objects);
    iou /= std::max(1, objects);
    for (std::size_t part = 0; part < kTrueParts; ++part) {
      gain[part] /= std::max(1, known[part]);
    }
  }
};

nlohmann::ordered_json MeanJson(const MeanBudget& mean) {
  nlohmann::ordered_json gains;
  for (std::size_t part = 0; part < kTrueParts; ++part) {
    gains[EnumNames(TruePart())[part]] = mean.gain[part];
  }
  return {{"objects", mean.objects}, {"iou_run", mean.run_iou}, {"iou", mean.iou}, {"gain", gains}};
}

}  // namespace

std::string FormatBudget(const ErrorBudget& budget) {
  const Evaluation& evaluation = budget.evaluation;
  std::string text;
  const auto out = std::back_inserter(text);
  fmt::format_to(
      out, "3D IoU of {} refitted objects, and its gain from each part of the truth\n\n  {:<24} {:>6} {:>6}",
      budget.objects.size(), "ground truth", "run", "refit");
  for (const char* name : EnumNames(TruePart())) {
    fmt::format_to(out, " {:>11}", name);
  }
  for (const ObjectBudget& object : budget.objects) {
    fmt::format_to(out, "\n  {:<24} {:>6.3f} {:>6.3f}", NumberedName(evaluation.Truth(object.truth)),
                   object.run_iou, object.iou);
    for (std::size_t part = 0; part < kTrueParts; ++part) {
      const std::optional<double> gain = object.Gain(part);
      fmt::format_to(out, " {:>11}", gain ? fmt::format("{:+.3f}", *gain) : "-");
    }
  }
  for (const bool only_scored : {false, true}) {
    if (only_scored && !evaluation.has_scored) {
      continue;
    }
    const MeanBudget mean(budget, only_scored);
    fmt::format_to(out, "\n  {:<24} {:>6.3f} {:>6.3f}", only_scored ? "mean of the scored ones" : "mean",
                   mean.run_iou, mean.iou);
    for (const double gain : mean.gain) {
      fmt::format_to(out, " {:>+11.3f}", gain);
    }
  }
  return text + "\n";
}

void WriteBudget(const fs::path& path, const ErrorBudget& budget) {
  const Evaluation& evaluation = budget.evaluation;
  nlohmann::ordered_json objects = nlohmann::ordered_json::array();
  for (const ObjectBudget& object : budget.objects) {
    const GroundTruthObject& truth = evaluation.Truth(object.truth);
    nlohmann::ordered_json gains;
    for (std::size_t part = 0; part < kTrueParts; ++part) {
      const std::optional<double> gain = object.Gain(part);
      gains[EnumNames(TruePart())[part]] = gain ? nlohmann::ordered_json(*gain) : nlohmann::ordered_json();
    }
    objects.push_back({{"object", evaluation.Mapped(object.mapped).id},
                       {"ground_truth", truth.id},
                       {"name", ShownName(truth)},
                       {"scored", truth.scored},
                       {"iou_run", object.run_iou},
                       {"iou", object.iou},
                       {"gain", gains}});
  }
  nlohmann::ordered_json document = {{"format", "sqslam-budget"},
                                     {"version", 1},
                                     {"ground_truth", evaluation.sequence},
                                     {"objects", objects},
                                     {"mean", MeanJson(MeanBudget(budget, false))}};
  if (evaluation.has_scored) {
    document["mean_scored"] = MeanJson(MeanBudget(budget, true));
  }
  WriteJsonFile(path, document);
}

}  // namespace sqslam
