#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <span>
#include <string>

namespace sqslam::app {

// Builds a binary glTF 2.0 file: the JSON with nodes, meshes and materials, and the binary buffer that its
// accessors point into. Knows nothing of maps. (VTK's exporter writes neither node names nor point colours.)
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

  static constexpr std::size_t kMaxBytes = 0xFFFFFFFF;  // of a file: lengths in it have 32 bits

  explicit GlbFile(const std::string& generator, std::size_t max_bytes = kMaxBytes);

  // Each adds one accessor with a buffer view of its own and returns its index. Throws std::invalid_argument
  // on an empty span: glTF has no empty accessors. Throws InputError if the file becomes longer than
  // `max_bytes`.
  int AddPositions(std::span<const Eigen::Vector3f> positions);
  int AddNormals(std::span<const Eigen::Vector3f> normals);
  int AddColors(std::span<const std::array<std::uint8_t, 3>> srgb);  // stored as linear values
  int AddIndices(std::span<const std::uint32_t> indices);            // 16 bits wide if that is enough

  // `srgb`: in [0, 1]. A lit material looks like plastic; an unlit one shows its colour unchanged.
  int AddMaterial(const std::string& name, const Eigen::Vector3d& srgb, bool lit);
  int AddMesh(const std::string& name, const Primitive& primitive);
  int AddCamera(const std::string& name, double view_angle, double aspect, double near_plane);  // radians
  int AddNode(nlohmann::ordered_json node);  // returns its index

  // Animation of nodes. A channel overrides the node's own "translation", "rotation" (x y z w) or "scale".
  // `times` (seconds, increasing) may be shared by several channels. `steps`: no interpolation.
  int AddTimes(std::span<const float> times);
  void AddChannel(int node, const char* path, int times, std::span<const Eigen::Vector3f> values, bool steps);
  void AddRotations(int node, int times, std::span<const Eigen::Vector4f> values);

  // Returns the whole file: a scene of the node `root`, and an animation of its name with all channels.
  // Throws InputError if it is longer than `max_bytes`.
  std::string Bytes(int root, const std::string& scene_name) const;

 private:
  // `more`: further keys of the accessor.
  int AddAccessor(const auto& elements, int component, const char* type, int target,
                  const nlohmann::ordered_json& more = nlohmann::ordered_json::object());
  int Append(const char* list, nlohmann::ordered_json value);
  void CheckLength(std::size_t bytes) const;
  void AddSampler(int node, const char* path, int times, int values, const char* interpolation);

  std::size_t max_bytes_;
  nlohmann::ordered_json json_;
  nlohmann::ordered_json animation_;  // null: no animation
  std::string buffer_;
};

}  // namespace sqslam::app
