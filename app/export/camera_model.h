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

// A map in the form of structure-from-motion programs: images with their keypoints, points with their tracks.
// Pixels follow COLMAP's convention, in which the centre of the first pixel is (0.5, 0.5), and include the
// lens distortion.
struct CameraModel {
  struct Image {
    std::int64_t frame_index = 0;
    std::string name;  // path relative to the folder of the images
    Rigid3d T_camera_map;
    std::vector<Eigen::Vector2d> pixels;
    std::vector<PointId> points;  // one per pixel; kNoPoint: none
  };
  struct Point {
    PointId id = kNoPoint;
    Eigen::Vector3d p_map = Eigen::Vector3d::Zero();
    std::array<std::uint8_t, 3> rgb{};
    double error = 0.0;                                          // px, mean reprojection error
    std::vector<std::pair<std::uint32_t, std::uint32_t>> track;  // indices of image and pixel
  };
  Camera camera;  // our convention: the principal point is half a pixel less than COLMAP's
  std::vector<Image> images;
  std::vector<Point> points;

  void Scale(double factor);  // multiplies all lengths
  double MeanError() const;   // px, over all points
};

// Keyframes become images; their names are left empty.
CameraModel ModelOf(const Map& map, const Camera& camera);

// Writes cameras, images and points3D as .bin and .txt (COLMAP 3.8, https://colmap.github.io/format.html)
// into an existing folder. The lens decides between PINHOLE, OPENCV, FULL_OPENCV and OPENCV_FISHEYE. Ids
// start at 1; a point's id is the map's plus 1.
void WriteColmap(const std::filesystem::path& folder, const CameraModel& model);

// Writes nerfstudio's transforms.json: camera-to-map matrices in OpenGL's convention (x right, y up, z back),
// with the map's z axis up. `points`: file name of the cloud that training starts from. `masks`: folder with
// NAME.png for each image NAME; empty: none.
void WriteTransforms(const std::filesystem::path& file, const CameraModel& model, const std::string& points,
                     const std::string& masks = "");

}  // namespace sqslam::app
