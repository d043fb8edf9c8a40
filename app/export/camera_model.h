#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
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

// Returns the keyframes with an image file, by the index of their frame, and the points that two of them
// observe. `camera`: of the map. `of_files`: the same in pixels of the image files.
CameraModel ModelOf(const Map& map, const Camera& camera, const Camera& of_files,
                    const std::map<std::int64_t, std::string>& files);

// Writes cameras, images and points3D as .bin and .txt (COLMAP 3.8, https://colmap.github.io/format.html)
// into an existing folder. The lens decides between PINHOLE, OPENCV, FULL_OPENCV and OPENCV_FISHEYE. Ids
// start at 1; a point's id is the map's plus 1.
void WriteColmap(const std::filesystem::path& folder, const CameraModel& model);

// Writes nerfstudio's transforms.json: camera-to-map matrices in OpenGL's convention (x right, y up, z back),
// with the map's z axis up. `points`: file name of the cloud that training starts from. `masks`: folder with
// NAME.png for each image NAME; empty: none.
void WriteTransforms(const std::filesystem::path& file, const CameraModel& model, const std::string& points,
                     const std::string& masks = "");

// Programs that take a map's keyframes as input, each with its folder layout.
enum class ModelFormat { kColmap, kNerfstudio };
constexpr auto EnumNames(ModelFormat) { return std::array{"colmap", "nerfstudio"}; }

struct ModelSummary {
  int images = 0;
  int of_other_sequence = 0;  // keyframes omitted because the sequence does not have them
  int unreadable = 0;         // keyframes omitted because their images cannot be read
  int points = 0;
  double error = 0.0;  // px, mean reprojection error
};

struct ModelRequest {
  std::filesystem::path result;
  std::filesystem::path sequence;  // where the images are now; empty: where they were mapped from
  std::filesystem::path folder;    // new
  ModelFormat format = ModelFormat::kColmap;
  bool masks = false;  // also masks/, one PNG an image: white where the map has an object, black elsewhere
  bool link = false;   // links image files by their absolute paths instead of copying them
};

// Writes the live map of a result into a new folder: sparse/0 for COLMAP, transforms.json and points.ply for
// nerfstudio, and images/ for both, all in the pixels of the images in the files. Image files that show the
// mapped pixels to programs that ignore EXIF are copied, with underscores for blanks in their names; others
// (videos, photographs taken with the camera turned, more than 8 bits) are written as JPEG. Keyframes without
// an image are omitted. `progress` is called after each written image. Throws InputError, and UsageError if
// the folder is not empty.
ModelSummary ExportModel(const ModelRequest& request,
                         const std::function<void(int done, int total)>& progress);

}  // namespace sqslam::app
