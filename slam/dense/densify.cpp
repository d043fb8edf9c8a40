#include "slam/dense/densify.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <set>
#include <vector>

#include "slam/dense/dense_cloud.h"
#include "slam/dense/depth_estimation.h"
#include "slam/dense/live_depth.h"
#include "slam/dense/surface_fusion.h"
#include "slam/snapshot/depth_recording.h"
#include "slam/snapshot/recording.h"
#include "slam/util/error.h"
#include "slam/util/markup.h"
#include "slam/util/options.h"

namespace sqslam {
namespace fs = std::filesystem;
namespace {

// Throws NoMapError if no keyframe can have depth.
void CheckMotion(const DensifyRequest& request, const DenseInput& input,
                 const std::vector<KeyframePlan>& plans) {
  if (std::ranges::any_of(plans, [](const auto& plan) { return plan.range.has_value(); })) {
    return;
  }
  if (input.keyframes.size() < 3) {
    throw NoMapError("{}: {} keyframes, expected at least three of the same place", request.result.string(),
                     input.keyframes.size());
  }
  throw NoMapError(
      "{}: no depth: none of the {} keyframes has two other frames that show the same place from at least {} "
      "degrees to the side, expected a camera that moves sideways",
      request.result.string(), input.keyframes.size(), kMinViewAngle);
}

struct PlannedInput {
  DenseInput input;
  std::vector<KeyframePlan> plans;
};

PlannedInput PlanAll(const DensifyRequest& request) {
  CheckOptions(request.options);
  PlannedInput all{ReadDenseInput(request.result, request.images, request.options), {}};
  all.plans = PlanKeyframes(all.input, request.options);
  CheckMotion(request, all.input, all.plans);
  return all;
}

// Returns true if the live estimate's views had nearly the mean distance that the planned ones have.
bool HasSimilarBaseline(const LiveEstimate& estimate, double scale, const DenseInput& input, std::size_t k,
                        const KeyframePlan& plan) {
  constexpr double kMinShare = 0.8;  // of the mean distance now
  double then = 0.0, now = 0.0;
  for (const auto& [frame, T_keyframe_view] : estimate.T_keyframe_view) {
    then += scale * T_keyframe_view.translation.norm() / static_cast<double>(estimate.T_keyframe_view.size());
  }
  std::set<std::size_t> views(plan.views.begin(), plan.views.end());
  views.insert(plan.fine.begin(), plan.fine.end());
  for (const std::size_t view : views) {
    now +=
        (input.frames[view].T_map_camera.translation - input.keyframes[k].T_map_camera.translation).norm() /
        static_cast<double>(views.size());
  }
  return then >= kMinShare * now;
}

// Returns the scale of a depth map that the run itself estimated with these options, to be adopted; nothing
// if it is not valid in the finished map.
std::optional<double> LiveScale(const std::string& text, const std::string& settings, const DenseInput& input,
                                std::size_t k, const KeyframePlan& plan) {
  const std::optional<LiveEstimate> estimate = LiveEstimate::FromText(text);
  const auto scale = estimate && estimate->settings == settings
                         ? ScaleIfValid(*estimate, input, k, *plan.range)
                         : std::nullopt;
  return scale && HasSimilarBaseline(*estimate, *scale, input, k, plan) ? scale : std::nullopt;
}

void AdoptLive(double scale, const DenseInput& input, std::size_t k, const KeyframePlan& plan,
               DepthRecording& recording) {
  DepthMap map = recording.Estimate(input.ids[k]);
  map.T_map_camera = input.keyframes[k].T_map_camera;
  map.depth *= scale / recording.Metres();  // metres back to live units, which rows have
  input.moving.Apply(map);
  recording.PutEstimate(map, plan.settings);
}

// Returns the keyframes whose depth must be estimated. Drops the depth of those that have none any more or no
// longer exist.
std::vector<std::size_t> OpenJobs(const DenseInput& input, const std::vector<KeyframePlan>& plans,
                                  const DensifyRequest& request, DepthRecording& recording,
                                  DensifySummary& summary) {
  const std::string settings = EstimationSettings(request.options);
  std::vector<std::size_t> jobs;
  std::set<std::int64_t> keyframes;
  for (std::size_t k = 0; k < plans.size(); ++k) {
    keyframes.insert(input.ids[k]);
    const std::string text = recording.Settings(input.ids[k]);
    if (!plans[k].range) {
      recording.Remove(input.ids[k]);
      ++summary.without;
    } else if (text == plans[k].settings) {
      ++summary.resumed;
    } else if (const auto scale = LiveScale(text, settings, input, k, plans[k])) {
      AdoptLive(*scale, input, k, plans[k], recording);
      ++summary.live;
    } else if (request.estimate) {
      jobs.push_back(k);
    } else {
      recording.Remove(input.ids[k]);
      ++summary.without;
    }
  }
  for (const std::int64_t keyframe : recording.Estimated()) {
    if (!keyframes.contains(keyframe)) {
      recording.Remove(keyframe);
    }
  }
  return jobs;
}

// Estimates depth maps and records them. Returns false if `progress` stopped it.
bool EstimateInto(DepthRecording& recording, const PlannedInput& all, const std::vector<std::size_t>& jobs,
                  const DensifyRequest& request, const DensifyProgress& progress, DensifySummary& summary) {
  int done = 0;
  return EstimateDepthMaps(all.input, all.plans, jobs, request.options.stereo, request.threads,
                           [&](std::size_t k, const std::optional<DepthMap>& map) {
                             if (map) {
                               recording.PutEstimate(*map, all.plans[k].settings);
                               ++summary.estimated;
                             } else {
                               recording.Remove(all.input.ids[k]);
                               ++summary.without;
                             }
                             return progress(++done, static_cast<int>(jobs.size()), "depth maps");
                           });
}

}  // namespace

std::string DensifySummary::Text() const {
  return fmt::format("{} points of {} depth maps ({}{} new); depth of {:.1f} % of the pixels{}", points,
                     estimated + live + resumed, live > 0 ? fmt::format("{} of the run, ", live) : "",
                     estimated, 100.0 * complete,
                     filled > 0.0 ? fmt::format(", and of {:.1f} % by planes", 100.0 * filled) : "");
}

DensifySummary Densify(const DensifyRequest& request, const DensifyProgress& progress) {
  const DenseOptions& options = request.options;
  const PlannedInput all = PlanAll(request);
  const auto& [input, plans] = all;
  DensifySummary summary;
  summary.keyframes = static_cast<int>(plans.size());
  DepthRecording recording(request.result / "map.sqmap", DepthRecording::Access::kWrite);
  std::ranges::for_each(request.pieces, [&](const auto& piece) { recording.TakeEstimates(piece); });
  recording.PutText(kSurfaceOptions, DumpOptions(options.surface));
  const std::vector<std::size_t> jobs = OpenJobs(input, plans, request, recording, summary);
  std::optional<FusedDepth> fused;
  if (EstimateInto(recording, all, jobs, request, progress, summary)) {
    fused = FuseDepthMaps(input, plans, options, request.threads, recording, progress);
  }
  recording.Close();
  summary.interrupted = !fused.has_value();
  if (summary.interrupted) {
    return summary;
  }
  if (fused->cloud.empty()) {
    throw NoMapError(
        "{}: no depth: no point of {} depth maps is confirmed by {} others, expected more keyframes of the "
        "same place",
        request.result.string(), summary.estimated + summary.live + summary.resumed,
        options.fusion.min_views);
  }
  const double pixels = static_cast<double>(plans.size()) * input.camera.width * input.camera.height;
  summary.points = fused->cloud.size();
  summary.complete = static_cast<double>(fused->measured) / pixels;
  summary.filled = static_cast<double>(fused->filled) / pixels;
  WriteDenseCloud(request.result / "dense.ply", fused->cloud, recording.Metres());
  return summary;
}

bool EstimatePiece(const DensifyRequest& request, const Shard& shard, const fs::path& piece,
                   const DensifyProgress& progress) {
  const PlannedInput all = PlanAll(request);
  const auto& [input, plans] = all;
  const fs::path map = request.result / "map.sqmap";
  const std::string settings = EstimationSettings(request.options);
  std::vector<std::size_t> jobs;
  {
    const DepthRecording recording(map);
    const auto [first, end] = ItemsOf(shard, 0, static_cast<int>(plans.size()));
    for (auto k = static_cast<std::size_t>(first); k < static_cast<std::size_t>(end); ++k) {
      const std::string text = recording.Settings(input.ids[k]);
      if (plans[k].range && text != plans[k].settings && !LiveScale(text, settings, input, k, plans[k])) {
        jobs.push_back(k);
      }
    }
  }
  RecordingWriter(piece, RecordingReader(map).Info()).Close();
  DepthRecording recording(piece, DepthRecording::Access::kWrite);
  DensifySummary summary;
  const bool whole = EstimateInto(recording, all, jobs, request, progress, summary);
  recording.Close();
  return whole;
}

std::string DepthFingerprint(const DensifyRequest& request) {
  std::string text;
  for (const KeyframePlan& plan : PlanAll(request).plans) {
    text += plan.settings + "\n";
  }
  return Fingerprint(text);
}

}  // namespace sqslam
