#include "slam/mapping/track_alignment.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "slam/features/orb_extractor.h"
#include "tests/support/textured_world.h"
#include "tests/support/tracked_frame.h"

namespace sqslam {
namespace {

using testing::AsTracked;
using testing::HandHeldPath;
using testing::TexturedWorld;
using testing::ThroughLens;

constexpr std::size_t kPanels = 3;

// A map of the textured world with true poses and points, whose observations are corners as detected.
class TrackAlignment : public ::testing::TestWithParam<bool> {
 protected:
  TrackAlignment() {
    constexpr int kStep = 6;  // frames between keyframes
    constexpr int kKeyframes = 4;
    const ThroughLens lens(camera_, world_.GetCamera());
    OrbExtractor extractor({});
    const std::vector<Rigid3d> path = HandHeldPath(kStep * kKeyframes);
    for (int i = 0; i < kKeyframes; ++i) {
      const Rigid3d& T_map_camera = path[static_cast<std::size_t>(kStep * i)];
      const Frame frame = world_.Render(i, T_map_camera);
      const Frame seen = GetParam() ? lens(frame) : frame;
      map_.AddKeyframe(
          i, i, T_map_camera.Inverse(),
          std::make_shared<const FrameFeatures>(extractor.Extract(seen.gray, seen.bgr, camera_, {})));
    }
    AddPoints();
  }

  static Camera MakeCamera() {
    Camera camera = TexturedWorld().GetCamera();
    if (GetParam()) {
      camera.distortion = {-0.15, 0.02, 0.001, -0.001, 0.0};
    }
    return camera;
  }

  // The place that a keyframe's ray meets on a panel; empty beside it.
  std::optional<Eigen::Vector3d> OnPanel(KeyframeId id, const Eigen::Vector2d& pixel,
                                         std::size_t panel) const {
    const auto corners = world_.PanelCorners(panel);
    const Eigen::Vector3d right = corners[1] - corners[0];
    const Eigen::Vector3d down = corners[3] - corners[0];
    const Eigen::Vector3d normal = right.cross(down);
    const Rigid3d T_map_camera = map_.At(id).T_camera_map.Inverse();
    const Eigen::Vector3d ray = T_map_camera.rotation * camera_.Unproject(pixel);
    const Eigen::Vector3d p =
        T_map_camera.translation + normal.dot(corners[0] - T_map_camera.translation) / normal.dot(ray) * ray;
    const double u = (p - corners[0]).dot(right) / right.squaredNorm();
    const double v = (p - corners[0]).dot(down) / down.squaredNorm();
    constexpr double kMargin = 0.1;  // the patch lies on the panel too
    return std::min(u, v) > kMargin && std::max(u, v) < 1.0 - kMargin ? std::optional(p) : std::nullopt;
  }

  void AddPoints() {
    constexpr double kReach = 2.0;  // px of the level
    const auto& keypoints = map_.At(0).features->keypoints;
    for (int i = 0; i < static_cast<int>(keypoints.size()); ++i) {
      for (std::size_t panel = kPanels; panel-- > 0;) {  // the nearest first
        const std::optional<Eigen::Vector3d> p_map = OnPanel(0, keypoints[i].pixel, panel);
        if (!p_map) {
          continue;
        }
        const PointId point = map_.AddPoint(*p_map, 0);
        map_.AddObservation(point, 0, i);
        for (KeyframeId id = 1; id < static_cast<KeyframeId>(map_.Keyframes().size()); ++id) {
          const int other = NearestKeypoint(id, *p_map, keypoints[i].octave, kReach);
          if (other >= 0 && map_.At(id).points[other] == kNoPoint) {
            map_.AddObservation(point, id, other);
          }
        }
        if (map_.Point(point).observations.size() < 2) {
          map_.RemovePoint(point);
        } else {
          map_.UpdateAppearance(point);
          panels_[point] = panel;
        }
        break;
      }
    }
  }

  int NearestKeypoint(KeyframeId id, const Eigen::Vector3d& p_map, int octave, double reach) const {
    const Keyframe& keyframe = map_.At(id);
    const Eigen::Vector2d pixel = camera_.Project(keyframe.T_camera_map * p_map);
    int best = -1;
    double least = reach * map_.Levels().Scale(octave);
    for (int i = 0; i < static_cast<int>(keyframe.features->Size()); ++i) {
      const Keypoint& keypoint = keyframe.features->keypoints[i];
      if (keypoint.octave == octave && (keypoint.pixel - pixel).norm() < least) {
        least = (keypoint.pixel - pixel).norm();
        best = i;
      }
    }
    return best;
  }

  // Median distance of the places that two views of a point show on its panel, px of the level.
  double Disagreement() const {
    std::vector<double> distances;
    for (const MapPoint& point : map_.Points()) {
      const Observation& a = point.observations[0];
      const double scale = map_.Levels().Scale(map_.KeypointOf(a).octave);
      for (const Observation& b : point.observations) {
        const auto p = OnPanel(b.keyframe, map_.KeypointOf(b).pixel, panels_.at(point.id));
        if (b.keyframe != a.keyframe && p) {
          distances.push_back(
              (camera_.Project(map_.At(a.keyframe).T_camera_map * *p) - map_.KeypointOf(a).pixel).norm() /
              scale);
        }
      }
    }
    EXPECT_GT(distances.size(), 100U);
    std::ranges::nth_element(distances,
                             distances.begin() + static_cast<std::ptrdiff_t>(distances.size() / 2));
    return distances[distances.size() / 2];
  }

