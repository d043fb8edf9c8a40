#include "slam/map/map_codec.h"

#include <fmt/format.h>

#include <cmath>
#include <memory>

#include "slam/util/limits.h"

namespace sqslam {
namespace {

constexpr double kPixelSteps = 64.0;
constexpr double kAngleSteps = 65536.0 / 360.0;
constexpr float kSigmaSteps = 100.0F;
static_assert(kMaxKeypoint == 2.0 * kMaxImageSide);

// Keypoints by columns, which compress better than rows.
struct KeypointColumns {
  std::vector<std::int32_t> x, y;          // undistorted, 1/64 px
  std::vector<std::int16_t> raw_x, raw_y;  // distorted, minus x and y
  std::vector<std::uint16_t> angle;
  std::vector<std::uint8_t> octave;
  std::vector<std::uint8_t> sigma;  // 1/100 px of the level

  static void VisitState(auto& self, auto&& visit) {
    visit(self.x, self.y, self.raw_x, self.raw_y, self.angle, self.octave, self.sigma);
  }
};

KeypointColumns ToColumns(const std::vector<Keypoint>& keypoints) {
  KeypointColumns columns;
  const auto step = [](double value) { return static_cast<std::int32_t>(std::lround(kPixelSteps * value)); };
  for (const Keypoint& keypoint : keypoints) {
    columns.x.push_back(step(keypoint.pixel.x()));
    columns.y.push_back(step(keypoint.pixel.y()));
    columns.raw_x.push_back(static_cast<std::int16_t>(step(keypoint.raw_pixel.x()) - columns.x.back()));
    columns.raw_y.push_back(static_cast<std::int16_t>(step(keypoint.raw_pixel.y()) - columns.y.back()));
    columns.angle.push_back(static_cast<std::uint16_t>(std::lround(kAngleSteps * keypoint.angle)));
    columns.octave.push_back(static_cast<std::uint8_t>(keypoint.octave));
    columns.sigma.push_back(static_cast<std::uint8_t>(std::lround(kSigmaSteps * keypoint.sigma)));
  }
  return columns;
}

void WriteFeatures(const FrameFeatures& features, ByteWriter& writer) {
  writer(static_cast<std::uint8_t>(features.kind), ToColumns(features.keypoints), features.colors,
         features.descriptors);
}

FrameFeaturesPtr ReadFeatures(ByteReader& reader, const Camera& camera, int levels) {
  KeypointColumns columns;
  auto features = std::make_shared<FrameFeatures>();
  std::uint8_t kind = 0;
  reader(kind, columns, features->colors, features->descriptors);
  if (kind > static_cast<std::uint8_t>(FeatureKind::kSift)) {
    reader.Refuse("has a keyframe with features of an unknown kind");
  }
  features->kind = static_cast<FeatureKind>(kind);
  const std::size_t count = features->descriptors.size();
  for (const std::size_t size :
       {columns.x.size(), columns.y.size(), columns.raw_x.size(), columns.raw_y.size(), columns.angle.size(),
        columns.octave.size(), columns.sigma.size(), features->colors.size()}) {
    if (size != count) {
      reader.Refuse("has a keyframe with columns of different lengths");
    }
  }
  for (std::size_t i = 0; i < count; ++i) {
    if (columns.octave[i] >= levels || std::abs(columns.x[i]) > kPixelSteps * kMaxKeypoint ||
        std::abs(columns.y[i]) > kPixelSteps * kMaxKeypoint) {
      reader.Refuse("has a keypoint far outside its image or on a pyramid level that does not exist");
    }
    if (columns.sigma[i] == 0 || columns.sigma[i] > kSigmaSteps) {
      reader.Refuse("has a keypoint with a standard deviation outside of 0.01 to 1 px");
    }
    features->keypoints.push_back(
        {Eigen::Vector2d(columns.x[i], columns.y[i]) / kPixelSteps,
         Eigen::Vector2d(columns.x[i] + columns.raw_x[i], columns.y[i] + columns.raw_y[i]) / kPixelSteps,
         static_cast<float>(columns.angle[i] / kAngleSteps), columns.octave[i],
         columns.sigma[i] / kSigmaSteps});
  }
  features->grid = KeypointGrid(features->keypoints, camera.width, camera.height);
  return features;
}

bool IsPose(const Rigid3d& T) {
  constexpr double kUnit = 1e-6;
  return std::abs(T.rotation.norm() - 1.0) <= kUnit && T.translation.norm() <= kMaxMapUnits;
}

void CheckKeyframes(const ByteReader& reader, const Map& map) {
  for (const auto& [id, keyframe] : map.Keyframes()) {
    bool sound = id >= 0 && id == keyframe.id && IsPose(keyframe.T_camera_map) && keyframe.scale > 0.0 &&
                 (keyframe.parent == kNoKeyframe || map.HasKeyframe(keyframe.parent));
    for (const auto& [other, weight] : keyframe.covisibility) {
      sound = sound && other != id && map.HasKeyframe(other) && map.At(other).covisibility.contains(id);
    }
    if (!sound) {
      reader.Refuse(fmt::format("has a keyframe {} with an invalid id, pose, scale or link", id));
    }
  }
  std::set<KeyframeId> placed;  // removed keyframes whose references lead to an existing one
  for (const auto& [first, first_removed] : map.Removed()) {
    std::set<KeyframeId> way;
    KeyframeId id = first;
    while (!map.HasKeyframe(id) && !placed.contains(id)) {
      const auto removed = map.Removed().find(id);
      if (removed == map.Removed().end() || !way.insert(id).second ||
          !IsPose(removed->second.pose.T_camera_reference) || !(removed->second.pose.scale > 0.0) ||
          !(removed->second.scale > 0.0)) {
        reader.Refuse(fmt::format("has a removed keyframe {} without a valid pose", first));
      }
      id = removed->second.pose.reference;
    }
    if (map.HasKeyframe(first)) {
      reader.Refuse(fmt::format("lists keyframe {} as removed, but it exists", first));
    }
    placed.merge(way);
  }
}

// Sets the keyframes' points from the observations.
void TieObservations(const ByteReader& reader, Map& map) {
  for (const MapPoint& point : map.Points()) {
    bool sound = map.IsAlive(point.id) && &map.Point(point.id) == &point && point.observations.size() >= 2 &&
                 point.p_map.norm() <= kMaxMapUnits && point.visible > 0;
    for (std::size_t i = 0; sound && i < point.observations.size(); ++i) {
      const auto& [id, keypoint] = point.observations[i];
      sound = map.HasKeyframe(id) && keypoint >= 0 && keypoint < static_cast<int>(map.At(id).points.size()) &&
              map.At(id).points[keypoint] == kNoPoint;
      if (sound) {
        map.At(id).points[keypoint] = point.id;
      }
    }
    if (!sound) {
      reader.Refuse(fmt::format("has a map point {} with an invalid id, position or observation", point.id));
    }
  }
}

}  // namespace

void WriteMap(const Map& map, ByteWriter& writer) {
  Map::VisitState(map, writer);
  for (const auto& [id, keyframe] : map.Keyframes()) {
    WriteFeatures(*keyframe.features, writer);
  }
}

void ReadMap(ByteReader& reader, const Camera& camera, Map& map) {
  Map::VisitState(map, reader);
  CheckKeyframes(reader, map);
  if (!map.Points().IsSound()) {
    reader.Refuse("has a map point table with an id that refers to no point");
  }
  for (const auto& [id, const_keyframe] : map.Keyframes()) {
    Keyframe& keyframe = map.At(id);
    keyframe.features = ReadFeatures(reader, camera, map.Levels().Count());
    keyframe.points.assign(keyframe.features->Size(), kNoPoint);
  }
  TieObservations(reader, map);
  for (const MapPoint& point : map.Points()) {
    map.UpdateAppearance(point.id);
  }
}

}  // namespace sqslam
