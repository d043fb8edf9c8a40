#include "app/export/glb_file.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <bit>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "slam/util/json_file.h"
#include "slam/util/throw_if.h"

namespace sqslam::app {
namespace {

using Json = nlohmann::ordered_json;

static_assert(std::endian::native == std::endian::little, "glTF is little-endian");

constexpr int kUnsignedShort = 5123;
constexpr int kUnsignedInt = 5125;
constexpr int kFloat = 5126;
constexpr int kArrayBuffer = 34962;
constexpr int kElementArrayBuffer = 34963;
constexpr int kNoTarget = 0;           // for animation data
constexpr std::size_t kAlignment = 4;  // bytes; of buffer views and chunks

// Converts sRGB (IEC 61966-2-1) to the linear values that glTF uses for factors and vertex colours.
double Linear(double srgb) { return srgb <= 0.04045 ? srgb / 12.92 : std::pow((srgb + 0.055) / 1.055, 2.4); }

void Pad(std::string& bytes, char with) {
  bytes.resize((bytes.size() + kAlignment - 1) / kAlignment * kAlignment, with);
}

void AppendWord(std::string& bytes, std::uint32_t word) {
  bytes.append(reinterpret_cast<const char*>(&word), sizeof(word));
}

void AppendChunk(std::string& bytes, std::uint32_t type, const std::string& data) {
  AppendWord(bytes, static_cast<std::uint32_t>(data.size()));
  AppendWord(bytes, type);
  bytes += data;
}

}  // namespace

GlbFile::GlbFile(const std::string& generator, std::size_t max_bytes) : max_bytes_(max_bytes) {
  json_["asset"] = {{"version", "2.0"}, {"generator", generator}};
}

void GlbFile::CheckLength(std::size_t bytes) const {
  ThrowIf<InputError>(bytes > max_bytes_,
                      "a binary glTF file of {} bytes or more: expected at most {}, the limit of the format, "
                      "with fewer objects, points or triangles",
                      bytes, max_bytes_);
}

int GlbFile::Append(const char* list, Json value) {
  Json& values = json_[list];
  values.push_back(std::move(value));
  return static_cast<int>(values.size()) - 1;
}

int GlbFile::AddAccessor(const auto& elements, int component, const char* type, int target,
                         const Json& more) {
  const std::span values(elements);
  if (values.empty()) {
    throw std::invalid_argument("an accessor of no element");
  }
  Pad(buffer_, '\0');
  CheckLength(buffer_.size() + values.size_bytes());
  Json accessor = {{"componentType", component}, {"count", values.size()}, {"type", type}};
  accessor.update(more);
  Json view = {{"buffer", 0}, {"byteOffset", buffer_.size()}, {"byteLength", values.size_bytes()}};
  if (target != kNoTarget) {
    view["target"] = target;
  }
  accessor["bufferView"] = Append("bufferViews", std::move(view));
  buffer_.append(reinterpret_cast<const char*>(values.data()), values.size_bytes());  // NOLINT: bytes
  return Append("accessors", std::move(accessor));
}

int GlbFile::AddPositions(std::span<const Eigen::Vector3f> positions) {
  Eigen::AlignedBox3f box;  // glTF requires bounds of positions; exact, as every float is a double
  for (const Eigen::Vector3f& p : positions) {
    box.extend(p);
  }
  return AddAccessor(positions, kFloat, "VEC3", kArrayBuffer, {{"min", box.min()}, {"max", box.max()}});
}

int GlbFile::AddNormals(std::span<const Eigen::Vector3f> normals) {
  return AddAccessor(normals, kFloat, "VEC3", kArrayBuffer);
}

int GlbFile::AddColors(std::span<const std::array<std::uint8_t, 3>> srgb) {
  // Eight bits would merge dark colours in linear space. Four channels align every vertex to four bytes.
  std::vector<std::array<std::uint16_t, 4>> linear;
  linear.reserve(srgb.size());
  const auto wide = [](std::uint8_t value) {
    return static_cast<std::uint16_t>(std::lround(65535.0 * Linear(value / 255.0)));
  };
  for (const auto& [r, g, b] : srgb) {
    linear.push_back({wide(r), wide(g), wide(b), 65535});
  }
  return AddAccessor(linear, kUnsignedShort, "VEC4", kArrayBuffer, {{"normalized", true}});
}

int GlbFile::AddIndices(std::span<const std::uint32_t> indices) {
  // 65535 is not used: some devices take it as primitive restart.
  if (std::ranges::all_of(indices, [](std::uint32_t i) { return i < 65535; })) {
    const std::vector<std::uint16_t> narrow(indices.begin(), indices.end());
    return AddAccessor(narrow, kUnsignedShort, "SCALAR", kElementArrayBuffer);
  }
  return AddAccessor(indices, kUnsignedInt, "SCALAR", kElementArrayBuffer);
}

int GlbFile::AddMaterial(const std::string& name, const Eigen::Vector3d& srgb, bool lit) {
  Json material = {{"name", name},
                   {"pbrMetallicRoughness",
                    {{"baseColorFactor", {Linear(srgb.x()), Linear(srgb.y()), Linear(srgb.z()), 1.0}},
                     {"metallicFactor", 0.0},
                     {"roughnessFactor", lit ? 0.55 : 1.0}}}};
  if (!lit) {
    material["extensions"]["KHR_materials_unlit"] = Json::object();
    json_["extensionsUsed"] = {"KHR_materials_unlit"};
  }
  return Append("materials", std::move(material));
}

int GlbFile::AddMesh(const std::string& name, const Primitive& p) {
  Json attributes = {{"POSITION", p.positions}};
  const auto set = [](Json& in, const char* key, int accessor) {
    if (accessor >= 0) {
      in[key] = accessor;
    }
  };
  set(attributes, "NORMAL", p.normals);
  set(attributes, "COLOR_0", p.colors);
  Json primitive = {{"attributes", std::move(attributes)}, {"mode", static_cast<int>(p.mode)}};
  set(primitive, "indices", p.indices);
  set(primitive, "material", p.material);
  return Append("meshes", {{"name", name}, {"primitives", Json::array({std::move(primitive)})}});
}

int GlbFile::AddCamera(const std::string& name, double view_angle, double aspect, double near_plane) {
  return Append("cameras",
                {{"name", name},
                 {"type", "perspective"},
                 {"perspective", {{"yfov", view_angle}, {"aspectRatio", aspect}, {"znear", near_plane}}}});
}

int GlbFile::AddTimes(std::span<const float> times) {
  const Json bounds = {{"min", {times.empty() ? 0.0F : times.front()}},
                       {"max", {times.empty() ? 0.0F : times.back()}}};
  return AddAccessor(times, kFloat, "SCALAR", kNoTarget, bounds);
}

void GlbFile::AddSampler(int node, const char* path, int times, int values, const char* interpolation) {
  const std::size_t sampler = animation_["samplers"].size();
  animation_["samplers"].push_back({{"input", times}, {"output", values}, {"interpolation", interpolation}});
  animation_["channels"].push_back({{"sampler", sampler}, {"target", {{"node", node}, {"path", path}}}});
}

void GlbFile::AddChannel(int node, const char* path, int times, std::span<const Eigen::Vector3f> values,
                         bool steps) {
  AddSampler(node, path, times, AddAccessor(values, kFloat, "VEC3", kNoTarget), steps ? "STEP" : "LINEAR");
}

void GlbFile::AddRotations(int node, int times, std::span<const Eigen::Vector4f> values) {
  AddSampler(node, "rotation", times, AddAccessor(values, kFloat, "VEC4", kNoTarget), "LINEAR");
}

int GlbFile::AddNode(Json node) { return Append("nodes", std::move(node)); }

std::string GlbFile::Bytes(int root, const std::string& scene_name) const {
  Json json = json_;
  json["scene"] = 0;
  Json scene = {{"name", scene_name}};
  scene["nodes"] = Json::array({root});
  json["scenes"] = Json::array({scene});
  if (!animation_.is_null()) {
    Json animation = {{"name", scene_name}};
    animation.update(animation_);
    json["animations"] = Json::array({std::move(animation)});
  }
  std::string binary = buffer_;
  Pad(binary, '\0');
  if (!binary.empty()) {
    json["buffers"] = Json::array({Json{{"byteLength", buffer_.size()}}});
  }
  std::string text = JsonText(json, -1);
  Pad(text, ' ');
  constexpr std::size_t kHeader = 12;      // bytes, of the file
  constexpr std::size_t kChunkHeader = 8;  // bytes
  const std::size_t length =
      kHeader + kChunkHeader + text.size() + (binary.empty() ? 0 : kChunkHeader + binary.size());
  CheckLength(length);
  std::string file;
  file.reserve(length);
  AppendWord(file, 0x46546C67);  // "glTF"
  AppendWord(file, 2);
  AppendWord(file, static_cast<std::uint32_t>(length));
  AppendChunk(file, 0x4E4F534A, text);  // "JSON"
  if (!binary.empty()) {
    AppendChunk(file, 0x004E4942, binary);  // "BIN"
  }
  return file;
}

}  // namespace sqslam::app
