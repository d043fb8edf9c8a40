#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <vector>

#include "app/export/glb_file.h"
#include "app/export/map_export.h"
#include "render/camera/camera_path.h"
#include "render/scene/style.h"
#include "render/solids/tessellation.h"
#include "slam/dense/surface_fusion.h"
#include "slam/io/map_frame.h"
#include "slam/snapshot/recording.h"
#include "slam/util/atomic_file.h"
#include "slam/util/options.h"
#include "slam/util/text_lines.h"
#include "slam/util/throw_if.h"
#include "slam/util/to_vector.h"

namespace sqslam::app {
namespace {

using GlbJson = nlohmann::ordered_json;

void SetPose(GlbJson& node, const Rigid3d& pose) {
  node["translation"] = pose.translation;
  node["rotation"] = pose.rotation.normalized().coeffs();
}

// Starts with the id, so that names stay unique when cut: Blender keeps 63 bytes of a name.
std::string NodeName(const SnapshotObject& object) {
  constexpr std::size_t kMaxNameBytes = 63;
  return CutText(fmt::format("{} {}", object.id, ShownName(object)), kMaxNameBytes);
}

// Converts to glTF's camera frame, which looks along -z with y up.
Rigid3d GlbCameraPose(const Rigid3d& T_map_camera) {
  return {T_map_camera.rotation * Eigen::Quaterniond(0.0, 1.0, 0.0, 0.0), T_map_camera.translation};
}

GlbJson Extras(const SnapshotObject& object) {
  const Superquadric& shape = object.superquadric.shape;
  return {{"id", object.id},         {"label", object.label},
          {"score", object.score},   {"observations", object.observations},
          {"points", object.points}, {"half_size", shape.half_size},
          {"e1", shape.e1},          {"e2", shape.e2},
          {"yaw", object.yaw}};
}

class MapWriter {
 public:
  MapWriter(const MapSnapshot& map, const std::string& generator, const SceneStyle& style = {})
      : map_(map), file_(generator), style_(style), colors_(style.objects.colors) {}

  void AddObjects(int segments = 64) {
    segments_ = segments;
    GlbJson nodes = GlbJson::array();
    for (const SnapshotObject& object : map_.objects) {
      const std::string name = NodeName(object);
      GlbJson node = {{"name", name}, {"mesh", AddMesh(name, object)}, {"extras", Extras(object)}};
      SetPose(node, object.superquadric.T_map_object);
      nodes.push_back(file_.AddNode(std::move(node)));
      node_of_[object.id] = nodes.back();
    }
    AddGroup("objects", std::move(nodes));
  }

  void AddPoints(const std::string& name, const auto& points) {
    if (points.empty()) {
      return;
    }
    std::vector<Eigen::Vector3f> positions;
    std::vector<std::array<std::uint8_t, 3>> colors;
    for (const auto& point : points) {
      positions.push_back(point.p_map);
      colors.push_back(point.rgb);
    }
    AddDrawing(name, GlbFile::Mode::kPoints, positions, file_.AddColors(colors), Eigen::Vector3d::Ones());
  }

  void AddSurface(const SurfaceMesh& surface) {
    if (surface.triangles.empty()) {
      return;
    }
    std::vector<std::uint32_t> indices;
    for (const auto& triangle : surface.triangles) {
      indices.insert(indices.end(), triangle.begin(), triangle.end());
    }
    // Unlit: the colours from the images already contain the room's light.
    const int material = file_.AddMaterial("surface", Eigen::Vector3d::Ones(), false);
    const int mesh = file_.AddMesh("surface", {.positions = file_.AddPositions(surface.vertices),
                                               .colors = file_.AddColors(surface.rgb),
                                               .indices = file_.AddIndices(indices),
                                               .material = material});
    children_.push_back(file_.AddNode({{"name", "surface"}, {"mesh", mesh}}));
  }

  void AddTrajectory(const Trajectory& trajectory) {
    path_ = trajectory;
    const std::vector<Eigen::Vector3f> centers = ToVector(
        path_, [](const TimedPose& pose) { return pose.T_map_camera.translation.cast<float>().eval(); });
    if (centers.size() >= 2) {
      AddDrawing("trajectory", GlbFile::Mode::kLineStrip, centers, -1, ParseColor(style_.cameras.color));
    }
  }

