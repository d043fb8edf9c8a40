#include "app/export/camera_model.h"

#include <fmt/format.h>

#include <iterator>
#include <map>
#include <span>

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

template <typename Value>
void AppendValue(std::string& bytes, const Value& value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof(value));
}

void AppendVector(std::string& bytes, const auto& vector) {
  for (Eigen::Index i = 0; i < vector.size(); ++i) {
    AppendValue(bytes, vector[i]);
  }
}

std::uint64_t ColmapId(PointId id) { return static_cast<std::uint64_t>(id + 1); }
std::uint32_t ImageId(std::size_t index) { return static_cast<std::uint32_t>(index + 1); }

std::string BinaryCameras(const CameraModel& model) {
  const ColmapCamera camera = ToColmap(model.camera);
  std::string bytes;
  AppendValue(bytes, std::uint64_t{1});
  AppendValue(bytes, kCameraId);
  AppendValue(bytes, camera.id);
  AppendValue(bytes, static_cast<std::uint64_t>(model.camera.width));
  AppendValue(bytes, static_cast<std::uint64_t>(model.camera.height));
  for (const double parameter : camera.parameters) {
    AppendValue(bytes, parameter);
  }
  return bytes;
}

std::string BinaryImages(const CameraModel& model) {
  std::string bytes;
  AppendValue(bytes, static_cast<std::uint64_t>(model.images.size()));
  for (std::size_t i = 0; i < model.images.size(); ++i) {
    const CameraModel::Image& image = model.images[i];
    const Eigen::Quaterniond& q = image.T_camera_map.rotation;
    AppendValue(bytes, ImageId(i));
    AppendVector(bytes, Eigen::Vector4d(q.w(), q.x(), q.y(), q.z()));
    AppendVector(bytes, image.T_camera_map.translation);
    AppendValue(bytes, kCameraId);
    bytes += image.name + '\0';
    AppendValue(bytes, static_cast<std::uint64_t>(image.pixels.size()));
    for (std::size_t k = 0; k < image.pixels.size(); ++k) {
      AppendVector(bytes, image.pixels[k]);
      AppendValue(bytes, image.points[k] == kNoPoint ? ~std::uint64_t{0} : ColmapId(image.points[k]));
    }
  }
  return bytes;
}

std::string BinaryPoints(const CameraModel& model) {
  std::string bytes;
  AppendValue(bytes, static_cast<std::uint64_t>(model.points.size()));
  for (const CameraModel::Point& point : model.points) {
    AppendValue(bytes, ColmapId(point.id));
    AppendVector(bytes, point.p_map);
    AppendValue(bytes, point.rgb);
    AppendValue(bytes, point.error);
    AppendValue(bytes, static_cast<std::uint64_t>(point.track.size()));
    for (const auto& [image, pixel] : point.track) {
      AppendValue(bytes, ImageId(image));
      AppendValue(bytes, pixel);
    }
  }
  return bytes;
}

std::string TextCameras(const CameraModel& model) {
  const ColmapCamera camera = ToColmap(model.camera);
  std::string text = fmt::format("# CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n{} {} {} {}", kCameraId,
                                 camera.model, model.camera.width, model.camera.height);
  for (const double parameter : camera.parameters) {
    fmt::format_to(std::back_inserter(text), " {}", parameter);
  }
  return text + "\n";
}

std::string TextImages(const CameraModel& model) {
  std::string text =
      "# IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME\n# POINTS2D[] as (X, Y, POINT3D_ID)\n";
  for (std::size_t i = 0; i < model.images.size(); ++i) {
    const CameraModel::Image& image = model.images[i];
    const Eigen::Quaterniond& q = image.T_camera_map.rotation;
    const Eigen::Vector3d& t = image.T_camera_map.translation;
    fmt::format_to(std::back_inserter(text), "{} {} {} {} {} {} {} {} {} {}\n", ImageId(i), q.w(), q.x(),
                   q.y(), q.z(), t.x(), t.y(), t.z(), kCameraId, image.name);
    for (std::size_t k = 0; k < image.pixels.size(); ++k) {
      const std::int64_t point = image.points[k] == kNoPoint ? -1 : image.points[k] + 1;
      fmt::format_to(std::back_inserter(text), "{}{} {} {}", k == 0 ? "" : " ", image.pixels[k].x(),
                     image.pixels[k].y(), point);
    }
    text += '\n';
  }
  return text;
}

