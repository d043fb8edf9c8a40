#include "slam/scene/scene_diff.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "slam/geometry/ray.h"
#include "tests/scene/made_room.h"

namespace sqslam {
namespace {

constexpr double kNoise = 0.002;  // of centres and half sizes, metres

struct Recorded {
  MapSnapshot map;
  std::vector<DepthMap> depths;
  SeenScene Seen() const { return {&map, depths}; }
};

// Thirteen things on a plane at z = 0, filmed from a half circle of radius 1.6 m.
class DesksInTwoStates {
 public:
  explicit DesksInTwoStates(unsigned seed) : random_(seed) {
    places_.resize(20);
    std::iota(places_.begin(), places_.end(), 0);
    std::ranges::shuffle(places_, random_);
    for (int i = 0; i < 13; ++i) {
      truth_.push_back(Make(i));
    }
  }

  SnapshotObject Make(int i) {
    const std::vector<std::string> labels = {"cup",         "bottle", "book",    "bowl", "box",
                                             "sports_ball", "can",    "toaster", "vase", "teddy_bear",
                                             "cup",         "book",   "jar",     "clock"};
    const double half = Uniform(0.035, 0.09);
    const int place = places_[static_cast<std::size_t>(i)];
    return testing::MakeObject(i, labels[static_cast<std::size_t>(i)],
                               {half, Uniform(0.6, 1.0) * half, Uniform(0.035, 0.12)},
                               0.32 * (place % 5) - 0.64, 0.32 * (place / 5) - 0.48, 0.0, Uniform(0.0, 3.0));
  }

  // The map of these objects, mapped with noise in a frame and unit of its own.
  Recorded Record(const std::vector<SnapshotObject>& truth, const Sim3d& S_map_world, bool with_depth) {
    Recorded recorded;
    recorded.map.camera = {.width = 64, .height = 48, .fx = 53.0, .fy = 53.0, .cx = 31.5, .cy = 23.5};
    for (int i = 0; i < 6; ++i) {
      const double angle = -0.4 * i;
      const Eigen::Vector3d eye(1.6 * std::cos(angle), 1.6 * std::sin(angle), 1.0);
      Eigen::Matrix3d axes;
      axes.col(2) = -eye.normalized();
      axes.col(0) = axes.col(2).cross(Eigen::Vector3d::UnitZ()).normalized();
      axes.col(1) = axes.col(2).cross(axes.col(0));
      const Rigid3d T_world_camera{Eigen::Quaterniond(axes), eye};
      recorded.map.keyframes.push_back({i, i, 0.1 * i, S_map_world * T_world_camera});
      if (with_depth) {
        recorded.depths.push_back(Film(truth, T_world_camera, recorded.map.camera, S_map_world));
      }
    }
    for (SnapshotObject object : truth) {
      for (int axis = 0; axis < 3; ++axis) {
        object.superquadric.T_map_object.translation[axis] += kNoise * Normal();
        object.superquadric.shape.half_size[axis] += kNoise * Normal();
      }
      object.superquadric = S_map_world * object.superquadric;
      object.fit.covariance.setZero();
      object.fit.covariance.diagonal().head<6>().setConstant(std::pow(kNoise * S_map_world.scale, 2));
      recorded.map.objects.push_back(object);
    }
    return recorded;
  }

  double Uniform(double low, double high) { return std::uniform_real_distribution(low, high)(random_); }
  double Normal() { return std::normal_distribution()(random_); }

  std::vector<SnapshotObject> truth_;

 private:
  DepthMap Film(const std::vector<SnapshotObject>& truth, const Rigid3d& T_world_camera, const Camera& camera,
                const Sim3d& S_map_world) {
    DepthMap view{0,  0, camera, S_map_world * T_world_camera, cv::Mat(camera.height, camera.width, CV_32F),
                  {}, {}};
    for (int y = 0; y < camera.height; ++y) {
      for (int x = 0; x < camera.width; ++x) {
        const Eigen::Vector3d ray = T_world_camera.rotation * camera.Unproject(Eigen::Vector2d(x, y));
        double depth = -T_world_camera.translation.z() / ray.z();
        depth = depth > 0.0 ? depth : 0.0;
        for (const SnapshotObject& object : truth) {
          const Eigen::Vector3d way =
              object.superquadric.T_map_object.translation - T_world_camera.translation;
          if (way.cross(ray.normalized()).norm() > object.superquadric.shape.half_size.norm()) {
            continue;  // beside a sphere around it
          }
          if (const auto hit = Intersect({T_world_camera.translation, ray}, object.superquadric)) {
            depth = depth > 0.0 ? std::min(depth, hit->first) : hit->first;
          }
        }
        view.depth.at<float>(y, x) = static_cast<float>(S_map_world.scale * depth * (1.0 + 0.003 * Normal()));
      }
    }
    return view;
  }