  double ShareAligned() const {
    double aligned = 0.0;
    double all = 0.0;
    for (const MapPoint& point : map_.Points()) {
      for (const Observation& o : point.observations) {
        aligned += map_.KeypointOf(o).IsAligned() ? 1.0 : 0.0;
        all += 1.0;
      }
    }
    return aligned / all;
  }

  Camera camera_ = MakeCamera();
  TexturedWorld world_;
  Map map_{ScaleLevels({})};
  std::map<PointId, std::size_t> panels_;
};

TEST_P(TrackAlignment, MakesViewsOfPointsAgree) {
  const double before = Disagreement();
  for (KeyframeId id = 0; id < 4; ++id) {
    AlignObservations(map_, camera_, id);
  }
  EXPECT_GT(before, 0.15);
  EXPECT_LT(Disagreement(), 0.5 * before);
  EXPECT_GT(ShareAligned(), 0.7);
}

TEST_P(TrackAlignment, AlignsMatchesOfFramesAsThoseOfKeyframes) {
  constexpr KeyframeId kLast = 3;
  TrackedFrame frame = AsTracked(map_, kLast);  // with its corners as detected
  for (KeyframeId id = 0; id <= kLast; ++id) {
    AlignObservations(map_, camera_, id);
  }
  const std::vector<FrameMatch> before = MatchesOf(frame, map_.Levels());
  std::vector<FrameMatch> matches = before;
  AlignMatches(map_, camera_, *frame.features, frame.T_camera_map, matches);
  double squares_before = 0.0;
  double squares = 0.0;
  int count = 0;
  for (std::size_t i = 0; i < matches.size(); ++i) {
    const Keypoint& keypoint = map_.At(kLast).features->keypoints[matches[i].keypoint];
    if (matches[i].sigma < before[i].sigma && keypoint.IsAligned()) {
      const double scale = map_.Levels().Scale(keypoint.octave);
      squares_before += (before[i].pixel.cast<double>() - keypoint.pixel).squaredNorm() / (scale * scale);
      squares += (matches[i].pixel.cast<double>() - keypoint.pixel).squaredNorm() / (scale * scale);
      ++count;
    }
  }
  ASSERT_GT(count, static_cast<int>(matches.size()) / 2);
  EXPECT_GT(std::sqrt(squares_before / count), 0.2);
  EXPECT_LT(std::sqrt(squares / count), 0.1);
}

// As when a camera comes nearer: each new view is finer than those before.
TEST_P(TrackAlignment, AlignsFinerViewsWithThoseAlignedBefore) {
  constexpr KeyframeId kLast = 3;
  std::map<PointId, int> seen_last;
  for (const PointId id : map_.At(kLast).SeenPoints()) {
    for (const Observation& o : map_.Point(id).observations) {
      if (o.keyframe == kLast && map_.Point(id).observations.size() > 2) {
        seen_last[id] = o.keypoint;
      }
    }
  }
  for (const auto& [id, keypoint] : seen_last) {
    map_.RemoveObservation(id, kLast);
  }
  for (KeyframeId id = 0; id < kLast; ++id) {
    AlignObservations(map_, camera_, id);
  }
  for (const auto& [id, keypoint] : seen_last) {
    map_.AddObservation(id, kLast, keypoint);
    map_.Point(id).normal =
        (map_.Point(id).p_map - map_.At(kLast).Center()).normalized();  // the last view is the most frontal
  }
  AlignObservations(map_, camera_, kLast);
  int aligned = 0;
  for (const auto& [id, keypoint] : seen_last) {
    aligned += map_.At(kLast).features->keypoints[keypoint].IsAligned() ? 1 : 0;
  }
  ASSERT_GT(seen_last.size(), 30U);
  EXPECT_GT(aligned, static_cast<int>(seen_last.size()) * 2 / 3);
}

TEST_P(TrackAlignment, KeepsCorrectionOfRollingShutter) {
  const Eigen::Vector2d correction(1.5, -0.5);
  Keyframe& keyframe = map_.At(2);
  auto features = std::make_shared<FrameFeatures>(*keyframe.features);
  for (Keypoint& keypoint : features->keypoints) {
    keypoint.pixel += correction;
  }
  keyframe.features = features;
  AlignObservations(map_, camera_, 2);
  constexpr double kMaxError = 0.02;  // px: the lens is taken as linear over the step
  int aligned = 0;
  for (const Keypoint& keypoint : keyframe.features->keypoints) {
    aligned += keypoint.IsAligned() ? 1 : 0;
    EXPECT_LT((keypoint.pixel - camera_.Undistort(keypoint.raw_pixel) - correction).norm(), kMaxError);
  }
  EXPECT_GT(aligned, 50);
}

TEST_P(TrackAlignment, LeavesKeypointsWithoutPatches) {
  for (KeyframeId id = 0; id < 4; ++id) {
    auto features = std::make_shared<FrameFeatures>(*map_.At(id).features);
    features->patches.reset();
    map_.At(id).features = features;
  }
  AlignObservations(map_, camera_, 0);
  EXPECT_EQ(ShareAligned(), 0.0);
}

INSTANTIATE_TEST_SUITE_P(Lens, TrackAlignment, ::testing::Bool(),
                         [](const auto& lens) { return lens.param ? "Distorted" : "Pinhole"; });

}  // namespace
}  // namespace sqslam