std::string TextPoints(const CameraModel& model) {
  std::string text = "# POINT3D_ID, X, Y, Z, R, G, B, ERROR, TRACK[] as (IMAGE_ID, POINT2D_IDX)\n";
  for (const CameraModel::Point& point : model.points) {
    const Eigen::Vector3d& p = point.p_map;
    fmt::format_to(std::back_inserter(text), "{} {} {} {} {} {} {} {}", ColmapId(point.id), p.x(), p.y(),
                   p.z(), point.rgb[0], point.rgb[1], point.rgb[2], point.error);
    for (const auto& [image, pixel] : point.track) {
      fmt::format_to(std::back_inserter(text), " {} {}", ImageId(image), pixel);
    }
    text += '\n';
  }
  return text;
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

CameraModel ModelOf(const Map& map, const Camera& camera) {
  const Eigen::Vector2d to_centre(kPixelCentre, kPixelCentre);
  CameraModel model;
  model.camera = camera;
  std::map<KeyframeId, std::size_t> image_of;
  for (const auto& [id, keyframe] : map.Keyframes()) {
    image_of[id] = model.images.size();
    CameraModel::Image& image = model.images.emplace_back();
    image.frame_index = keyframe.frame_index;
    image.T_camera_map = keyframe.T_camera_map;
    image.points = keyframe.points;
    for (const Keypoint& keypoint : keyframe.features->keypoints) {
      // Not the raw pixel: the pose belongs to the pixel that was corrected for the rolling shutter.
      image.pixels.emplace_back(camera.ProjectDistorted(camera.Unproject(keypoint.pixel)) + to_centre);
    }
  }
  for (const MapPoint& point : map.Points()) {
    CameraModel::Point& out = model.points.emplace_back();
    out.id = point.id;
    out.p_map = point.p_map;
    out.rgb = point.rgb;
    for (const Observation& o : point.observations) {
      const std::size_t index = image_of.at(o.keyframe);
      const CameraModel::Image& image = model.images[index];
      const Eigen::Vector2d projected = camera.ProjectDistorted(image.T_camera_map * point.p_map) + to_centre;
      out.error += (projected - image.pixels[static_cast<std::size_t>(o.keypoint)]).norm() /
                   static_cast<double>(point.observations.size());
      out.track.emplace_back(static_cast<std::uint32_t>(index), static_cast<std::uint32_t>(o.keypoint));
    }
  }
  return model;
}

void WriteColmap(const std::filesystem::path& folder, const CameraModel& model) {
  WriteFileAtomically(folder / "cameras.bin", BinaryCameras(model));
  WriteFileAtomically(folder / "images.bin", BinaryImages(model));
  WriteFileAtomically(folder / "points3D.bin", BinaryPoints(model));
  WriteFileAtomically(folder / "cameras.txt", TextCameras(model));
  WriteFileAtomically(folder / "images.txt", TextImages(model));
  WriteFileAtomically(folder / "points3D.txt", TextPoints(model));
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
  constexpr std::array<const char*, 5> kUsual = {"k1", "k2", "p1", "p2", "k3"};
  constexpr std::array<const char*, 4> kFisheye = {"k1", "k2", "k3", "k4"};
  const std::span<const char* const> names = fisheye ? std::span<const char* const>(kFisheye) : kUsual;
  for (std::size_t i = 0; i < names.size(); ++i) {
    root[names[i]] = c.distortion[i];
  }
  root["ply_file_path"] = points;
  root["frames"] = frames;
  WriteJsonFile(file, root);
}

}  // namespace sqslam::app
