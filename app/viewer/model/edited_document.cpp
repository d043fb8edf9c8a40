#include "app/viewer/model/edited_document.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <set>
#include <system_error>

#include "slam/evaluation/evaluation.h"
#include "slam/evaluation/ground_truth.h"
#include "slam/evaluation/trajectory_error.h"
#include "slam/io/pose_json.h"
#include "slam/io/trajectory.h"
#include "slam/util/atomic_file.h"
#include "slam/util/json_file.h"
#include "slam/util/throw_if.h"
#include "slam/util/to_vector.h"

namespace sqslam::viewer {
namespace fs = std::filesystem;
namespace {

using Json = nlohmann::ordered_json;

// Keys that AnnotatedSolid holds itself; all others are kept as they are.
const std::set<std::string> kOwnKeys = {"id",  "label",          "name",      "primitive", "center",
                                        "yaw", "T_world_object", "half_size", "shape"};

std::string Others(const Json& entry, const std::set<std::string>& own) {
  Json others = Json::object();
  for (const auto& [key, value] : entry.items()) {
    if (!own.contains(key)) {
      others[key] = value;
    }
  }
  return others.empty() ? "" : others.dump();
}

// Rounds to 1e-9 and 12 digits, enough for a micrometre in a hall; 0.1 is written as "0.1".
double Rounded(double value) {
  const double rounded = std::round(value * 1e9) * 1e-9;
  return rounded == 0.0 ? 0.0 : std::stod(fmt::format("{:.12g}", rounded));
}

Json Numbers(const Eigen::Vector3d& v) { return {Rounded(v.x()), Rounded(v.y()), Rounded(v.z())}; }

Json ToJson(const AnnotatedSolid& annotated, const Sim3d& S_file_annotation) {
  const Solid solid = Transform(S_file_annotation, annotated.solid);
  Json entry = {{"id", annotated.id}};
  if (!annotated.name.empty()) {
    entry["name"] = annotated.name;
  }
  entry["label"] = annotated.label;
  entry["primitive"] = NameOf(solid.kind);
  entry["center"] = Numbers(solid.T_map_object.translation);
  entry["yaw"] = Rounded(YawOf(solid));
  entry["T_world_object"] =
      ToVector(RowsOf(solid.T_map_object.Matrix()), [](const auto& row) { return ToVector(row, Rounded); });
  entry["half_size"] = Numbers(solid.half_size);
  entry["shape"] = {solid.e1, solid.e2};
  if (!annotated.more.empty()) {
    entry.update(Json::parse(annotated.more));
  }
  return entry;
}

}  // namespace

Annotation ReadAnnotation(const fs::path& path, const Sim3d& S_file_annotation) {
  const std::vector<GroundTruthObject> objects = ReadGroundTruthObjects(path);  // reports errors
  const Json root = ReadJsonFile(path, "a list of ground-truth objects");
  const Json& list = root.is_object() ? root.at("objects") : root;
  Annotation annotation;
  if (root.is_object()) {
    annotation.more = Others(root, {"objects"});
  }
  const Sim3d S_annotation_file = S_file_annotation.Inverse();
  std::set<int> ids;
  for (std::size_t i = 0; i < objects.size(); ++i) {
    const GroundTruthObject& object = objects[i];
    ThrowIf<InputError>(!ids.insert(object.id).second,
                        "{}: object {} of the list: id {} is listed twice, expected each once", path.string(),
                        i + 1, object.id);
    annotation.solids.push_back({object.id, object.label, object.name,
                                 Transform(S_annotation_file, object.solid), Others(list.at(i), kOwnKeys)});
  }
  return annotation;
}

void WriteAnnotation(const fs::path& path, const Annotation& annotation, const Sim3d& S_file_annotation) {
  std::string list = "[\n";
  for (std::size_t i = 0; i < annotation.solids.size(); ++i) {
    list += ToJson(annotation.solids[i], S_file_annotation).dump() +
            (i + 1 < annotation.solids.size() ? ",\n" : "\n");
  }
  list += "]";
  if (annotation.more.empty()) {
    WriteFileAtomically(path, list + "\n");
    return;
  }
  std::string text = Json::parse(annotation.more).dump(1);
  text.resize(text.size() - 2);  // without "\n}"
  WriteFileAtomically(path, text + ",\n \"objects\": " + list + "\n}\n");
}

Sim3d AlignToGroundTruth(const fs::path& result, const fs::path& sequence) {
  const fs::path file = result / "trajectory.txt";
  const EvaluationOptions options;
  const std::optional<TrajectoryError> aligned = ComputeTrajectoryError(
      ReadTrajectory(file), ReadGroundTruth(sequence).trajectory, options.max_time_difference);
  ThrowIf<InputError>(!aligned,
                      "{}: cannot be aligned to the true poses of {}, expected three poses or more at the "
                      "same times, not on one line",
                      file.string(), sequence.string());
  return aligned->S_world_map;
}

namespace {

// Copies a file that was never read to FILE.bak.
void KeepUnread(const fs::path& file) {
  std::error_code error;
  if (fs::exists(file)) {
    fs::copy_file(file, file.string() + ".bak", fs::copy_options::overwrite_existing, error);
    if (error) {
      throw InputError("{}: cannot be copied to {}.bak ({}), expected a writable folder", file.string(),
                       file.filename().string(), error.message());
    }
  }
}

}  // namespace

void EditedDocument::OpenRecording(const fs::path& recording) {
  *this = EditedDocument();
  edits_file_ = EditsFileOf(recording);
  if (fs::exists(edits_file_)) {
    edits_unread_ = true;
    saved_.edits = ReadObjectEdits(edits_file_);
    edits_unread_ = false;
    history_ = EditHistory<EditedState>(saved_);
  }
}

void EditedDocument::OpenAnnotation(const fs::path& file, const Sim3d& S_file_annotation) {
  Annotation read = ReadAnnotation(file, S_file_annotation);
  annotation_file_ = file;
  saved_.annotation = read;
  Do("Open " + file.filename().string(), [&](EditedState& state) { state.annotation = std::move(read); });
}

void EditedDocument::SaveEdits() {
  if (edits_unread_) {
    KeepUnread(edits_file_);
    edits_unread_ = false;
  }
  if (Current().edits.Empty()) {
    std::error_code error;
    fs::remove(edits_file_, error);
    if (error) {
      throw InputError("{}: cannot be removed ({}), expected a writable folder", edits_file_.string(),
                       error.message());
    }
  } else {
    WriteObjectEdits(edits_file_, Current().edits);
  }
  saved_.edits = Current().edits;
}

void EditedDocument::SaveAnnotation(const fs::path& file, const Sim3d& S_file_annotation) {
  if (file != annotation_file_) {
    KeepUnread(file);
  }
  WriteAnnotation(file, Current().annotation, S_file_annotation);
  annotation_file_ = file;
  saved_.annotation = Current().annotation;
}

}  // namespace sqslam::viewer
