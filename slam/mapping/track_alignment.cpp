#include "slam/mapping/track_alignment.h"

#include <Eigen/LU>
#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <optional>
#include <utility>

#include "slam/features/patch_alignment.h"

namespace sqslam {
namespace {

// An aligned image's own error is below 0.1 px; the rest is what the flat patch and the camera model leave.
constexpr float kAlignedSigma = 0.3F;  // px of the keypoint's level

struct View {
  const FrameFeatures* features = nullptr;
  int keypoint = 0;
  Rigid3d T_camera_map;

  const Keypoint& Corner() const { return features->keypoints[keypoint]; }
};

View ViewOf(const Map& map, const Observation& o) {
  const Keyframe& keyframe = map.At(o.keyframe);
  return {keyframe.features.get(), o.keypoint, keyframe.T_camera_map};
}

// Returns the observation with which the others of a point are aligned, if there is one: one of the aligned
// ones, once there are any, so that all of them agree.
const Observation* ReferenceOf(const Map& map, const MapPoint& point) {
  constexpr double kCosinePerOctave = 0.05;
  const Observation* best = nullptr;
  std::pair<bool, double> best_score;
  for (const Observation& o : point.observations) {
    const Keyframe& keyframe = map.At(o.keyframe);
    if (!keyframe.features->patches) {
      continue;
    }
    const double cosine = (point.p_map - keyframe.Center()).normalized().dot(point.normal);
    const Keypoint& keypoint = keyframe.features->keypoints[o.keypoint];
    const std::pair score(keypoint.IsAligned(), cosine - kCosinePerOctave * keypoint.octave);
    if (best == nullptr || score > best_score) {
      best = &o;
      best_score = score;
    }
  }
  return best;
}

// Derivatives around a keypoint of the current image.
struct PatchWarp {
  Eigen::Matrix2d A_reference_current;  // of the raw pixel in the reference, by the raw pixel
  Eigen::Matrix2d A_undistorted_raw;    // of the undistorted pixel, by the raw pixel
};

// Returns the derivatives where both images see the plane through a point across its mean viewing direction.
// Empty if a camera is behind or beside the plane.
std::optional<PatchWarp> Warp(const Camera& camera, const MapPoint& point, const View& reference,
                              const View& current) {
  constexpr double kStep = 3.0;       // undistorted px
  constexpr double kMinCosine = 0.1;  // between a ray and the normal
  constexpr double kMinDeterminant = 0.1;
  const Rigid3d T_map_current = current.T_camera_map.Inverse();
  const Rigid3d T_reference_current = reference.T_camera_map * T_map_current;
  const Eigen::Vector3d normal = T_map_current.rotation.conjugate() * point.normal;  // in `current`
  const double offset = normal.dot(current.T_camera_map * point.p_map);
  std::array<Eigen::Vector2d, 3> in_current;
  std::array<Eigen::Vector2d, 3> in_reference;
  const std::array<Eigen::Vector2d, 3> steps{Eigen::Vector2d(0.0, 0.0), Eigen::Vector2d(kStep, 0.0),
                                             Eigen::Vector2d(0.0, kStep)};
  for (std::size_t i = 0; i < steps.size(); ++i) {
    const Eigen::Vector3d ray = camera.Unproject(current.Corner().pixel + steps[i]);
    const double along = normal.dot(ray);
    if (along < kMinCosine * ray.norm()) {
      return std::nullopt;
    }
    const Eigen::Vector3d p_reference = T_reference_current * Eigen::Vector3d(offset / along * ray);
    if (offset <= 0.0 || p_reference.z() <= 0.0) {
      return std::nullopt;
    }
    in_current[i] = camera.ProjectDistorted(ray);
    in_reference[i] = camera.ProjectDistorted(p_reference);
  }
  const auto slope_of = [&](const std::array<Eigen::Vector2d, 3>& raw) {  // by the undistorted pixel
    Eigen::Matrix2d slope;
    slope << raw[1] - raw[0], raw[2] - raw[0];
    return Eigen::Matrix2d(slope / kStep);
  };
  const Eigen::Matrix2d A_raw_undistorted = slope_of(in_current);
  if (std::abs(A_raw_undistorted.determinant()) < kMinDeterminant) {
    return std::nullopt;
  }
  const Eigen::Matrix2d A_undistorted_raw = A_raw_undistorted.inverse();
  return PatchWarp{slope_of(in_reference) * A_undistorted_raw, A_undistorted_raw};
}

PatchPlace PlaceOf(const ScaleLevels& levels, const View& view) {
  const Keypoint& keypoint = view.Corner();
  const KeypointPatch& patch = (*view.features->patches)[view.keypoint];
  return {&patch, (keypoint.raw_pixel - patch.raw_middle.cast<double>()) / levels.Scale(keypoint.octave)};
}

// Returns the keypoint of `current`, aligned with that of `reference`. Empty if that fails.
std::optional<Keypoint> Aligned(const ScaleLevels& levels, const Camera& camera, const MapPoint& point,
                                const View& reference, const View& current) {
  const std::optional<PatchWarp> warp = Warp(camera, point, reference, current);
  if (!warp) {
    return std::nullopt;
  }
  Keypoint keypoint = current.Corner();
  const double scale = levels.Scale(keypoint.octave);
  const PatchPlace place = PlaceOf(levels, current);
  const std::optional<Eigen::Vector2d> found =
      AlignPatches(PlaceOf(levels, reference), place,
                   scale / levels.Scale(reference.Corner().octave) * warp->A_reference_current);
  if (!found) {
    return std::nullopt;
  }
  const Eigen::Vector2d step = scale * (*found - place.pixel);
  keypoint.raw_pixel += step;
  keypoint.pixel += warp->A_undistorted_raw * step;  // not undistorted: rolling shutter was corrected too
  keypoint.sigma = kAlignedSigma;
  return IsInReach(keypoint.pixel) ? std::optional(keypoint) : std::nullopt;
}

}  // namespace

void AlignObservations(Map& map, const Camera& camera, KeyframeId keyframe) {
  std::map<KeyframeId, std::shared_ptr<FrameFeatures>> changed;
  const auto set = [&](const Observation& o, const Keypoint& keypoint) {
    std::shared_ptr<FrameFeatures>& features = changed[o.keyframe];
    if (!features) {
      features = std::make_shared<FrameFeatures>(*map.At(o.keyframe).features);
    }
    features->keypoints[o.keypoint] = keypoint;
  };
  for (const PointId id : map.At(keyframe).SeenPoints()) {
    const MapPoint& point = map.Point(id);
    const Observation* const reference = ReferenceOf(map, point);
    if (reference == nullptr) {
      continue;
    }
    const View reference_view = ViewOf(map, *reference);
    bool aligned_any = false;
    for (const Observation& o : point.observations) {
      const View view = ViewOf(map, o);
      if (&o == reference || view.Corner().IsAligned() || !view.features->patches) {
        continue;
      }
      if (const auto keypoint = Aligned(map.Levels(), camera, point, reference_view, view)) {
        set(o, *keypoint);
        aligned_any = true;
      }
    }
    if (aligned_any && !reference_view.Corner().IsAligned()) {
      Keypoint keypoint = reference_view.Corner();
      keypoint.sigma = kAlignedSigma;
      set(*reference, keypoint);
    }
  }
  for (auto& [id, features] : changed) {
    features->grid = KeypointGrid(features->keypoints, camera.width, camera.height);
    map.At(id).features = std::move(features);
  }
}

void AlignMatches(const Map& map, const Camera& camera, const FrameFeatures& features,
                  const Rigid3d& T_camera_map, std::vector<FrameMatch>& matches) {
  if (!features.patches) {
    return;
  }
  for (FrameMatch& match : matches) {
    const PointId id = map.Resolve(match.point);
    if (id == kNoPoint) {
      continue;
    }
    const MapPoint& point = map.Point(id);
    const Observation* const reference = ReferenceOf(map, point);
    if (reference == nullptr) {
      continue;
    }
    if (const auto keypoint = Aligned(map.Levels(), camera, point, ViewOf(map, *reference),
                                      {&features, match.keypoint, T_camera_map})) {
      match.pixel = keypoint->pixel.cast<float>();
      match.sigma = static_cast<float>(map.Levels().Sigma(*keypoint));
    }
  }
}

}  // namespace sqslam
