#include "slam/dense/depth_fusion.h"

#include <algorithm>
#include <deque>
#include <set>
#include <utility>

#include "slam/dense/consistency.h"
#include "slam/dense/plane_fill.h"
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

// Puts what `make` makes of each depth map and its neighbours into the recording. False: ended by `progress`.
bool PutAll(const std::vector<Neighbourhood>& all, DepthCache& cache, const std::string& state,
            const std::function<DepthMap(const DepthMap&, const std::vector<DepthMap>&)>& make,
            DepthRecording& recording, const DensifyProgress& progress) {
  for (std::size_t i = 0; i < all.size(); ++i) {
    std::vector<DepthMap> neighbours;
    for (const std::int64_t neighbour : all[i].neighbours) {
      neighbours.push_back(cache.Get(neighbour));
    }
    recording.PutKept(make(cache.Get(all[i].keyframe), neighbours));
    if (!progress(static_cast<int>(i) + 1, static_cast<int>(all.size()), state)) {
      return false;
    }
  }
  return true;
}

}  // namespace

std::optional<FusedDepth> FuseDepthMaps(const DenseInput& input, const std::vector<KeyframePlan>& plans,
                                        const DenseOptions& options, DepthRecording& recording,
                                        const DensifyProgress& progress) {
  const std::vector<Neighbourhood> all =
      NeighbourhoodsOf(input, plans, recording.Estimated(), options.fusion.neighbours);
  const std::size_t most = static_cast<std::size_t>(options.fusion.neighbours) * 4;
  DepthCache estimates(most, [&](std::int64_t keyframe) { return recording.Estimate(keyframe); });
  const auto keep = [&](const DepthMap& map, const std::vector<DepthMap>& neighbours) {
    return KeepConsistent(map, neighbours, options.fusion);
  };
  if (!PutAll(all, estimates, "fused", keep, recording, progress)) {
    return std::nullopt;
  }
  DepthCache with_fills(
      most, [&](std::int64_t keyframe) { return FillPlanes(recording.Kept(keyframe), options.fill); });
  const auto confirm = [&](const DepthMap& map, const std::vector<DepthMap>& neighbours) {
    return KeepConfirmedFills(map, neighbours, options.fusion);
  };
  if (options.fill.enabled && !PutAll(all, with_fills, "filled", confirm, recording, progress)) {
    return std::nullopt;
  }
  CloudFusion fusion(SpacingOf(input, plans, options.fusion.spacing));
  FusedDepth fused;
  for (const Neighbourhood& one : all) {
    const DepthMap kept = recording.Kept(one.keyframe);
    const auto planes = static_cast<std::size_t>(cv::countNonZero(kept.views == kFilledByPlane));
    fused.measured += static_cast<std::size_t>(cv::countNonZero(kept.depth > 0.0)) - planes;
    fused.filled += planes;
    fusion.Add(kept);
  }
  fused.cloud = fusion.Cloud();
  return fused;
}

}  // namespace sqslam
