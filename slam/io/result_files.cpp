#include "slam/io/result_files.h"

#include <fmt/format.h>

#include <array>
#include <bit>
#include <nlohmann/json.hpp>

#include "slam/io/pose_json.h"
#include "slam/snapshot/byte_archive.h"
#include "slam/snapshot/object_parts.h"
#include "slam/util/atomic_file.h"
#include "slam/util/enum_names.h"
#include "slam/util/json_file.h"
#include "slam/util/text_lines.h"
#include "slam/util/throw_if.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;  // keeps the order of the contract
namespace {

static_assert(std::endian::native == std::endian::little,
              "binary files are written in the machine's byte order");

Json ToJson(const ObjectFit& fit) {
  const Eigen::Matrix<double, 9, 1> sigma = fit.covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
  return {{"box_agreement", fit.box_agreement},
          {"point_rms", fit.point_rms},
          {"sigma",
           {{"center", {sigma[0], sigma[1], sigma[2]}},
            {"half_size", {sigma[3], sigma[4], sigma[5]}},
            {"yaw", sigma[6]},
            {"shape", {sigma[7], sigma[8]}}}}};
}

Json ToJson(const SnapshotObject& object) {
  const Superquadric& shape = object.superquadric.shape;
  const Rigid3d& pose = object.superquadric.T_map_object;
  Json json = {{"id", object.id},
               {"label", object.label},
               {"score", object.score},
               {"observations", object.observations},
               {"center", pose.translation},
               {"yaw", object.yaw},
               {"T_map_object", RowsOf(pose.Matrix())},
               {"half_size", shape.half_size},
               {"shape", {shape.e1, shape.e2}},
               {"points", object.points},
               {"reliability", object.fit.reliability},
               {"uncertain", !IsReliable(object)},
               {"fit", ToJson(object.fit)}};
  if (!object.name.empty()) {
    json["name"] = object.name;
  }
  if (!object.parts.empty()) {
    json["parts"] = PartsToJson(object.parts);
  }
  return json;
}

SnapshotObject ObjectFromJson(const Json& json) {
  SnapshotObject object;
  object.id = json.at("id");
  object.label = ValidLabel(json.at("label").get<std::string>());
  object.name = ValidLabel(json.value("name", ""));
  object.score = json.value("score", 0.0);
  object.observations = json.value("observations", 0);
  object.points = json.value("points", 0);
  object.yaw = json.value("yaw", 0.0);
  object.fit.reliability = json.value("reliability", 1.0);
  object.superquadric.T_map_object = PoseFromJson(json, "T_map_object");
  Superquadric& shape = object.superquadric.shape;
  shape.half_size = Eigen::Vector3d(json.at("half_size").get<std::array<double, 3>>().data());
  if (json.contains("fit")) {
    object.fit.box_agreement = json.at("fit").value("box_agreement", 0.0);
    object.fit.point_rms = json.at("fit").value("point_rms", 0.0);
  }
  if (json.contains("parts")) {
    object.parts = PartsFromJson(json.at("parts"));
  }
  shape.e1 = json.at("shape").at(0);
  shape.e2 = json.at("shape").at(1);
  if (!(shape.half_size.minCoeff() > 0.0) || !shape.half_size.allFinite()) {
    throw InputError("half_size must be above 0");
  }
  return object;
}

Json ToJson(const ClassAccount& account) {
  Json left_out = Json::object();
  for (std::size_t i = 0; i < kLeftOutReasons; ++i) {
    left_out[NameOf(static_cast<LeftOut>(i))] = account.left_out[i];
  }
  return {{"boxes", account.boxes},   {"ignored", account.ignored}, {"used", account.used},
          {"merged", account.merged}, {"objects", account.shown},   {"left_out", left_out}};
}

ClassAccount ClassAccountFromJson(const Json& json) {
  ClassAccount account;
  account.boxes = json.at("boxes");
  account.ignored = json.at("ignored");
  account.used = json.at("used");
  account.merged = json.at("merged");
  account.shown = json.at("objects");
  for (std::size_t i = 0; i < kLeftOutReasons; ++i) {
    account.left_out[i] = json.at("left_out").value(NameOf(static_cast<LeftOut>(i)), 0);
  }
  return account;
}

// Calls visit(name, value) for each entry of stats.json, in order.
template <typename Stats, typename Visit>
void VisitStats(Stats& stats, Visit&& visit) {
  visit("frames", stats.frames);
  visit("skipped", stats.skipped);
  visit("dropped", stats.dropped);
  visit("detector_frames", stats.detector_frames);
  visit("tracked", stats.tracked);
  visit("keyframes", stats.keyframes);
  visit("points", stats.points);
  visit("objects", stats.objects);
  visit("uncertain", stats.uncertain);
  for (const auto& [name, counter] : kRunCounters) {
    visit(name, stats.counters.*counter);
  }
  visit("submaps", stats.submaps);
  visit("interrupted", stats.interrupted);
  visit("wall_seconds", stats.wall_seconds);
  visit("peak_memory_mib", stats.peak_memory_mib);
  visit("version", stats.version);
  visit("host", stats.host);
  visit("job", stats.job);
  visit("command", stats.command);
  visit("camera", stats.camera);
  visit("detector", stats.detector);
  visit("warnings", stats.warnings);
}

}  // namespace