  void AddKeyframes() {
    const Camera& camera = map_.camera;
    if (map_.keyframes.empty() || camera.height <= 0 || !(camera.fy > 0.0)) {
      return;
    }
    const double size = FrustumHeight();
    lens_ = file_.AddCamera("camera", 2.0 * std::atan(0.5 * camera.height / camera.fy),
                            camera.fy * camera.width / (camera.fx * camera.height), 0.1 * size);
    GlbJson nodes = GlbJson::array();
    std::vector<Eigen::Vector3f> lines;
    for (const SnapshotKeyframe& keyframe : map_.keyframes) {
      GlbJson node = {{"name", fmt::format("keyframe {}", keyframe.id)},
                      {"camera", lens_},
                      {"extras", {{"frame", keyframe.frame_index}, {"timestamp", keyframe.timestamp}}}};
      SetPose(node, GlbCameraPose(keyframe.T_map_camera));
      nodes.push_back(file_.AddNode(std::move(node)));
      AppendFrustum(keyframe.T_map_camera, size, lines);
    }
    AddGroup("keyframes", std::move(nodes));
    AddDrawing("frusta", GlbFile::Mode::kLines, lines, -1, ParseColor(style_.cameras.color));
  }

  // Animates the camera along its path; objects appear when they are first seen. Call after AddKeyframes.
  void AddFlight(const std::map<std::int32_t, double>& first_seen) {
    if (path_.size() < 2 || lens_ < 0) {
      return;
    }
    std::vector<float> times;
    std::vector<Eigen::Vector3f> places;
    std::vector<Eigen::Vector4f> turns;
    const double start = path_.front().timestamp;
    for (const TimedPose& pose : path_) {
      const auto time = static_cast<float>(pose.timestamp - start);
      if (!times.empty() && time <= times.back()) {
        continue;
      }
      const Rigid3d camera = GlbCameraPose(pose.T_map_camera);
      Eigen::Vector4f turn = camera.rotation.normalized().coeffs().cast<float>();
      if (!turns.empty() && turn.dot(turns.back()) < 0.0F) {
        turn = -turn;  // the same rotation, but the shorter way for componentwise interpolation
      }
      times.push_back(time);
      places.push_back(camera.translation.cast<float>());
      turns.push_back(turn.normalized());
    }
    GlbJson node = {{"name", "flight"}, {"camera", lens_}};
    SetPose(node, GlbCameraPose(path_.front().T_map_camera));
    children_.push_back(file_.AddNode(std::move(node)));
    const int axis = file_.AddTimes(times);
    file_.AddChannel(children_.back(), "translation", axis, places, false);
    file_.AddRotations(children_.back(), axis, turns);
    for (const auto& [id, seen] : first_seen) {
      const auto object = node_of_.find(id);
      const auto time = std::min(static_cast<float>(seen - start), times.back());
      if (object != node_of_.end() && time > 0.0F) {
        const std::array<Eigen::Vector3f, 2> sizes = {Eigen::Vector3f::Zero(), Eigen::Vector3f::Ones()};
        file_.AddChannel(object->second, "scale", file_.AddTimes(std::array{0.0F, time}), sizes, true);
      }
    }
  }

  std::string Bytes() {
    GlbJson root = {{"name", "map"}};
    const double half = std::sqrt(0.5);
    root["rotation"] = {-half, 0.0, 0.0, half};  // a quarter turn about x turns z up into y up
    root["extras"] = {{"frame", map_.frame_index},
                      {"timestamp", map_.timestamp},
                      {"z_up", map_.gravity_known},
                      {"unit", FrameOf(map_).Unit()}};
    if (!children_.empty()) {
      root["children"] = children_;
    }
    return file_.Bytes(file_.AddNode(std::move(root)), "map");
  }

 private:
  int AddMesh(const std::string& name, const SnapshotObject& object) {
    TriangleMesh mesh;  // of all solids, object frame
    std::vector<std::uint32_t> indices;
    const Rigid3d T_object_map = object.superquadric.T_map_object.Inverse();
    for (const PosedSuperquadric& solid : SolidsOf(object)) {
      const TriangleMesh surface = Tessellate(solid.shape, segments_);
      const auto base = static_cast<std::uint32_t>(mesh.vertices.size());
      const Eigen::Vector3f centre = (T_object_map * solid.T_map_object.translation).cast<float>();
      std::ranges::transform(surface.vertices, std::back_inserter(mesh.vertices),
                             [&](const Eigen::Vector3f& p) -> Eigen::Vector3f { return centre + p; });
      mesh.normals.insert(mesh.normals.end(), surface.normals.begin(), surface.normals.end());
      for (const auto& triangle : surface.triangles) {
        for (const std::int32_t corner : triangle) {
          indices.push_back(base + static_cast<std::uint32_t>(corner));
        }
      }
    }
    const auto [material, is_new] = materials_.try_emplace(object.label, -1);
    if (is_new) {
      material->second = file_.AddMaterial(object.label, colors_(object.label), true);
    }
    return file_.AddMesh(name, {.positions = file_.AddPositions(mesh.vertices),
                                .normals = file_.AddNormals(mesh.normals),
                                .indices = file_.AddIndices(indices),
                                .material = material->second});
  }

