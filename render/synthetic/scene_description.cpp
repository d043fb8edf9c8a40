#include "render/synthetic/scene_description.h"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

#include "slam/geometry/angles.h"
#include "slam/util/throw_if.h"

namespace sqslam {
namespace {

Eigen::Vector3d ReadVector(const YAML::Node& node, const std::string& what) {
  ThrowIf<InputError>(!node || !node.IsSequence() || node.size() != 3,
                      "'{}': expected three numbers [x, y, z]", what);
  const Eigen::Vector3d vector(node[0].as<double>(), node[1].as<double>(), node[2].as<double>());
  ThrowIf<InputError>(!vector.allFinite(), "'{}': expected finite numbers", what);
  return vector;
}

// Returns the value of a key, or `otherwise` if the map has no such key. Throws if it is of another type.
template <typename T>
T ReadValue(const YAML::Node& node, const char* key, T otherwise) {
  const YAML::Node value = node[key];
  return value ? value.as<T>() : std::move(otherwise);
}

double ReadNumber(const YAML::Node& node, const char* key, double otherwise) {
  const auto number = ReadValue(node, key, otherwise);
  ThrowIf<InputError>(!std::isfinite(number), "'{}': expected a finite number", key);
  return number;
}

std::vector<double> ReadNumbers(const YAML::Node& node, const char* key, std::vector<double> otherwise) {
  auto numbers = ReadValue(node, key, std::move(otherwise));
  ThrowIf<InputError>(!std::ranges::all_of(numbers, [](double number) { return std::isfinite(number); }),
                      "'{}': expected finite numbers", key);
  return numbers;
}

TextureDescription ReadTexture(const YAML::Node& node) {
  ThrowIf<InputError>(!node || !node["pattern"], "'texture': expected a map with at least 'pattern'");
  TextureDescription texture;
  texture.pattern = node["pattern"].as<std::string>();
  texture.title = ReadValue<std::string>(node, "title", "");
  texture.seed = ReadValue<std::uint64_t>(node, "seed", 0);
  for (const YAML::Node& color : node["colors"]) {
    const Eigen::Vector3d rgb = ReadVector(color, "colors");
    ThrowIf<InputError>(rgb.minCoeff() < 0.0 || rgb.maxCoeff() > 255.0,
                        "'colors': expected red, green and blue from 0 to 255");
    texture.colors.push_back({static_cast<std::uint8_t>(rgb.x()), static_cast<std::uint8_t>(rgb.y()),
                              static_cast<std::uint8_t>(rgb.z())});
  }
  if (texture.colors.empty()) {
    texture.colors.push_back({200, 200, 200});
  }
  return texture;
}

// 'base' (the height of the lowest point), if given, replaces the z of 'center'.
SceneBody ReadBody(const YAML::Node& node) {
  SceneBody body;
  body.id = ReadValue<std::int32_t>(node, "id", 0);
  body.label = ReadValue<std::string>(node, "label", "");
  ThrowIf<InputError>(body.id > 0 && body.label.empty(), "object {}: expected a 'label'", body.id);
  Superquadric& shape = body.superquadric.shape;
  shape.half_size = ReadVector(node["half_size"], "half_size");
  const auto exponents = ReadNumbers(node, "shape", {0.1, 0.1});
  ThrowIf<InputError>(exponents.size() != 2 || shape.half_size.minCoeff() <= 0.0,
                      "expected 'shape: [e1, e2]' and a 'half_size' of positive numbers");
  ThrowIf<InputError>(std::ranges::min(exponents) < 0.0 || std::ranges::max(exponents) > 2.0,
                      "'shape': expected exponents from 0 to 2");
  shape.e1 = exponents[0];
  shape.e2 = exponents[1];
  Eigen::Vector3d center = ReadVector(node["center"], "center");
  if (node["base"]) {
    center.z() = ReadNumber(node, "base", 0.0) + shape.half_size.z();
  }
  body.yaw = ReadNumber(node, "yaw", 0.0) * kRadiansPerDegree;
  body.superquadric.T_map_object = {Eigen::Quaterniond(Eigen::AngleAxisd(body.yaw, Eigen::Vector3d::UnitZ())),
                                    center};
  body.texture = ReadTexture(node["texture"]);
  return body;
}

ScenePanel ReadPanel(const YAML::Node& node) {
  return {ReadVector(node["corner"], "corner"), ReadVector(node["u"], "u"), ReadVector(node["v"], "v"),
          ReadNumber(node, "shading_step", 0.05), ReadTexture(node["texture"])};
}

SceneLight ReadLight(const YAML::Node& node) {
  return {ReadVector(node["center"], "center"), ReadVector(node["half_u"], "half_u"),
          ReadVector(node["half_v"], "half_v"), ReadVector(node["rgb"], "rgb")};
}

Camera ReadCamera(const YAML::Node& node) {
  Camera camera;
  camera.width = ReadValue<int>(node, "width", 640);
  camera.height = ReadValue<int>(node, "height", 480);
  camera.fx = ReadNumber(node, "fx", 525.0);
  camera.fy = ReadNumber(node, "fy", camera.fx);
  camera.cx = ReadNumber(node, "cx", 0.5 * (camera.width - 1));
  camera.cy = ReadNumber(node, "cy", 0.5 * (camera.height - 1));
  camera.fps = ReadNumber(node, "fps", 30.0);
  const auto model = ReadValue<std::string>(node, "distortion_model", "radial-tangential");
  ThrowIf<InputError>(model != "fisheye" && model != "radial-tangential",
                      "'camera: distortion_model': {}, expected fisheye or radial-tangential", model);
  camera.lens = model == "fisheye" ? LensModel::kFisheye : LensModel::kRadialTangential;
  const auto coefficients = ReadNumbers(node, "distortion", {0.0, 0.0, 0.0, 0.0});
  ThrowIf<InputError>(coefficients.size() != 4,
                      "'camera: distortion': expected [k1, k2, k3, k4] of a fisheye lens, or else "
                      "[k1, k2, p1, p2]");
  std::ranges::copy(coefficients, camera.distortion.begin());
  ThrowIf<InputError>(
      camera.width < 16 || camera.height < 16 || camera.fx <= 0.0 || camera.fy <= 0.0 || camera.fps <= 0.0,
      "'camera': expected width and height of at least 16, and positive fx, fy and fps");
  return camera;
}

auto ReadList(const YAML::Node& node, const char* name, const auto& reader) {
  std::vector<decltype(reader(node))> list;
  for (const YAML::Node& entry : node[name]) {
    try {
      list.push_back(reader(entry));
    } catch (const InputError& error) {
      throw InputError("{}, line {}: {}", name, entry.Mark().line + 1, error.what());
    }
  }
  return list;
}

SceneDescription ReadNode(const YAML::Node& root) {
  SceneDescription scene;
  scene.name = ReadValue<std::string>(root, "name", "scene");
  scene.frames = ReadValue<int>(root, "frames", 240);
  scene.camera = ReadCamera(root["camera"]);
  scene.bodies = ReadList(root, "furniture", ReadBody);
  std::ranges::for_each(scene.bodies, [](SceneBody& body) { body.id = 0; });
  std::ranges::copy(ReadList(root, "objects", ReadBody), std::back_inserter(scene.bodies));
  scene.panels = ReadList(root, "panels", ReadPanel);
  scene.lights = ReadList(root, "lights", ReadLight);
  scene.waypoints = ReadList(root["motion"], "waypoints", [](const YAML::Node& node) {
    return SceneWaypoint{ReadVector(node["position"], "position"), ReadVector(node["look_at"], "look_at")};
  });
  ThrowIf<InputError>(scene.waypoints.size() < 2, "'motion: waypoints': expected at least two");
  scene.tremor_position = ReadNumber(root["motion"], "tremor_position", scene.tremor_position);
  scene.tremor_angle = ReadNumber(root["motion"], "tremor_angle", 0.25) * kRadiansPerDegree;
  if (root["ambient"]) {
    scene.ambient = ReadVector(root["ambient"], "ambient");
  }
  return scene;
}

}  // namespace

SceneDescription ReadScene(const std::filesystem::path& path) {
  try {
    const YAML::Node root = YAML::LoadFile(path.string());
    ThrowIf<InputError>(!root.IsMap() || !root["motion"] || !root["camera"],
                        "expected a scene description with at least 'camera' and 'motion'");
    return ReadNode(root);
  } catch (const YAML::BadFile&) {
    throw InputError("{}: cannot be read; expected a scene description (YAML)", path.string());
  } catch (const YAML::Exception& error) {
    throw InputError("{}:{}: {}", path.string(), error.mark.line + 1, error.msg);
  } catch (const InputError& error) {
    throw InputError("{}: {}", path.string(), error.what());
  }
}

}  // namespace sqslam
