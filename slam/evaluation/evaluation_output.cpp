#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <iterator>
#include <nlohmann/json.hpp>

#include "slam/evaluation/evaluation.h"
#include "slam/geometry/angles.h"
#include "slam/util/atomic_file.h"
#include "slam/util/json_file.h"
#include "slam/util/thinned.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace {

using nlohmann::ordered_json;

ordered_json TrajectoryJson(const Evaluation& evaluation) {
  const TrajectoryError& error = evaluation.trajectory;
  return {{"ate_rmse", error.rmse},
          {"ate_mean", error.mean},
          {"ate_median", error.median},
          {"ate_max", error.max},
          {"pairs", error.pairs},
          {"path_length", error.path_length},
          {"ate_share_of_path", error.path_length > 0.0 ? error.rmse / error.path_length : 0.0},
          {"S_world_map",
           {{"scale", error.S_world_map.scale},
            {"rotation", error.S_world_map.rotation.coeffs()},
            {"translation", error.S_world_map.translation}}}};
}

ordered_json TruthJson(const GroundTruthObject& truth) {
  return {{"ground_truth", truth.id},
          {"name", ShownName(truth)},
          {"label", truth.label},
          {"detections", truth.detections},
          {"scored", truth.scored}};
}

ordered_json ObjectsJson(const Evaluation& evaluation) {
  ordered_json matched = ordered_json::array();
  for (const ObjectMatch& match : evaluation.objects.matches) {
    const GroundTruthObject& truth = evaluation.Truth(match.truth);
    const SnapshotObject& mapped = evaluation.Mapped(match.mapped);
    ordered_json entry = TruthJson(truth);
    entry.update({{"object", mapped.id},
                  {"object_label", mapped.label},
                  {"label_agrees", match.label_agrees},
                  {"iou", match.iou},
                  {"iou_ellipsoid", match.iou_ellipsoid},
                  {"center_error", match.center_error},
                  {"size_error", match.size_error},
                  {"tilt_error", match.tilt_error},
                  {"yaw_error", match.yaw_error},
                  {"thin", IsThin(truth.solid)},
                  {"footprint_iou", match.footprint_iou}});
    matched.push_back(std::move(entry));
  }
  ordered_json extra = ordered_json::array();
  for (const ExtraLandmark& landmark : evaluation.extra) {
    const SnapshotObject& mapped = evaluation.Mapped(landmark.mapped);
    ordered_json entry = {{"object", mapped.id},
                          {"label", mapped.label},
                          {"observations", mapped.observations},
                          {"center_world", landmark.center_world},
                          {"half_size", landmark.half_size}};
    if (landmark.nearest >= 0) {
      const GroundTruthObject& nearest = evaluation.Truth(landmark.nearest);
      entry["nearest"] = {{"ground_truth", nearest.id},
                          {"name", ShownName(nearest)},
                          {"distance", landmark.distance},
                          {"iou", landmark.iou},
                          {"inside", landmark.inside}};
    }
    extra.push_back(std::move(entry));
  }
  const auto duplicates = ToVector(evaluation.objects.duplicates, [&](const ObjectDuplicate& duplicate) {
    return ordered_json{{"object", evaluation.Mapped(duplicate.mapped).id},
                        {"ground_truth", evaluation.Truth(duplicate.truth).id}};
  });
  const auto missed =
      ToVector(evaluation.objects.missed, [&](int index) { return TruthJson(evaluation.Truth(index)); });
  return {{"matched", matched}, {"missed", missed}, {"extra", extra}, {"duplicates", duplicates}};
}

double Share(int part, int whole) { return whole > 0 ? static_cast<double>(part) / whole : 0.0; }

