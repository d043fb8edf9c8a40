#include "slam/evaluation/evaluation.h"

#include <fmt/format.h>

#include <algorithm>

#include "slam/io/result_files.h"
#include "slam/util/throw_if.h"

namespace sqslam {
namespace {

IouSummary Summarize(const Evaluation& evaluation, bool only_scored) {
  const auto counts = [&](const GroundTruthObject& object) { return !only_scored || object.scored; };
  IouSummary summary;
  summary.objects = static_cast<int>(std::ranges::count_if(evaluation.truth, counts));
  double sum = 0.0;
  double sum_ellipsoid = 0.0;
  for (const ObjectMatch& match : evaluation.objects.matches) {
    if (counts(evaluation.Truth(match.truth))) {
      ++summary.matched;
      summary.matched_25 += match.iou >= 0.25 ? 1 : 0;
      summary.matched_50 += match.iou >= 0.5 ? 1 : 0;
      sum += match.iou;
      sum_ellipsoid += match.iou_ellipsoid;
    }
  }
  summary.mean = sum / std::max(1, summary.matched);
  summary.mean_ellipsoid = sum_ellipsoid / std::max(1, summary.matched);
  summary.mean_all = sum / std::max(1, summary.objects);
  return summary;
}

std::vector<CoverageCount> CountCoverage(const Evaluation& evaluation) {
  std::vector<CoverageCount> coverage;
  for (const int min_detections : {20, 60}) {
    CoverageCount count{min_detections, 0, 0};
    const auto qualifies = [&](int truth) { return evaluation.Truth(truth).detections >= min_detections; };
    for (const ObjectMatch& match : evaluation.objects.matches) {
      count.mapped += qualifies(match.truth) ? 1 : 0;
    }
    count.total =
        count.mapped + static_cast<int>(std::ranges::count_if(evaluation.objects.missed, qualifies));
    coverage.push_back(count);
  }
  return coverage;
}

std::vector<ReliabilityBin> ReliabilityCurve(const Evaluation& evaluation) {
  constexpr int kBins = 5;
  std::vector<double> ious(evaluation.mapped.size(), 0.0);
  for (const ObjectMatch& match : evaluation.objects.matches) {
    ious[static_cast<std::size_t>(match.mapped)] = match.iou;
  }
  std::vector<ReliabilityBin> bins;
  for (int i = 0; i < kBins; ++i) {
    bins.push_back({static_cast<double>(i) / kBins});
  }
  for (std::size_t i = 0; i < ious.size(); ++i) {
    const double reliability = evaluation.mapped[i].fit.reliability;
    ReliabilityBin& bin =
        bins[static_cast<std::size_t>(std::clamp(static_cast<int>(kBins * reliability), 0, kBins - 1))];
    bin.mean_iou = (bin.mean_iou * bin.objects + ious[i]) / (bin.objects + 1);
    ++bin.objects;
  }
  return bins;
}

std::vector<ExtraLandmark> DescribeExtra(const Evaluation& evaluation) {
  std::vector<ExtraLandmark> described;
  for (const int index : evaluation.objects.extra) {
    const Solid solid = Transform(evaluation.trajectory.S_world_map,
                                  Solid::FromSuperquadric(evaluation.Mapped(index).superquadric));
    ExtraLandmark extra;
    extra.mapped = index;
    extra.center_world = solid.T_map_object.translation;
    extra.half_size = solid.half_size;
    for (std::size_t i = 0; i < evaluation.truth.size(); ++i) {
      const double distance =
          (evaluation.truth[i].solid.T_map_object.translation - extra.center_world).norm();
      if (extra.nearest < 0 || distance < extra.distance) {
        extra.nearest = static_cast<int>(i);
        extra.distance = distance;
      }
    }
    if (extra.nearest >= 0) {
      const Solid& nearest = evaluation.Truth(extra.nearest).solid;
      extra.iou = IoU(solid, nearest);
      extra.inside = ShareInside(solid, nearest, extra.iou);
    }
    described.push_back(extra);
  }
  return described;
}

std::string TimeSpan(const Trajectory& trajectory) {
  return trajectory.empty() ? "no poses"
                            : fmt::format("{} poses from {:.3f} s to {:.3f} s", trajectory.size(),
                                          trajectory.front().timestamp, trajectory.back().timestamp);
}

}  // namespace

TrajectoryError AlignWithTruth(const Trajectory& estimated, const GroundTruth& truth,
                               const EvaluationOptions& options, const std::string& where) {
  const auto error =
      ComputeTrajectoryError(estimated, truth.trajectory, options.max_time_difference, options.alignment);
  if (!error) {
    throw InputError(
        "{}: cannot be aligned ({}; ground truth: {}), expected at least three poses at the same times that "
        "do not lie on one line",
        where, TimeSpan(estimated), TimeSpan(truth.trajectory));
  }
  return *error;
}

Evaluation Evaluate(const Trajectory& estimated, const std::vector<SnapshotObject>& mapped,
                    const GroundTruth& truth, const EvaluationOptions& options, const std::string& where) {
  const TrajectoryError error = AlignWithTruth(estimated, truth, options, where);
  ThrowIf<InputError>(static_cast<int>(estimated.size()) > truth.frames,
                      "{}: {} poses, but the sequence of the ground truth has {} frames; expected the "
                      "sequence that was mapped",
                      where, estimated.size(), truth.frames);
  Evaluation evaluation;
  evaluation.frames = truth.frames;
  evaluation.tracked = static_cast<int>(estimated.size());
  evaluation.tracked_share = static_cast<double>(evaluation.tracked) / truth.frames;
  evaluation.trajectory = error;
  evaluation.mapped = mapped;
  const Sim3d S_map_world = error.S_world_map.Inverse();
  for (const TimedPose& pose : truth.trajectory) {
    evaluation.truth_positions_map.push_back(S_map_world * pose.T_map_camera.translation);
  }
  if (truth.has_objects) {
    evaluation.has_objects = true;
    evaluation.has_detection_counts = truth.has_detection_counts;
    evaluation.has_scored = truth.has_scored;
    evaluation.truth = truth.objects;
    evaluation.objects = MatchObjects(mapped, truth.objects, error.S_world_map, options.min_iou);
    evaluation.iou = Summarize(evaluation, false);
    evaluation.scored_iou = Summarize(evaluation, true);
    evaluation.extra = DescribeExtra(evaluation);
    evaluation.reliability = ReliabilityCurve(evaluation);
    evaluation.uncertain = static_cast<int>(
        std::ranges::count_if(mapped, [](const SnapshotObject& o) { return !IsReliable(o); }));
    evaluation.extra_reliable = static_cast<int>(std::ranges::count_if(
        evaluation.objects.extra, [&](int index) { return IsReliable(evaluation.Mapped(index)); }));
    if (truth.has_detection_counts) {
      evaluation.coverage = CountCoverage(evaluation);
    }
  }
  return evaluation;
}

Evaluation EvaluateResult(const std::filesystem::path& result, const std::filesystem::path& sequence,
                          const EvaluationOptions& options) {
  ThrowIf<InputError>(!std::filesystem::is_directory(result),
                      "{}: no such folder; expected the result folder of a run", result.string());
  const std::filesystem::path trajectory = result / "trajectory.txt";
  const Trajectory estimated = ReadTrajectory(trajectory);
  const std::vector<SnapshotObject> mapped = ReadObjects(result / "objects.json");
  Evaluation evaluation =
      Evaluate(estimated, mapped, ReadGroundTruth(sequence), options, trajectory.string());
  evaluation.sequence = sequence.string();
  return evaluation;
}

}  // namespace sqslam
