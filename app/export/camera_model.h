#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "slam/geometry/camera.h"
#include "slam/geometry/rigid3.h"
#include "slam/map/map.h"

namespace sqslam::app {

// A map as structure-from-motion programs have it: images with their keypoints, points with their tracks.
// Pixels and principal point are COLMAP's: the centre of the first pixel is (0.5, 0.5). Keypoints lie where
// the lens shows them.
struct CameraModel {
  struct Image {
    std::int64_t frame_index = 0;
    std::string name;  // below the folder of the images
    Rigid3d T_camera_map;
    std::vector<Eigen::Vector2d> pixels;
    std::vector<PointId> points;  // one per pixel, kNoPoint where none
  };
  struct Point {
    PointId id = kNoPoint;
    Eigen::Vector3d p_map = Eigen::Vector3d::Zero();
    std::array<std::uint8_t, 3> rgb{};
    double error = 0.0;                                          // px, mean of its reprojection errors
    std::vector<std::pair<std::uint32_t, std::uint32_t>> track;  // index of the image and of its pixel
  };
  Camera camera;  // its principal point as in our files: COLMAP's is half a pixel more
  std::vector<Image> images;
  std::vector<Point> points;

  void Scale(double factor);  // multiplies its lengths
  double MeanError() const;   // px, of all points
};

// Keyframes become images without names yet.
CameraModel ModelOf(const Map& map, const Camera& camera);

// cameras, images and points3D as .bin and as .txt (COLMAP 3.8, https://colmap.github.io/format.html) in an
// existing folder. Cameras are PINHOLE, OPENCV or FULL_OPENCV by their distortion. Ids count from 1, those of
// points are the map's plus 1.
void WriteColmap(const std::filesystem::path& folder, const CameraModel& model);

// transforms.json of nerfstudio: camera-to-map matrices with x right, y up, z back (OpenGL's cameras) and the
// map's z axis up. `points`: name of the cloud that trainers begin with.
void WriteTransforms(const std::filesystem::path& file, const CameraModel& model, const std::string& points);

}  // namespace sqslam::app
