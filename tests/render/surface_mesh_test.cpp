#include "render/surface/surface_mesh.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <filesystem>
#include <functional>
#include <set>

#include "slam/snapshot/recording.h"
#include "tests/io/temporary_folder.h"

namespace sqslam {
namespace {

constexpr double kVoxel = 0.05;
constexpr double kTruncation = 4.0 * kVoxel;

// Blocks of the cube up to one metre from the origin: distances by `distance` (map units), seen where `seen`
// says so, red rising with x.
SurfaceVolume Sampled(
    const std::function<double(const Eigen::Vector3d&)>& distance,
    const std::function<bool(const Eigen::Vector3d&)>& seen = [](const auto&) { return true; }) {
  constexpr int kReach = 3;  // blocks
  SurfaceVolume volume;
  volume.voxel = kVoxel;
  for (int x = -kReach; x < kReach; ++x) {
    for (int y = -kReach; y < kReach; ++y) {
      for (int z = -kReach; z < kReach; ++z) {
        volume.places.push_back({x, y, z});
        SurfaceVolume::Block& block = volume.blocks.emplace_back();
        for (int i = 0; i < 8 * 8 * 8; ++i) {
          const Eigen::Vector3d p =
              kVoxel * Eigen::Vector3d(8 * x + i % 8, 8 * y + i / 8 % 8, 8 * z + i / 64);
          SurfaceVolume::Voxel& voxel = block[static_cast<std::size_t>(i)];
          voxel.distance = static_cast<float>(std::clamp(distance(p) / kTruncation, -1.0, 1.0));
          voxel.weight = seen(p) ? 1.0F : 0.0F;
          voxel.rgb = {static_cast<std::uint16_t>(256.0 * (128.0 + 100.0 * p.x())), 256 * 50, 0};
        }
      }
    }
  }
  return volume;
}

double Ball(const Eigen::Vector3d& p) { return p.norm() - 0.6; }

SurfaceOptions Whole() {
  SurfaceOptions options;
  options.min_island = 0;
  return options;
}

TEST(SurfaceMesh, ReconstructsBallAsClosedColouredSurface) {
  const SurfaceMesh mesh = MarchSurface(Sampled(Ball), Whole());
  ASSERT_GT(mesh.triangles.size(), 1000U);
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    EXPECT_NEAR(mesh.vertices[i].norm(), 0.6, 0.002);
    EXPECT_NEAR(mesh.rgb[i][0], 128.0 + 100.0 * mesh.vertices[i].x(), 2.0);
    EXPECT_EQ(mesh.rgb[i][1], 50);
  }
  std::set<std::pair<std::uint32_t, std::uint32_t>> edges;
  for (const auto& [a, b, c] : mesh.triangles) {
    const Eigen::Vector3f normal =
        (mesh.vertices[b] - mesh.vertices[a]).cross(mesh.vertices[c] - mesh.vertices[a]);
    EXPECT_GE(normal.dot(mesh.vertices[a]), 0.0F);  // towards the cameras' side
    for (const auto& [from, to] : {std::pair(a, b), std::pair(b, c), std::pair(c, a)}) {
      EXPECT_TRUE(edges.emplace(from, to).second);
    }
  }
  for (const auto& [from, to] : edges) {
    EXPECT_TRUE(edges.contains({to, from}));  // no seam between the parts that are marched apart
  }
  EXPECT_EQ(mesh.vertices.size() + mesh.triangles.size() - edges.size() / 2, 2U);  // Euler's formula
}

TEST(SurfaceMesh, LeavesHoleWhereNothingWasSeen) {
  const SurfaceMesh mesh = MarchSurface(Sampled(Ball, [](const auto& p) { return p.z() < 0.3; }), Whole());
  ASSERT_FALSE(mesh.vertices.empty());
  for (const Eigen::Vector3f& p : mesh.vertices) {
    EXPECT_LT(p.z(), 0.3F + 1e-4F);
  }
}

TEST(SurfaceMesh, RemovesSmallIslands) {
  const auto two = [](const Eigen::Vector3d& p) {
    return std::min(p.norm() - 0.5, (p - Eigen::Vector3d(0.8, 0.8, 0.8)).norm() - 0.12);
  };
  const auto farthest = [](const SurfaceMesh& mesh) {
    float most = 0.0F;
    for (const Eigen::Vector3f& p : mesh.vertices) {
      most = std::max(most, p.norm());
    }
    return most;
  };
  SurfaceOptions options = Whole();
  EXPECT_GT(farthest(MarchSurface(Sampled(two), options)), 1.2F);
  options.min_island = 500;
  EXPECT_LT(farthest(MarchSurface(Sampled(two), options)), 0.51F);
}

TEST(SurfaceMesh, SimplifiesToMaxTriangles) {
  SurfaceOptions options = Whole();
  options.max_triangles = 600;
  const SurfaceMesh mesh = MarchSurface(Sampled(Ball), options);
  EXPECT_LE(mesh.triangles.size(), 620U);
  EXPECT_GT(mesh.triangles.size(), 300U);
  EXPECT_EQ(mesh.rgb.size(), mesh.vertices.size());
  for (const Eigen::Vector3f& p : mesh.vertices) {
    EXPECT_NEAR(p.norm(), 0.6, 0.02);
  }
}

TEST(SurfaceMesh, ReturnsNothingForEmptyVolume) { EXPECT_TRUE(MarchSurface({}, Whole()).triangles.empty()); }

TEST(SurfaceMesh, MarksFirstDepthMapThatShowsEachPart) {
  const TemporaryFolder folder;
  const std::filesystem::path file = folder.Path() / "seen.sqmap";
  RecordingWriter(file, {}).Add({});
  {
    DepthRecording depths(file, DepthRecording::Access::kWrite);
    for (const int frame : {5, 9}) {  // the left half of a wall, then all of it
      DepthMap wall;
      wall.keyframe = wall.frame_index = frame;
      wall.camera = {64, 48, 60.0, 60.0, 31.5, 23.5, {}, 30.0};
      wall.depth = cv::Mat(48, 64, CV_32F, cv::Scalar(2.0));
      wall.depth(frame == 5 ? cv::Rect(32, 0, 32, 48) : cv::Rect(46, 0, 6, 48)).setTo(0.0);
      wall.views = cv::Mat(48, 64, CV_8U, cv::Scalar(3));
      wall.bgr = cv::Mat(48, 64, CV_8UC3, cv::Scalar(0, 255, 0));
      depths.PutEstimate(wall, "settings");
      depths.PutKept(wall);
    }
  }
  SurfaceMesh mesh;
  constexpr std::uint32_t kAcross = 19;
  for (std::uint32_t i = 0; i < kAcross; ++i) {
    for (const float y : {-0.5F, 0.5F}) {
      mesh.vertices.emplace_back(0.1F * static_cast<float>(i) - 0.9F, y, 2.0F);
    }
    if (i + 1 < kAcross) {
      mesh.triangles.push_back({2 * i, 2 * i + 1, 2 * i + 2});
    }
  }
  mesh.vertices.emplace_back(0.0F, 0.0F, 1.0F);  // before the wall, on no map
  MarkFirstSeen(DepthRecording(file), mesh);
  for (std::size_t i = 0; i + 1 < mesh.vertices.size(); ++i) {
    EXPECT_EQ(mesh.frames[i], mesh.vertices[i].x() < -0.01F ? 5 : 9) << mesh.vertices[i].transpose();
  }
  EXPECT_EQ(mesh.frames.back(), 9);
}

}  // namespace
}  // namespace sqslam
