#include "app/export/camera_model.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <map>
#include <span>
#include <type_traits>

#include "slam/io/pose_json.h"
#include "slam/util/atomic_file.h"
#include "slam/util/json_file.h"

namespace sqslam::app {
namespace {

constexpr double kPixelCentre = 0.5;
constexpr std::uint32_t kCameraId = 1;

struct ColmapCamera {
  const char* model;
  std::int32_t id;  // COLMAP's number of the model
  std::vector<double> parameters;
};

ColmapCamera ToColmap(const Camera& c) {
  const auto& [k1, k2, p1, p2, k3] = c.distortion;
  std::vector<double> parameters = {c.fx, c.fy, c.cx + kPixelCentre, c.cy + kPixelCentre};
  if (!c.HasDistortion()) {
    return {"PINHOLE", 1, parameters};
  }
  parameters.insert(parameters.end(), {k1, k2, p1, p2});  // of a fisheye lens k1 to k4
  if (c.lens == LensModel::kFisheye) {
    return {"OPENCV_FISHEYE", 5, parameters};
  }
  if (k3 == 0.0) {
    return {"OPENCV", 4, parameters};
  }
  parameters.insert(parameters.end(), {k3, 0.0, 0.0, 0.0});
  return {"FULL_OPENCV", 6, parameters};
}

// One of COLMAP's files: binary, or as text with the same values, one record a line.
class ColmapFile {
 public:
  // `header`: comment of the text; `records`: their number.
  ColmapFile(bool binary, const char* header, std::size_t records)
      : binary_(binary), bytes_(binary ? "" : header) {
    Count(records);
  }

  ColmapFile& Put(const auto&... values) {
    (Append(values), ...);
    return *this;
  }
  void Count(std::size_t size) {  // the text has line ends instead
    if (binary_) {
      Append(static_cast<std::uint64_t>(size));
    }
  }
  void EndLine() { bytes_ += binary_ ? "" : "\n"; }

  const std::string& Bytes() const { return bytes_; }

 private:
  template <typename Value>
  void Append(const Value& value) {
    if constexpr (requires {
                    value.size();
                    value[0];
                  } &&
                  !std::is_same_v<Value, std::string>) {
      std::ranges::for_each(value, [this](const auto& item) { Append(item); });
    } else if (!binary_) {
      fmt::format_to(std::back_inserter(bytes_), "{}{}", bytes_.ends_with('\n') ? "" : " ", value);
    } else if constexpr (std::is_same_v<Value, std::string>) {
      bytes_ += value + '\0';
    } else {
      bytes_.append(reinterpret_cast<const char*>(&value), sizeof(value));
    }
  }