ordered_json SummaryJson(const Evaluation& evaluation) {
  const ObjectMatching& objects = evaluation.objects;
  const auto agreeing =
      std::ranges::count_if(objects.matches, [](const ObjectMatch& match) { return match.label_agrees; });
  ordered_json summary = {{"ground_truth", evaluation.truth.size()},
                          {"mapped", evaluation.mapped.size()},
                          {"matched", objects.matches.size()},
                          {"missed", objects.missed.size()},
                          {"extra", objects.extra.size()},
                          {"duplicates", objects.duplicates.size()},
                          {"uncertain", evaluation.uncertain},
                          {"extra_reliable", evaluation.extra_reliable},
                          {"labels_agree", agreeing},
                          {"recall_25", Share(evaluation.iou.matched_25, evaluation.iou.objects)},
                          {"recall_50", Share(evaluation.iou.matched_50, evaluation.iou.objects)},
                          {"mean_iou", evaluation.iou.mean},
                          {"mean_iou_ellipsoid", evaluation.iou.mean_ellipsoid},
                          {"mean_iou_all", evaluation.iou.mean_all}};
  if (evaluation.has_scored) {
    const IouSummary& scored = evaluation.scored_iou;
    summary["scored"] = scored.objects;
    summary["scored_matched"] = scored.matched;
    summary["recall_25_scored"] = Share(scored.matched_25, scored.objects);
    summary["recall_50_scored"] = Share(scored.matched_50, scored.objects);
    summary["mean_iou_scored"] = scored.mean;
    summary["mean_iou_scored_ellipsoid"] = scored.mean_ellipsoid;
    summary["mean_iou_scored_all"] = scored.mean_all;
  }
  summary["reliability"] = ToVector(evaluation.reliability, [](const ReliabilityBin& bin) {
    return ordered_json{{"least", bin.least}, {"objects", bin.objects}, {"mean_iou", bin.mean_iou}};
  });
  summary["coverage"] = ToVector(evaluation.coverage, [](const CoverageCount& c) {
    return ordered_json{{"min_detections", c.min_detections}, {"mapped", c.mapped}, {"total", c.total}};
  });
  return summary;
}

void FormatIou(std::string_view name, const IouSummary& iou, std::back_insert_iterator<std::string> out) {
  fmt::format_to(out,
                 "{:<18} {:.3f} over {} of {} matched (as ellipsoids {:.3f}; missed ones as 0: {:.3f})\n",
                 name, iou.mean, iou.matched, iou.objects, iou.mean_ellipsoid, iou.mean_all);
  fmt::format_to(out, "  recall           {:.2f} at IoU 0.25 ({} of {}), {:.2f} at IoU 0.5 ({} of {})\n",
                 Share(iou.matched_25, iou.objects), iou.matched_25, iou.objects,
                 Share(iou.matched_50, iou.objects), iou.matched_50, iou.objects);
}

void FormatObjectTable(const Evaluation& evaluation, std::back_insert_iterator<std::string> out) {
  fmt::format_to(out, "\n  {:<22} {:<16} {:>6} {:>6} {:>8} {:>9} {:>9} {:>6} {:>6}\n", "ground truth",
                 "mapped as", "boxes", "IoU", "ellips.", "centre m", "size m", "tilt°", "yaw°");
  for (const ObjectMatch& match : evaluation.objects.matches) {
    const GroundTruthObject& truth = evaluation.Truth(match.truth);
    const SnapshotObject& mapped = evaluation.Mapped(match.mapped);
    fmt::format_to(out, "  {:<22} {:<16} {:>6} {:>6.3f} {:>8.3f} {:>9.4f} {:>9.4f} {:>6.1f} {:>6.1f}{}{}\n",
                   NumberedName(truth), NumberedName(mapped), truth.detections, match.iou,
                   match.iou_ellipsoid, match.center_error, match.size_error,
                   match.tilt_error * kDegreesPerRadian, match.yaw_error * kDegreesPerRadian,
                   IsThin(truth.solid) ? fmt::format("  footprint {:.3f}", match.footprint_iou) : "",
                   evaluation.has_scored && truth.scored ? "  scored" : "");
  }
  for (const int index : evaluation.objects.missed) {
    const GroundTruthObject& truth = evaluation.Truth(index);
    fmt::format_to(out, "  {:<22} {:<16} {:>6}{}\n", NumberedName(truth), "missed", truth.detections,
                   evaluation.has_scored && truth.scored ? "  scored" : "");
  }
  for (const ObjectDuplicate& duplicate : evaluation.objects.duplicates) {
    fmt::format_to(out, "  {:<22} {}\n", fmt::format("{} duplicate", evaluation.Truth(duplicate.truth).id),
                   NumberedName(evaluation.Mapped(duplicate.mapped)));
  }
}

void FormatExtra(const Evaluation& evaluation, std::back_insert_iterator<std::string> out) {
  if (evaluation.extra.empty()) {
    return;
  }
  fmt::format_to(out, "\n  {:<22} {:>6} {:>23} {:>20}  {}\n", "no ground truth", "seen",
                 "centre in the world m", "half sizes m", "nearest ground truth");
  for (const ExtraLandmark& extra : evaluation.extra) {
    const SnapshotObject& mapped = evaluation.Mapped(extra.mapped);
    fmt::format_to(out, "  {:<22} {:>6} {:>23} {:>20}", NumberedName(mapped), mapped.observations,
                   fmt::format("{:.2f}", fmt::join(extra.center_world, " ")),
                   fmt::format("{:.3f}", fmt::join(extra.half_size, " ")));
    if (extra.nearest >= 0) {
      const GroundTruthObject& nearest = evaluation.Truth(extra.nearest);
      fmt::format_to(out, "  {} {}, {:.2f} m away, IoU {:.3f}, {:.0f} % inside", nearest.id,
                     ShownName(nearest), extra.distance, extra.iou, 100.0 * extra.inside);
    }
    fmt::format_to(out, "\n");
  }
}

}  // namespace