  void AddDrawing(const std::string& name, GlbFile::Mode mode, const std::vector<Eigen::Vector3f>& positions,
                  int colors, const Eigen::Vector3d& color) {
    const int mesh = file_.AddMesh(name, {.mode = mode,
                                          .positions = file_.AddPositions(positions),
                                          .colors = colors,
                                          .material = file_.AddMaterial(name, color, false)});
    children_.push_back(file_.AddNode({{"name", name}, {"mesh", mesh}}));
  }

  void AddGroup(const char* name, GlbJson nodes) {
    if (!nodes.empty()) {
      children_.push_back(file_.AddNode({{"name", name}, {"children", std::move(nodes)}}));
    }
  }

  // A twentieth of the path's extent: small against the map but visible.
  double FrustumHeight() const {
    Eigen::AlignedBox3d path;
    for (const SnapshotKeyframe& keyframe : map_.keyframes) {
      path.extend(keyframe.T_map_camera.translation);
    }
    return std::max(0.05 * path.diagonal().norm(), 1e-3);
  }

  // Appends eight lines: from the camera centre to the corners of the image, `height` high, and its border.
  void AppendFrustum(const Rigid3d& T_map_camera, double height, std::vector<Eigen::Vector3f>& lines) const {
    const std::array<Eigen::Vector3d, 5> corners = FrustumCorners(T_map_camera, map_.camera, height);
    for (std::size_t i = 1; i < 5; ++i) {
      for (const std::size_t end : {std::size_t{0}, i, i, i % 4 + 1}) {
        lines.push_back(corners[end].cast<float>());
      }
    }
  }

  const MapSnapshot& map_;
  GlbFile file_;
  SceneStyle style_;
  LabelColors colors_;
  int segments_ = 0;  // steps of longitude of each superquadric
  Trajectory path_;
  int lens_ = -1;                        // index of the glTF camera; -1: none
  std::map<std::int32_t, int> node_of_;  // by object id
  std::map<std::string, int> materials_;
  GlbJson children_ = GlbJson::array();
};

}  // namespace

std::string MapGlb(const MapSnapshot& map, const Trajectory& trajectory, const SurfaceMesh& surface,
                   const std::map<std::int32_t, double>& first_seen, const std::string& generator,
                   const SceneStyle& style) {
  MapWriter writer(map, generator, style);
  writer.AddObjects();
  writer.AddPoints("points", map.points);
  writer.AddSurface(surface);
  writer.AddTrajectory(trajectory);
  writer.AddKeyframes();
  writer.AddFlight(first_seen);
  return writer.Bytes();
}

std::string ViewGlb(const MapSnapshot& map, const std::vector<CloudPoint>& cloud, int segments,
                    const std::string& generator, const SceneStyle& style) {
  MapWriter writer(map, generator, style);
  writer.AddObjects(segments);
  writer.AddPoints("points", map.points);
  writer.AddPoints("cloud", cloud);
  return writer.Bytes();
}

std::optional<SurfaceMesh> SurfaceOf(const std::filesystem::path& recording, int threads,
                                     const DensifyProgress& progress) {
  const DepthRecording depths(recording);
  ThrowIf<InputError>(depths.Keyframes().empty(), "{}: holds no depth maps, expected those of sqslam densify",
                      recording.string());
  SurfaceOptions options;
  if (const std::string text = depths.Text(kSurfaceOptions); !text.empty()) {
    ParseOptions(text, recording.string(), options);
  }
  const std::optional<SurfaceVolume> volume = FuseSurface(depths, options, threads, progress);
  return volume ? std::optional(MarchSurface(*volume, options)) : std::nullopt;
}

bool WriteSurface(const std::filesystem::path& result, int threads, const DensifyProgress& progress) {
  const std::filesystem::path recording = result / "map.sqmap";
  const std::optional<SurfaceMesh> mesh = SurfaceOf(recording, threads, progress);
  if (mesh) {
    const MapSnapshotPtr map = RecordingReader(recording).Last();
    MapWriter writer(*map, "sqslam " SQSLAM_VERSION);
    writer.AddSurface(*mesh);
    WriteFileAtomically(result / "dense.glb", writer.Bytes());
  }
  return mesh.has_value();
}

}  // namespace sqslam::app