  std::mt19937 random_;
  std::vector<int> places_;
};

// A frame turned about z, of another unit; and the same a few millimetres off, as an alignment finds it.
Sim3d OtherFrame(DesksInTwoStates& desks) {
  return {desks.Uniform(0.5, 2.0),
          Eigen::Quaterniond(Eigen::AngleAxisd(desks.Uniform(-3.0, 3.0), Eigen::Vector3d::UnitZ())),
          {desks.Uniform(-1.0, 1.0), desks.Uniform(-1.0, 1.0), 0.0}};
}
Sim3d Misaligned(Sim3d S, DesksInTwoStates& desks) {
  S.translation += 0.004 * Eigen::Vector3d(desks.Normal(), desks.Normal(), desks.Normal());
  return S;
}

using Found = std::set<std::pair<Change, int>>;  // with the id of the object

Found FindChanges(const Recorded& before, const Recorded& after, const Sim3d& S_before_after) {
  Found found;
  for (const ObjectChange& change : CompareScenes(before.Seen(), after.Seen(), S_before_after)) {
    if (IsChange(change.change)) {
      const MapSnapshot& map = change.before >= 0 ? before.map : after.map;
      found.emplace(change.change,
                    map.objects[static_cast<std::size_t>(std::max(change.before, change.after))].id);
    }
  }
  return found;
}

class SceneDiff : public ::testing::TestWithParam<bool> {};

TEST_P(SceneDiff, FindsOneMovedOneGoneAndOneNewOfThirteen) {
  const unsigned pairs = GetParam() ? 20 : 5;
  int right = 0, found = 0, true_changes = 0;
  for (unsigned seed = 1; seed <= pairs; ++seed) {
    DesksInTwoStates desks(seed);
    const Recorded before = desks.Record(desks.truth_, {}, GetParam());
    std::vector<SnapshotObject> truth = desks.truth_;
    const double angle = desks.Uniform(0.0, 6.28);
    truth[2].superquadric.T_map_object.translation +=
        0.05 * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0.0);
    truth.erase(truth.begin() + 7);
    truth.push_back(desks.Make(13));
    const Sim3d S_after_world = OtherFrame(desks);
    const Recorded after = desks.Record(truth, S_after_world, GetParam());
    const Found expected = {{Change::kMoved, 2}, {Change::kGone, 7}, {Change::kNew, 13}};
    for (const auto& change : FindChanges(before, after, Misaligned(S_after_world.Inverse(), desks))) {
      right += expected.contains(change) ? 1 : 0;
      ++found;
      if (!expected.contains(change)) {
        ADD_FAILURE() << "seed " << seed << ": " << NameOf(change.first) << ' ' << change.second;
      }
    }
    true_changes += static_cast<int>(expected.size());
  }
  EXPECT_GE(2.0 * right / (found + true_changes), 0.95) << right << " of " << true_changes;
  RecordProperty("found", right);
  RecordProperty("true", true_changes);
}

TEST_P(SceneDiff, FindsNothingInTwoFilmsOfOneScene) {
  for (unsigned seed = 1; seed <= 5; ++seed) {
    DesksInTwoStates desks(seed);
    const Recorded before = desks.Record(desks.truth_, {}, GetParam());
    const Sim3d S_after_world = OtherFrame(desks);
    const Recorded after = desks.Record(desks.truth_, S_after_world, GetParam());
    EXPECT_TRUE(FindChanges(before, after, Misaligned(S_after_world.Inverse(), desks)).empty()) << seed;
    EXPECT_TRUE(FindChanges(before, before, {}).empty()) << seed;
  }
}

INSTANTIATE_TEST_SUITE_P(Depth, SceneDiff, ::testing::Bool());

TEST(SceneDiffCases, DoesNotMissWhatTheOtherCameraNeverSaw) {
  DesksInTwoStates desks(1);
  const Recorded before = desks.Record(desks.truth_, {}, true);
  std::vector<SnapshotObject> fewer = desks.truth_;
  fewer.erase(fewer.begin());
  Recorded after = desks.Record(fewer, {}, true);
  EXPECT_EQ(FindChanges(before, after, {}), (Found{{Change::kGone, 0}}));
  for (DepthMap& view : after.depths) {  // a cupboard before the camera
    view.depth.setTo(0.3F);
  }
  EXPECT_TRUE(FindChanges(before, after, {}).empty());
  after.depths.clear();
  after.map.keyframes.resize(3);
  EXPECT_TRUE(FindChanges(before, after, {}).empty());
}

TEST(SceneDiffCases, FindsChangeOfSize) {
  DesksInTwoStates desks(2);
  const Recorded before = desks.Record(desks.truth_, {}, true);
  std::vector<SnapshotObject> truth = desks.truth_;
  truth[4].superquadric.shape.half_size *= 1.6;
  const Recorded after = desks.Record(truth, {}, true);
  const Found found = FindChanges(before, after, {});
  EXPECT_EQ(found, (Found{{Change::kResized, 4}}));
}

TEST(SceneDiffCases, TakesEmptyMaps) {
  const MapSnapshot empty;
  EXPECT_TRUE(CompareScenes({&empty, {}}, {&empty, {}}, {}).empty());
}

}  // namespace
}  // namespace sqslam