void WritePoints(const fs::path& path, const std::vector<SnapshotPoint>& points, const MapFrame& frame) {
  const std::string header = fmt::format(
      "ply\nformat binary_little_endian 1.0\ncomment {}; object_id -1: no object\n"
      "element vertex {}\nproperty float x\nproperty float y\nproperty float z\n"
      "property uchar red\nproperty uchar green\nproperty uchar blue\nproperty int object_id\nend_header\n",
      frame.Text(), points.size());
  ByteWriter body;
  for (const SnapshotPoint& point : points) {
    body(point.p_map, point.rgb, point.object_id);
  }
  WriteFileAtomically(path, header + body.Take());
}

void WriteObjects(const fs::path& path, const std::vector<SnapshotObject>& objects,
                  const std::optional<MapFrame>& frame) {
  Json root = {{"format", "sqslam-objects"}, {"version", 1}};
  if (frame) {
    root["unit"] = frame->Unit();
    root["frame"] = "map";
    root["gravity_aligned"] = frame->upright;
  }
  root["objects"] = ToVector(objects, [](const SnapshotObject& object) { return ToJson(object); });
  WriteJsonFile(path, root);
}

std::vector<SnapshotObject> ReadObjects(const fs::path& path) {
  const Json root = ReadJsonFile(path, "an objects.json");
  ThrowIf<InputError>(
      !root.is_object() || root.value("format", Json()) != "sqslam-objects" || !root.contains("objects"),
      "{}: expected \"format\": \"sqslam-objects\" and \"objects\"", path.string());
  if (const Json version = root.value("version", Json()); version != 1) {
    throw InputError("{}: version {}, expected 1", path.string(), JsonText(version));
  }
  std::vector<SnapshotObject> objects;
  for (const Json& json : root.at("objects")) {
    try {
      objects.push_back(ObjectFromJson(json));
    } catch (const std::exception& e) {
      throw InputError("{}: object number {} (from 0): {}", path.string(), objects.size(), e.what());
    }
  }
  return objects;
}

void WriteStats(const fs::path& path, const RunStats& stats) {
  Json root = Json::object();
  VisitStats(stats, [&root](const char* name, const auto& value) { root[name] = value; });
  Json& classes = root["classes"] = Json::object();
  for (const auto& [label, account] : stats.classes) {
    classes[label] = ToJson(account);
  }
  Json& timing = root["timing_ms"] = Json::object();
  for (const auto& [stage, summary] : stats.timing_ms) {
    timing[stage] = {{"mean", summary.mean},
                     {"median", summary.median},
                     {"p95", summary.p95},
                     {"max", summary.max},
                     {"count", summary.count}};
  }
  WriteJsonFile(path, root);
}

RunStats ReadStats(const fs::path& path) {
  const Json root = ReadJsonFile(path, "a stats.json");
  try {
    RunStats stats;
    VisitStats(stats, [&root](const char* name, auto& value) { value = root.value(name, value); });
    const Json classes = root.value("classes", Json::object());
    for (const auto& [label, json] : classes.items()) {
      stats.classes[ValidLabel(label)] = ClassAccountFromJson(json);
    }
    for (const auto& [stage, json] : root.at("timing_ms").items()) {
      stats.timing_ms[stage] = {json.at("mean"), json.at("median"), json.at("p95"), json.at("max"),
                                json.at("count")};
    }
    return stats;
  } catch (const nlohmann::json::exception& e) {
    throw InputError("{}: {}", path.string(), e.what());
  }
}

}  // namespace sqslam
