#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <span>
#include <string>

namespace sqslam::app {

// Puts a binary glTF 2.0 file together: the JSON with nodes, meshes and materials, and the one binary buffer
// that its accessors point into. Knows the format, not maps. (VTK's exporter is no way round it: it writes
// neither names of nodes nor colours of points.)
//
// References: Khronos, glTF 2.0 specification, sections 3.6 (buffers), 3.7 (meshes), 4 (GLB).
class GlbFile {
 public:
  enum class Mode { kPoints = 0, kLines = 1, kLineStrip = 3, kTriangles = 4 };

  struct Primitive {
    Mode mode = Mode::kTriangles;
    int positions = -1;  // accessors; -1: none
    int normals = -1;
    int colors = -1;
    int indices = -1;
    int material = -1;
  };

  explicit GlbFile(const std::string& generator);

  // Each adds one accessor with a buffer view of its own and returns its number. Empty spans are refused
  // (std::invalid_argument), since glTF knows no empty accessor.
  int AddPositions(std::span<const Eigen::Vector3f> positions);
  int AddNormals(std::span<const Eigen::Vector3f> normals);
  int AddColors(std::span<const std::array<std::uint8_t, 3>> srgb);  // stored linear, as glTF wants them
  int AddIndices(std::span<const std::uint32_t> indices);            // 16 bits wide where that is enough

  // `srgb`: in [0, 1]. A lit material is a plastic; an unlit one shows its colour as it is.
  int AddMaterial(const std::string& name, const Eigen::Vector3d& srgb, bool lit);
  int AddMesh(const std::string& name, const Primitive& primitive);
  int AddCamera(const std::string& name, double view_angle, double aspect, double near_plane);  // radians
  int AddNode(nlohmann::ordered_json node);  // returns its number

  // Moves of nodes along a time axis. A channel takes the place of what the node says: "translation",
  // "rotation" (x y z w) or "scale". `times` (seconds, rising) may serve several channels.
  int AddTimes(std::span<const float> times);
  void AddChannel(int node, const char* path, int times, std::span<const Eigen::Vector3f> values, bool steps);
  void AddRotations(int node, int times, std::span<const Eigen::Vector4f> values);

  // The whole file; `root` is the one node of its scene. All channels are one animation of this name.
  std::string Bytes(int root, const std::string& scene_name) const;

 private:
  int AddAccessor(const auto& elements, nlohmann::ordered_json accessor, int target);
  int Append(const char* list, nlohmann::ordered_json value);
  void AddSampler(int node, const char* path, int times, int values, const char* interpolation);

  nlohmann::ordered_json json_;
  nlohmann::ordered_json animation_;  // null: nothing moves
  std::string buffer_;
};

}  // namespace sqslam::app
