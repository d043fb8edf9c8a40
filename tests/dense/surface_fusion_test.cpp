#include "slam/dense/surface_fusion.h"

#include <gtest/gtest.h>

#include <cstring>
#include <map>

#include "slam/snapshot/recording.h"
#include "tests/io/temporary_folder.h"

namespace sqslam::testing {
namespace {

constexpr double kWall = 2.0;  // depth of a wall that fills the images

DepthMap WallMap(std::int64_t keyframe, double aside, double depth, double sigma = 0.01) {
  DepthMap map;
  map.keyframe = map.frame_index = keyframe;
  map.camera = {80, 60, 80.0, 80.0, 40.0, 30.0, {}, 30.0};
  map.T_map_camera.translation.x() = aside;
  map.depth = cv::Mat(60, 80, CV_32F, cv::Scalar(depth));
  map.sigma = cv::Mat(60, 80, CV_32F, cv::Scalar(sigma));
  map.views = cv::Mat(60, 80, CV_8U, cv::Scalar(3));
  map.bgr = cv::Mat(60, 80, CV_8UC3, cv::Scalar(10, 20, 200));
  return map;
}

class SurfaceFusion : public ::testing::Test {
 protected:
  SurfaceFusion() { RecordingWriter(path_, {"", "test", ""}).Add(MapSnapshot()); }

  void Put(const std::vector<DepthMap>& maps) const {
    DepthRecording depths(path_, DepthRecording::Access::kWrite);
    for (const DepthMap& map : maps) {
      depths.PutEstimate(map, "");
      depths.PutKept(map);
    }
  }
  std::optional<SurfaceVolume> Fuse(int threads = 1, const SurfaceOptions& options = {}) const {
    return FuseSurface(DepthRecording(path_), options, threads,
                       [](int, int, const std::string&) { return true; });
  }

  const TemporaryFolder folder_;
  const std::filesystem::path path_ = folder_.Path() / "map.sqmap";
};

// Distances from the wall in map units, by depth, of the voxels that were seen on the cameras' axis.
std::map<double, double> AlongTheAxis(const SurfaceVolume& volume) {
  std::map<double, double> distances;
  for (std::size_t b = 0; b < volume.places.size(); ++b) {
    const auto& [x, y, z] = volume.places[b];
    for (int k = 0; x == 0 && y == 0 && k < SurfaceVolume::kEdge; ++k) {
      if (const auto& voxel = volume.blocks[b][SurfaceVolume::IndexOf(0, 0, k)]; voxel.weight > 0.0F) {
        distances[volume.voxel * (8 * z + k)] = voxel.distance * kTruncation * volume.voxel;
      }
    }
  }
  return distances;
}

TEST_F(SurfaceFusion, MeasuresDistancesFromWallAndEndsBehindIt) {
  Put({WallMap(1, 0.0, kWall), WallMap(2, 0.2, kWall)});
  const auto volume = Fuse();
  ASSERT_TRUE(volume);
  EXPECT_NEAR(volume->voxel, 2.0 * kWall / 80.0, 1e-3);
  const auto distances = AlongTheAxis(*volume);
  ASSERT_GT(distances.size(), 6U);
  for (const auto& [depth, distance] : distances) {
    EXPECT_NEAR(distance, std::min(kWall - depth, 4.0 * volume->voxel), 2e-3) << depth;
  }
  EXPECT_LT(distances.rbegin()->first, kWall + 4.0 * volume->voxel + 1e-6);
  EXPECT_EQ(volume->blocks.front()[0].rgb.size(), 3U);
}

TEST_F(SurfaceFusion, WeighsPixelsByInverseVariance) {
  Put({WallMap(1, 0.0, kWall, 0.01), WallMap(2, 0.0, kWall + 0.06, 0.02)});
  const auto volume = Fuse();
  ASSERT_TRUE(volume);
  double at_wall = 1.0;
  for (const auto& [depth, distance] : AlongTheAxis(*volume)) {
    if (std::abs(depth - kWall) < 0.5 * volume->voxel) {
      at_wall = distance - (kWall - depth);
    }
  }
  EXPECT_NEAR(at_wall, 0.2 * 0.06, 0.003);
}

TEST_F(SurfaceFusion, MarksSpaceBeforeSurfaceAsFree) {
  std::vector<DepthMap> maps = {WallMap(1, 0.0, 1.0, 0.02)};  // a ghost before the wall
  for (int i = 2; i < 8; ++i) {
    maps.push_back(WallMap(i, 0.01 * i, kWall));
  }
  Put(maps);
  const auto volume = Fuse();
  ASSERT_TRUE(volume);
  for (const auto& [depth, distance] : AlongTheAxis(*volume)) {
    EXPECT_GT(distance, depth < 1.5 ? 0.0 : -1.0) << depth;
  }
}

TEST_F(SurfaceFusion, StaysWithinMemoryWithAnyNumberOfThreads) {
  Put({WallMap(1, 0.0, kWall), WallMap(2, 0.3, kWall), WallMap(3, 0.5, 1.5)});
  const auto one = Fuse(1);
  const auto five = Fuse(5);
  ASSERT_TRUE(one && five);
  EXPECT_EQ(one->places, five->places);
  EXPECT_EQ(std::memcmp(one->blocks.data(), five->blocks.data(), one->blocks.size() * sizeof(one->blocks[0])),
            0);
  SurfaceOptions small;
  small.memory_mib = 1.0;
  small.voxel = 0.5;
  const auto coarse = Fuse(1, small);
  ASSERT_TRUE(coarse);
  EXPECT_LE(coarse->blocks.size() * sizeof(coarse->blocks[0]), 1048576U);
  EXPECT_GT(coarse->voxel, 0.5 * kWall / 80.0);
}

TEST_F(SurfaceFusion, GivesNothingWithoutDepthMaps) { EXPECT_FALSE(Fuse()); }

}  // namespace
}  // namespace sqslam::testing