  bool binary_;
  std::string bytes_;
};

// Ids of COLMAP; -1 for no point.
std::int64_t ColmapId(PointId id) { return id == kNoPoint ? -1 : id + 1; }
std::uint32_t ImageId(std::size_t index) { return static_cast<std::uint32_t>(index + 1); }

std::string Cameras(const CameraModel& model, bool binary) {
  const ColmapCamera camera = ToColmap(model.camera);
  ColmapFile file(binary, "# CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n", 1);
  file.Put(kCameraId);
  binary ? file.Put(camera.id) : file.Put(std::string(camera.model));
  file.Put(std::int64_t{model.camera.width}, std::int64_t{model.camera.height}, camera.parameters);
  file.EndLine();
  return file.Bytes();
}

std::string Images(const CameraModel& model, bool binary) {
  ColmapFile file(
      binary, "# IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME\n# POINTS2D[] as (X, Y, POINT3D_ID)\n",
      model.images.size());
  for (std::size_t i = 0; i < model.images.size(); ++i) {
    const CameraModel::Image& image = model.images[i];
    const auto& [rotation, translation] = image.T_camera_map;
    file.Put(ImageId(i), rotation.w(), rotation.vec(), translation, kCameraId, image.name).EndLine();
    file.Count(image.pixels.size());
    for (std::size_t k = 0; k < image.pixels.size(); ++k) {
      file.Put(image.pixels[k], ColmapId(image.points[k]));
    }
    file.EndLine();
  }
  return file.Bytes();
}

std::string Points(const CameraModel& model, bool binary) {
  ColmapFile file(binary, "# POINT3D_ID, X, Y, Z, R, G, B, ERROR, TRACK[] as (IMAGE_ID, POINT2D_IDX)\n",
                  model.points.size());
  for (const CameraModel::Point& point : model.points) {
    file.Put(ColmapId(point.id), point.p_map, point.rgb, point.error).Count(point.track.size());
    for (const auto& [image, pixel] : point.track) {
      file.Put(ImageId(image), pixel);
    }
    file.EndLine();
  }
  return file.Bytes();
}

}  // namespace

void CameraModel::Scale(double factor) {
  for (Image& image : images) {
    image.T_camera_map.translation *= factor;
  }
  for (Point& point : points) {
    point.p_map *= factor;
  }
}

double CameraModel::MeanError() const {
  double sum = 0.0;
  for (const Point& point : points) {
    sum += point.error;
  }
  return points.empty() ? 0.0 : sum / static_cast<double>(points.size());
}

CameraModel ModelOf(const Map& map, const Camera& camera, const Camera& of_files,
                    const std::map<std::int64_t, std::string>& files) {
  const Eigen::Vector2d to_centre(kPixelCentre, kPixelCentre);
  CameraModel model;
  model.camera = of_files;
  std::map<KeyframeId, std::size_t> image_of;
  for (const auto& [id, keyframe] : map.Keyframes()) {
    const auto file = files.find(keyframe.frame_index);
    if (file == files.end()) {
      continue;
    }
    image_of[id] = model.images.size();
    CameraModel::Image& image = model.images.emplace_back();
    image.frame_index = keyframe.frame_index;
    image.name = file->second;
    image.T_camera_map = keyframe.T_camera_map;
    image.points = keyframe.points;
    for (const Keypoint& keypoint : keyframe.features->keypoints) {
      // Not the raw pixel: the pose belongs to the pixel that was corrected for the rolling shutter.
      image.pixels.emplace_back(of_files.ProjectDistorted(camera.Unproject(keypoint.pixel)) + to_centre);
    }
  }
  for (const MapPoint& point : map.Points()) {
    CameraModel::Point out;
    out.id = point.id;
    out.p_map = point.p_map;
    out.rgb = point.rgb;
    for (const Observation& o : point.observations) {
      if (const auto index = image_of.find(o.keyframe); index != image_of.end()) {
        const CameraModel::Image& image = model.images[index->second];
        const auto pixel = static_cast<std::size_t>(o.keypoint);
        const Eigen::Vector2d projected =
            of_files.ProjectDistorted(image.T_camera_map * point.p_map) + to_centre;
        out.error += (projected - image.pixels[pixel]).norm();
        out.track.emplace_back(index->second, pixel);
      }
    }
    if (out.track.size() >= 2) {
      out.error /= static_cast<double>(out.track.size());
      model.points.push_back(std::move(out));
    } else {
      for (const auto& [image, pixel] : out.track) {
        model.images[image].points[pixel] = kNoPoint;
      }
    }
  }
  return model;
}

void WriteColmap(const std::filesystem::path& folder, const CameraModel& model) {
  for (const bool binary : {true, false}) {
    const std::string extension = binary ? ".bin" : ".txt";
    WriteFileAtomically(folder / ("cameras" + extension), Cameras(model, binary));
    WriteFileAtomically(folder / ("images" + extension), Images(model, binary));
    WriteFileAtomically(folder / ("points3D" + extension), Points(model, binary));
  }
}

void WriteTransforms(const std::filesystem::path& file, const CameraModel& model, const std::string& points,
                     const std::string& masks) {
  const Camera& c = model.camera;
  nlohmann::ordered_json frames = nlohmann::ordered_json::array();
  for (const CameraModel::Image& image : model.images) {
    Eigen::Matrix4d matrix = image.T_camera_map.Inverse().Matrix();
    matrix.col(1) = -matrix.col(1);
    matrix.col(2) = -matrix.col(2);
    frames.push_back({{"file_path", "images/" + image.name}, {"transform_matrix", RowsOf(matrix)}});
    if (!masks.empty()) {
      frames.back()["mask_path"] = fmt::format("{}/{}.png", masks, image.name);
    }
  }
  const bool fisheye = c.lens == LensModel::kFisheye;
  nlohmann::ordered_json root = {{"camera_model", fisheye ? "OPENCV_FISHEYE" : "OPENCV"},
                                 {"w", c.width},
                                 {"h", c.height},
                                 {"fl_x", c.fx},
                                 {"fl_y", c.fy},
                                 {"cx", c.cx + kPixelCentre},
                                 {"cy", c.cy + kPixelCentre}};
  constexpr std::array<const char*, 5> kBrownConrady = {"k1", "k2", "p1", "p2", "k3"};
  constexpr std::array<const char*, 4> kFisheye = {"k1", "k2", "k3", "k4"};
  const std::span<const char* const> names = fisheye ? std::span<const char* const>(kFisheye) : kBrownConrady;
  for (std::size_t i = 0; i < names.size(); ++i) {
    root[names[i]] = c.distortion[i];
  }
  root["ply_file_path"] = points;
  root["frames"] = frames;
  WriteJsonFile(file, root);
}

}  // namespace sqslam::app
