#include "slam/dense/depth_fusion.h"

#include <algorithm>
#include <deque>
#include <set>
#include <utility>

#include "slam/dense/consistency.h"
#include "slam/util/statistics.h"

namespace sqslam {
namespace {

// The depth maps read last, so that neighbours that several keyframes share are decoded once.
class DepthCache {
 public:
  DepthCache(std::size_t most, std::function<DepthMap(std::int64_t)> read)
      : most_(most), read_(std::move(read)) {}

  const DepthMap& Get(std::int64_t keyframe) {
    const auto found = std::find_if(maps_.begin(), maps_.end(),
                                    [keyframe](const DepthMap& map) { return map.keyframe == keyframe; });
    if (found != maps_.end()) {
      std::rotate(found, std::next(found), maps_.end());
    } else {
      if (maps_.size() == most_) {
        maps_.pop_front();
      }
      maps_.push_back(read_(keyframe));
    }
    return maps_.back();
  }

 private:
  std::size_t most_;
  std::function<DepthMap(std::int64_t)> read_;
  std::deque<DepthMap> maps_;  // the one asked for last at the end
};

// Edge of the cloud's cubes: so many pixels at the median depth of the map points.
double SpacingOf(const DenseInput& input, const std::vector<KeyframePlan>& plans, double pixels) {
  std::vector<double> depths;
  for (std::size_t k = 0; k < plans.size(); ++k) {
    const Rigid3d T_camera_map = input.keyframes[k].T_map_camera.Inverse();
    for (const Eigen::Vector3d& p : plans[k].in_view) {
      depths.push_back((T_camera_map * p).z());
    }
  }
  return pixels * UpperMedian(std::move(depths)) / input.camera.fx;
}

// The keyframes whose depth was estimated, with the other ones that each is held against.
struct Neighbourhood {
  std::int64_t keyframe = 0;  // id
  std::vector<std::int64_t> neighbours;
};

std::vector<Neighbourhood> NeighbourhoodsOf(const DenseInput& input, const std::vector<KeyframePlan>& plans,
                                            const std::vector<std::int64_t>& estimated, int neighbours) {
  const std::set<std::int64_t> there(estimated.begin(), estimated.end());
  std::vector<PosedFrame> keyframes;
  std::vector<std::size_t> positions;
  for (std::size_t k = 0; k < input.keyframes.size(); ++k) {
    if (there.contains(input.ids[k])) {
      keyframes.push_back(input.keyframes[k]);
      positions.push_back(k);
    }
  }
  std::vector<Neighbourhood> all;
  for (std::size_t i = 0; i < keyframes.size(); ++i) {
    Neighbourhood one{input.ids[positions[i]], {}};
    for (const std::size_t n :
         ChooseNeighbours(i, keyframes, plans[positions[i]].in_view, input.camera, neighbours)) {
      one.neighbours.push_back(input.ids[positions[n]]);
    }
    all.push_back(std::move(one));
  }
  return all;
}

}  // namespace

std::optional<FusedDepth> FuseDepthMaps(const DenseInput& input, const std::vector<KeyframePlan>& plans,
                                        const DepthFusionOptions& options, DepthRecording& recording,
                                        const DensifyProgress& progress) {
  const std::vector<Neighbourhood> all =
      NeighbourhoodsOf(input, plans, recording.Estimated(), options.neighbours);
  DepthCache estimates(static_cast<std::size_t>(options.neighbours) * 4,
                       [&recording](std::int64_t keyframe) { return recording.Estimate(keyframe); });
  CloudFusion fusion(SpacingOf(input, plans, options.spacing));
  FusedDepth fused;
  for (std::size_t i = 0; i < all.size(); ++i) {
    std::vector<DepthMap> neighbours;
    for (const std::int64_t neighbour : all[i].neighbours) {
      neighbours.push_back(estimates.Get(neighbour));
    }
    recording.PutKept(KeepConsistent(estimates.Get(all[i].keyframe), neighbours, options));
    const DepthMap kept = recording.Kept(all[i].keyframe);  // as any reader will find it
    fusion.Add(kept);
    fused.measured += static_cast<std::size_t>(cv::countNonZero(kept.depth > 0.0));
    if (!progress(static_cast<int>(i) + 1, static_cast<int>(all.size()), "fused")) {
      return std::nullopt;
    }
  }
  fused.cloud = fusion.Cloud();
  return fused;
}

}  // namespace sqslam