std::string NumberedName(const GroundTruthObject& object) {
  return fmt::format("{} {}", object.id, ShownName(object));
}

std::string NumberedName(const SnapshotObject& object) {
  return fmt::format("{} {}", object.id, object.label);
}

std::string FormatEvaluation(const Evaluation& evaluation) {
  std::string text;
  const auto out = std::back_inserter(text);
  const TrajectoryError& error = evaluation.trajectory;
  fmt::format_to(out, "frames tracked     {} of {} ({:.1f} %)\n", evaluation.tracked, evaluation.frames,
                 100.0 * evaluation.tracked_share);
  fmt::format_to(out, "ATE RMSE           {:.4f} m (median {:.4f}, max {:.4f}; {} poses, Sim(3) alignment)\n",
                 error.rmse, error.median, error.max, error.pairs);
  fmt::format_to(out, "path length        {:.2f} m; ATE is {:.2f} % of it\n", error.path_length,
                 error.path_length > 0.0 ? 100.0 * error.rmse / error.path_length : 0.0);
  if (!evaluation.has_objects) {
    fmt::format_to(out, "objects            {} mapped; the sequence has no objects_gt.json\n",
                   evaluation.mapped.size());
    return text;
  }
  const ObjectMatching& objects = evaluation.objects;
  fmt::format_to(out, "objects            {} matched, {} missed, {} extra, {} duplicates\n",
                 objects.matches.size(), objects.missed.size(), objects.extra.size(),
                 objects.duplicates.size());
  if (evaluation.uncertain > 0) {
    fmt::format_to(out, "  uncertain        {} of {} mapped; {} of the extra ones are reliable\n",
                   evaluation.uncertain, evaluation.mapped.size(), evaluation.extra_reliable);
  }
  fmt::format_to(out, "  by reliability  ");
  for (const ReliabilityBin& bin : evaluation.reliability) {
    if (bin.objects > 0) {
      fmt::format_to(out, " {:.1f}: IoU {:.2f} of {}{}", bin.least, bin.mean_iou, bin.objects,
                     &bin == &evaluation.reliability.back() ? "" : ";");
    }
  }
  fmt::format_to(out, "\n");
  for (const CoverageCount& count : evaluation.coverage) {
    fmt::format_to(out, "  with {} or more detections mapped: {} of {}\n", count.min_detections, count.mapped,
                   count.total);
  }
  FormatIou("mean 3D IoU", evaluation.iou, out);
  if (evaluation.has_scored) {
    FormatIou("  scored objects", evaluation.scored_iou, out);
  }
  FormatObjectTable(evaluation, out);
  FormatExtra(evaluation, out);
  return text;
}

std::string EvaluationJson(const Evaluation& evaluation) {
  ordered_json document = {{"format", "sqslam-eval"},
                           {"version", 1},
                           {"ground_truth", evaluation.sequence},
                           {"frames", evaluation.frames},
                           {"tracked", evaluation.tracked},
                           {"tracked_share", evaluation.tracked_share},
                           {"trajectory", TrajectoryJson(evaluation)}};
  if (evaluation.has_objects) {
    document["summary"] = SummaryJson(evaluation);
    document["objects"] = ObjectsJson(evaluation);
  }
  constexpr std::size_t kMaxPositions = 500;  // for a plot
  document["ground_truth_positions_map"] = Thinned(evaluation.truth_positions_map, kMaxPositions);
  return JsonText(document) + "\n";
}

void WriteEvaluation(const std::filesystem::path& path, const Evaluation& evaluation) {
  WriteFileAtomically(path, EvaluationJson(evaluation));
}

std::vector<ObjectScore> ScoresIn(const nlohmann::ordered_json& eval) {
  std::vector<ObjectScore> scores;
  for (const bool found : {true, false}) {
    for (const auto& entry : eval.at("objects").at(found ? "matched" : "missed")) {
      const auto iou = [&](const char* key) { return found ? entry.at(key).get<double>() : 0.0; };
      scores.push_back({entry.at("ground_truth").get<int>(), entry.at("name").get<std::string>(),
                        entry.at("label").get<std::string>(), entry.at("scored").get<bool>(), found,
                        iou("iou"), iou("iou_ellipsoid")});
    }
  }
  std::ranges::sort(scores, {}, &ObjectScore::id);
  return scores;
}

}  // namespace sqslam
