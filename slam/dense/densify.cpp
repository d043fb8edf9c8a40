#include "slam/dense/densify.h"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "slam/dense/dense_cloud.h"
#include "slam/dense/depth_estimation.h"
#include "slam/dense/surface_fusion.h"
#include "slam/snapshot/depth_recording.h"
#include "slam/util/error.h"
#include "slam/util/options.h"

namespace sqslam {
namespace {

[[noreturn]] void RefuseMotion(const DensifyRequest& request, const DenseInput& input) {
  if (input.keyframes.size() < 3) {
    throw NoMapError(fmt::format("{}: {} keyframes, expected three or more that see the same",
                                 request.result.string(), input.keyframes.size()));
  }
  throw NoMapError(
      fmt::format("{}: no depth: none of the {} keyframes has two other frames that show the same from {} "
                  "degrees or more "
                  "aside, expected a camera that moves sideways",
                  request.result.string(), input.keyframes.size(), request.options.views.min_angle));
}

// Takes over a depth map that the run itself estimated, if the finished map leaves it valid.
bool TakeLive(const std::vector<LiveEstimate>& live, const DenseInput& input, std::size_t k,
              const KeyframePlan& plan, DepthRecording& recording) {
  const auto estimate = std::find_if(live.begin(), live.end(),
                                     [&](const LiveEstimate& one) { return one.keyframe == input.ids[k]; });
  const auto scale = estimate != live.end() ? ScaleIfValid(*estimate, input, k, *plan.range) : std::nullopt;
  if (!scale) {
    return false;
  }
  DepthMap map = recording.Estimate(input.ids[k]);
  map.T_map_camera = input.keyframes[k].T_map_camera;
  map.depth *= *scale;
  input.moving.Apply(map);
  recording.PutEstimate(map, plan.settings);
  return true;
}

// The keyframes whose depth is to be estimated; drops the depth of those that have none any more.
std::vector<std::size_t> OpenJobs(const DenseInput& input, const std::vector<KeyframePlan>& plans,
                                  const std::vector<LiveEstimate>& live, DepthRecording& recording,
                                  DensifySummary& summary) {
  std::vector<std::size_t> jobs;
  for (std::size_t k = 0; k < plans.size(); ++k) {
    if (!plans[k].range) {
      recording.Remove(input.ids[k]);
      ++summary.without;
    } else if (recording.HasEstimate(input.ids[k], plans[k].settings)) {
      ++summary.resumed;
    } else if (TakeLive(live, input, k, plans[k], recording)) {
      ++summary.live;
    } else {
      jobs.push_back(k);
    }
  }
  return jobs;
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
  CheckOptions(options);
  const DenseInput input = ReadDenseInput(request.result, request.images, options);
  const std::vector<KeyframePlan> plans = PlanKeyframes(input, options);
  DensifySummary summary;
  summary.keyframes = static_cast<int>(plans.size());
  if (std::none_of(plans.begin(), plans.end(), [](const auto& plan) { return plan.range.has_value(); })) {
    RefuseMotion(request, input);
  }
  DepthRecording recording(request.result / "map.sqmap", DepthRecording::Access::kWrite);
  recording.PutText(kSurfaceOptions, DumpOptions(options.surface));
  const std::vector<std::size_t> jobs = OpenJobs(input, plans, request.live, recording, summary);
  int done = 0;
  const auto put = [&](std::size_t k, const std::optional<DepthMap>& map) {
    if (map) {
      recording.PutEstimate(*map, plans[k].settings);
      ++summary.estimated;
    } else {
      recording.Remove(input.ids[k]);
      ++summary.without;
    }
    return progress(++done, static_cast<int>(jobs.size()), "depth maps");
  };
  std::optional<FusedDepth> fused;
  if (EstimateDepthMaps(input, plans, jobs, options.stereo, request.threads, put)) {
    fused = FuseDepthMaps(input, plans, options, request.threads, recording, progress);
  }
  recording.Close();
  summary.interrupted = !fused.has_value();
  if (summary.interrupted) {
    return summary;
  }
  if (fused->cloud.empty()) {
    throw NoMapError(fmt::format(
        "{}: no depth: of {} depth maps no point is confirmed by {} others, expected more keyframes that see "
        "the same",
        request.result.string(), summary.estimated + summary.live + summary.resumed,
        options.fusion.min_views));
  }
  const double pixels = static_cast<double>(plans.size()) * input.camera.width * input.camera.height;
  summary.points = fused->cloud.size();
  summary.complete = static_cast<double>(fused->measured) / pixels;
  summary.filled = static_cast<double>(fused->filled) / pixels;
  WriteDenseCloud(request.result / "dense.ply", fused->cloud);
  return summary;
}

}  // namespace sqslam
