#include "slam/dense/keyframe_plan.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "slam/util/fingerprint.h"
#include "slam/util/options.h"

namespace sqslam {
namespace {

std::string SettingsOf(const DenseInput& input, const PosedFrame& keyframe, const KeyframePlan& plan,
                       const DenseOptions& options) {
  const auto numbers = [](const Rigid3d& pose) {
    const auto& q = pose.rotation.coeffs();
    const Eigen::Vector3d& t = pose.translation;
    return fmt::format("{} {} {} {} {} {} {}\n", q[0], q[1], q[2], q[3], t[0], t[1], t[2]);
  };
  const Camera& c = input.recorded;
  std::string text =
      EstimationSettings(options) + input.sequence.path.string() +
      fmt::format("\n{} {} {} {} {} {} {} {}\n{} {}\n", input.readout, c.width, c.height, c.fx, c.fy, c.cx,
                  c.cy, fmt::join(c.distortion, " "), plan.range->nearest, plan.range->farthest) +
      numbers(keyframe.T_map_camera);
  if (c.lens == LensModel::kFisheye) {
    text += "fisheye ";
  }
  for (const std::vector<std::size_t>* views : {&plan.views, &plan.fine}) {
    for (const std::size_t view : *views) {
      text += fmt::format("{} ", input.frames[view].index) + numbers(input.frames[view].T_map_camera);
    }
  }
  return Fingerprint(text);
}

}  // namespace

std::string EstimationSettings(const DenseOptions& options) {
  DenseOptions estimation = options;
  estimation.fusion = {};
  estimation.fill = {};
  estimation.surface = {};
  return Fingerprint(DumpOptions(estimation));
}

KeyframePlan PlanKeyframe(const DenseInput& input, std::size_t k, const DenseOptions& options) {
  constexpr std::size_t kSamples = 100;  // map points for choosing views
  constexpr std::size_t kAll = 1U << 24U;
  const ViewOptions& views = options.views;
  const PosedFrame& keyframe = input.keyframes[k];
  const Rigid3d& pose = keyframe.T_map_camera;
  KeyframePlan plan;
  plan.range = RangeOf(PointsInView(input.points, input.camera, pose, kAll), pose, views);
  plan.in_view = PointsInView(input.points, input.camera, pose, kSamples);
  plan.views = ChooseViews(keyframe, input.frames, plan.in_view, input.camera,
                           {views.large_angle, views.small_angle}, views);
  plan.fine = ChooseViews(keyframe, input.frames, plan.in_view, input.camera,
                          {views.fine_angle, views.large_angle}, views);
  if (plan.views.size() < 2) {
    plan.range.reset();
  }
  if (plan.range) {
    plan.settings = SettingsOf(input, keyframe, plan, options);
  }
  return plan;
}

std::vector<KeyframePlan> PlanKeyframes(const DenseInput& input, const DenseOptions& options) {
  std::vector<KeyframePlan> plans;
  for (std::size_t k = 0; k < input.keyframes.size(); ++k) {
    plans.push_back(PlanKeyframe(input, k, options));
  }
  return plans;
}

}  // namespace sqslam
