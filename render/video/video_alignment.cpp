#include "render/video/video_alignment.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <utility>
#include <vector>

#include "slam/geometry/eigen_system.h"
#include "slam/io/trajectory.h"
#include "slam/util/throw_if.h"

namespace sqslam {

Sim3d AlignByKeyframes(const MapSnapshot& map, const MapSnapshot& target) {
  std::map<std::int64_t, const SnapshotKeyframe*> of_target;
  for (const SnapshotKeyframe& keyframe : target.keyframes) {
    of_target[keyframe.id] = &keyframe;
  }
  std::vector<std::pair<Rigid3d, Rigid3d>> shared;
  for (const SnapshotKeyframe& keyframe : map.keyframes) {
    const auto found = of_target.find(keyframe.id);
    // Ids may restart after a reset, so the frame must agree too.
    if (found != of_target.end() && found->second->frame_index == keyframe.frame_index) {
      shared.emplace_back(keyframe.T_map_camera, found->second->T_map_camera);
    }
  }
  Sim3d s;
  if (shared.size() < 2) {
    return s;
  }
  // Orientations determine the rotation even on a straight path, where positions alone do not.
  Eigen::Matrix4d sum = Eigen::Matrix4d::Zero();
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  Eigen::Vector3d target_mean = Eigen::Vector3d::Zero();
  const double count = static_cast<double>(shared.size());
  for (const auto& [from, to] : shared) {
    const Eigen::Vector4d q = (to.rotation * from.rotation.conjugate()).coeffs();
    sum += q * q.transpose();
    mean += from.translation / count;
    target_mean += to.translation / count;
  }
  const EigenSystem<4> solver = EigenSystemOf(sum);
  s.rotation = Eigen::Quaterniond(Eigen::Vector4d(solver.vectors.col(3))).normalized();
  double spread = 0.0;
  double target_spread = 0.0;
  for (const auto& [from, to] : shared) {
    spread += (from.translation - mean).squaredNorm();
    target_spread += (to.translation - target_mean).squaredNorm();
  }
  s.scale = spread > 1e-12 && target_spread > 1e-12 ? std::sqrt(target_spread / spread) : 1.0;
  s.translation = target_mean - s.scale * (s.rotation * mean);
  return s;
}

MapSnapshot Transformed(const Sim3d& S_target_map, const MapSnapshot& map) {
  MapSnapshot moved = map;
  if (moved.T_map_camera) {
    moved.T_map_camera = S_target_map * *moved.T_map_camera;
  }
  for (SnapshotKeyframe& keyframe : moved.keyframes) {
    keyframe.T_map_camera = S_target_map * keyframe.T_map_camera;
  }
  for (SnapshotPoint& point : moved.points) {
    point.p_map = (S_target_map * point.p_map.cast<double>()).cast<float>();
  }
  for (SnapshotObject& object : moved.objects) {
    object.superquadric = S_target_map * object.superquadric;
  }
  return moved;
}

namespace fs = std::filesystem;

namespace {

Rigid3d Between(const Rigid3d& from, const Rigid3d& to, double share) {
  return {from.rotation.slerp(share, to.rotation),
          from.translation + share * (to.translation - from.translation)};
}

PosedSuperquadric Between(const PosedSuperquadric& from, const PosedSuperquadric& to, double share) {
  PosedSuperquadric solid = to;
  solid.T_map_object = Between(from.T_map_object, to.T_map_object, share);
  solid.shape.half_size += (1.0 - share) * (from.shape.half_size - to.shape.half_size);
  solid.shape.e1 = std::lerp(from.shape.e1, to.shape.e1, share);
  solid.shape.e2 = std::lerp(from.shape.e2, to.shape.e2, share);
  return solid;
}

}  // namespace

MapSnapshot Between(const MapSnapshot& from, const MapSnapshot& to, double share) {
  constexpr double kNewSize = 0.3;  // of an object that appears
  MapSnapshot map = to;
  if (from.T_map_camera && to.T_map_camera) {
    map.T_map_camera = Between(*from.T_map_camera, *to.T_map_camera, share);
  }
  for (SnapshotObject& object : map.objects) {
    const auto before = std::ranges::find(from.objects, object.id, &SnapshotObject::id);
    if (before != from.objects.end()) {
      object.superquadric = Between(before->superquadric, object.superquadric, share);
    } else {
      object.superquadric.shape.half_size *= std::lerp(kNewSize, 1.0, share);
    }
  }
  return map;
}

InputFrames::InputFrames(const RecordingReader& recording, const fs::path& map_file) : images_(recording) {
  const MapSnapshotPtr last = recording.Last();
  if (const Sequence* sequence = images_.FindSequence()) {
    poses_ = ReadPosesByFrame(map_file.parent_path() / "trajectory.txt", *sequence);
  }
  // Without a trajectory: poses of the keyframes, then of the snapshots' newest frames.
  PosesByFrame recorded;
  for (const SnapshotKeyframe& keyframe : last->keyframes) {
    recorded.emplace(keyframe.frame_index, keyframe.T_map_camera);
  }
  for (int i = 0; i < recording.Size(); ++i) {
    const MapSnapshotPtr map = recording.Read(i);
    if (!map->image_path.empty()) {
      files_.emplace(map->frame_index, map->image_path);
    }
    if (map->T_map_camera) {
      recorded.emplace(map->frame_index, AlignByKeyframes(*map, *last) * *map->T_map_camera);
    }
  }
  poses_ = poses_.empty() ? recorded : poses_;
}

Rigid3d InputFrames::PoseOf(std::int64_t frame) const {
  ThrowIf<UsageError>(poses_.empty(), "frame {}: the map has no poses of its camera", frame);
  auto nearest = poses_.lower_bound(frame);
  if (nearest != poses_.end() && nearest->first == frame) {
    return nearest->second;
  }
  if (nearest == poses_.end() ||
      (nearest != poses_.begin() && frame - std::prev(nearest)->first <= nearest->first - frame)) {
    --nearest;
  }
  throw UsageError(
      "frame {}: its pose is not known, expected one of the {} tracked frames from {} to {}; the "
      "nearest is {}",
      frame, poses_.size(), poses_.begin()->first, poses_.rbegin()->first, nearest->first);
}

cv::Mat InputFrames::ImageOf(std::int64_t frame) {
  cv::Mat image = images_.Read(files_, frame);
  ThrowIf<InputError>(image.empty(),
                      "frame {}: its image cannot be read, expected the sequence that was mapped ({})", frame,
                      images_.WhyNot());
  return image;
}

}  // namespace sqslam
