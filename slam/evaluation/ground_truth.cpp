#include "slam/evaluation/ground_truth.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "slam/evaluation/ground_truth_poses.h"
#include "slam/io/dataset_layouts.h"
#include "slam/io/image_files.h"
#include "slam/io/pose_json.h"
#include "slam/io/sequence.h"
#include "slam/util/error.h"
#include "slam/util/text_lines.h"

namespace sqslam {
namespace {

using nlohmann::json;

Rigid3d ParsePose(const json& entry) {
  if (!entry.contains("T_world_object")) {
    const auto center = entry.at("center").get<std::array<double, 3>>();
    const double yaw = entry.value("yaw", 0.0);
    return {Eigen::Quaterniond(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ())),
            {center[0], center[1], center[2]}};
  }
  return PoseFromJson(entry, "T_world_object");
}

Solid ParseSolid(const json& entry) {
  struct Primitive {
    SolidKind kind;
    std::array<double, 2> shape;
  };
  static const std::map<std::string, Primitive> kPrimitives = {
      {"cuboid", {SolidKind::kCuboid, {0.1, 0.1}}},
      {"cylinder", {SolidKind::kCylinder, {0.1, 1.0}}},
      {"ellipsoid", {SolidKind::kEllipsoid, {1.0, 1.0}}},
  };
  const auto name = entry.value("primitive", std::string("superquadric"));
  const auto found = kPrimitives.find(name);
  if (found == kPrimitives.end() && name != "superquadric") {
    throw InputError(
        fmt::format("primitive '{}', expected cuboid, cylinder, ellipsoid or superquadric", name));
  }
  Solid solid;
  const auto half_size = entry.at("half_size").get<std::array<double, 3>>();
  solid.half_size = {half_size[0], half_size[1], half_size[2]};
  if (!(solid.half_size.allFinite() && solid.half_size.minCoeff() > 0.0)) {
    throw InputError("expected three half sizes above 0");
  }
  const Primitive primitive =
      found != kPrimitives.end() ? found->second : Primitive{SolidKind::kSuperquadric, {}};
  solid.kind = primitive.kind;
  const auto shape = entry.contains("shape") || found == kPrimitives.end()
                         ? entry.at("shape").get<std::array<double, 2>>()
                         : primitive.shape;
  if (!(shape[0] > 0.0 && shape[0] <= 2.0 && shape[1] > 0.0 && shape[1] <= 2.0)) {
    throw InputError("expected shape exponents in (0, 2]");
  }
  solid.e1 = shape[0];
  solid.e2 = shape[1];
  if (std::abs(shape[0] - primitive.shape[0]) > 1e-6 || std::abs(shape[1] - primitive.shape[1]) > 1e-6) {
    solid.kind = SolidKind::kSuperquadric;
  }
  solid.T_map_object = ParsePose(entry);
  return solid;
}

struct ParsedObjects {
  std::vector<GroundTruthObject> objects;
  bool has_scored = false;
  bool has_detection_counts = false;
};

ParsedObjects ParseObjects(const std::filesystem::path& path) {
  json document;
  try {
    document = json::parse(ReadFile(path, "a list of ground-truth objects"));
  } catch (const json::exception& error) {
    throw InputError(fmt::format("{}: no valid JSON ({})", path.string(), error.what()));
  }
  const json list = document.is_object() && document.contains("objects") ? document["objects"] : document;
  if (!list.is_array()) {
    throw InputError(fmt::format("{}: expected a list of objects, or an object whose key 'objects' holds it",
                                 path.string()));
  }
  ParsedObjects parsed;
  for (const json& entry : list) {
    try {
      GroundTruthObject object;
      object.id = entry.at("id").get<int>();
      object.label = entry.at("label").get<std::string>();
      object.name = entry.value("name", std::string());
      object.solid = ParseSolid(entry);
      object.detections = entry.value("detector_boxes", 0);
      object.scored = entry.value("scored", false);
      parsed.has_scored = parsed.has_scored || entry.contains("scored");
      parsed.has_detection_counts = parsed.has_detection_counts || entry.contains("detector_boxes");
      parsed.objects.push_back(std::move(object));
    } catch (const std::exception& error) {
      throw InputError(fmt::format("{}: object {} of the list: {}", path.string(), parsed.objects.size() + 1,
                                   error.what()));
    }
  }
  if (!parsed.has_scored) {
    for (GroundTruthObject& object : parsed.objects) {
      object.scored = true;
    }
  }
  return parsed;
}

// Boxes of each object id in boxes.txt; empty where the boxes carry no ids.
std::map<int, int> CountBoxes(const std::filesystem::path& path) {
  std::map<int, int> counts;
  for (const TextLine& line : ReadTextLines(path, "boxes")) {
    if (line.words.size() >= 8) {
      const double id = NumberAt(path, line, 7, "timestamp label score x y w h object_id");
      ++counts[static_cast<int>(std::lround(id))];
    }
  }
  return counts;
}

}  // namespace

std::vector<GroundTruthObject> ReadGroundTruthObjects(const std::filesystem::path& path) {
  return ParseObjects(path).objects;
}

GroundTruth ReadGroundTruth(const std::filesystem::path& sequence) {
  GroundTruth truth;
  if (!std::filesystem::is_directory(sequence)) {
    throw InputError(
        fmt::format("{}: no such folder; expected a sequence with ground truth", sequence.string()));
  }
  // The times of groundtruth.txt are its own; those of a dataset's poses follow from the camera's fps.
  const SequenceFormat format = DetectFormat(sequence);
  if (format == SequenceFormat::kTum) {
    truth.trajectory = ReadTrajectory(sequence / "groundtruth.txt");
    truth.frames = static_cast<int>(ReadTextLines(sequence / "rgb.txt", "lines 'timestamp path'").size());
  } else if (format == SequenceFormat::kImages) {
    truth.trajectory = ReadTrajectory(sequence / "groundtruth.txt");
    truth.frames = static_cast<int>(ListColorImages(sequence).size());
    if (truth.frames == 0) {
      throw InputError(fmt::format("{}: neither rgb.txt nor images; expected the sequence that was mapped",
                                   sequence.string()));
    }
  } else {
    SequenceRequest request;
    request.path = sequence;
    const Sequence opened = OpenSequence(request);
    truth.trajectory = ReadGroundTruthPoses(opened);
    truth.frames = static_cast<int>(opened.frames.size());
  }
  const std::filesystem::path objects = sequence / "objects_gt.json";
  if (!std::filesystem::exists(objects)) {
    return truth;
  }
  ParsedObjects parsed = ParseObjects(objects);
  truth.has_objects = true;
  truth.has_scored = parsed.has_scored;
  truth.has_detection_counts = parsed.has_detection_counts;
  truth.objects = std::move(parsed.objects);
  const std::filesystem::path boxes = sequence / "boxes.txt";
  const std::map<int, int> counts = std::filesystem::exists(boxes) ? CountBoxes(boxes) : std::map<int, int>{};
  if (!counts.empty()) {
    truth.has_detection_counts = true;
    for (GroundTruthObject& object : truth.objects) {
      const auto count = counts.find(object.id);
      object.detections = count != counts.end() ? count->second : 0;
    }
  }
  return truth;
}

}  // namespace sqslam
