#include "app/result/map_input.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <spdlog/spdlog.h>

#include <algorithm>

#include "app/export/map_export.h"
#include "slam/evaluation/evaluation.h"
#include "slam/evaluation/ground_truth.h"
#include "slam/evaluation/object_matching.h"
#include "slam/evaluation/trajectory_error.h"
#include "slam/io/result_files.h"
#include "slam/snapshot/depth_recording.h"
#include "slam/util/data_path.h"
#include "slam/util/text_lines.h"
#include "slam/util/throw_if.h"
#include "slam/util/to_vector.h"

namespace sqslam::app {
namespace fs = std::filesystem;
namespace {

TruePath LayOver(const MapSnapshot& map, const Trajectory& truth, const fs::path& sequence) {
  const std::optional<TruePath> path = AlignTruePath(truth, map);
  if (!path) {
    throw InputError(TruePathError(sequence));
  }
  return *path;
}

}  // namespace

std::shared_ptr<const MapTruth> CompareWithTruth(const MapSnapshot& map, const Trajectory& truth,
                                                 const Sim3d& S_world_map, const fs::path& sequence) {
  const EvaluationOptions options;
  std::vector<SnapshotKeyframe> keyframes = map.keyframes;
  std::ranges::sort(keyframes, {}, &SnapshotKeyframe::timestamp);
  const Trajectory poses = ToVector(keyframes, [](const SnapshotKeyframe& keyframe) {
    return TimedPose{keyframe.timestamp, keyframe.T_map_camera};
  });
  auto compared = std::make_shared<MapTruth>();
  for (const auto& [mapped, pose] : AssociateByTime(poses, truth, options.max_time_difference)) {
    const Eigen::Vector3d p_world = S_world_map * poses[mapped].T_map_camera.translation;
    compared->camera_error[keyframes[mapped].id] = (p_world - truth[pose].T_map_camera.translation).norm();
  }
  if (const fs::path file = sequence / "objects_gt.json"; fs::exists(file)) {
    const std::vector<GroundTruthObject> objects = ReadGroundTruthObjects(file);
    for (const GroundTruthObject& object : objects) {
      compared->solids.push_back(S_world_map.Inverse() * object.solid.ToSuperquadric());
    }
    for (const SnapshotObject& object : map.objects) {
      compared->iou[object.id] = 0.0;
    }
    for (const ObjectMatch& match :
         MatchObjects(map.objects, objects, S_world_map, options.min_iou).matches) {
      compared->iou[map.objects[static_cast<std::size_t>(match.mapped)].id] = match.iou;
    }
  }
  return compared;
}

fs::path MapFile(const fs::path& map) { return ResultFile(map, "map.sqmap"); }

void AddObjectOptions(Command& command, ObjectArguments& a) {
  command.Option(
      "--edits FILE", a.edits,
      "FILE.json with edits of the objects (names, labels, hidden, deleted and merged ones), as saved by the "
      "viewer; auto: the file beside the map. Default: no edits");
  command.Flag("--reliable-only", a.reliable_only, "Omit uncertain objects");
  command.Option("--objects LIST", a.chosen,
                 "Only these objects: ids and labels with commas between them, such as 3,cup,potted_plant");
}

fs::path EditsFile(const fs::path& recording, const std::string& edits) {
  if (edits != "auto") {
    return edits;
  }
  const fs::path beside = EditsFileOf(recording);
  ThrowIf<InputError>(!fs::exists(beside), "--edits auto: {} does not exist, expected edits beside the map",
                      beside.string());
  return beside;
}

std::vector<std::string> OptionsOf(const fs::path& recording, const ObjectArguments& a) {
  std::vector<std::string> words;
  if (!a.edits.empty()) {
    words.push_back("--edits=" + AbsolutePath(EditsFile(recording, a.edits)).string());
  }
  if (a.reliable_only) {
    words.emplace_back("--reliable-only");
  }
  if (!a.chosen.empty()) {
    words.push_back("--objects=" + a.chosen);
  }
  return words;
}

namespace {

// Returns true if the word is the object's id, label or name, with blanks or underscores.
bool IsCalled(const SnapshotObject& object, const std::string& word) {
  const std::string readable = ReadableLabel(word);
  return word == std::to_string(object.id) || readable == ReadableLabel(object.label) ||
         readable == ReadableLabel(object.name);
}

// Throws UsageError if a word calls no object of the map.
void CheckChosen(const std::vector<std::string>& chosen, const MapSnapshot& map) {
  for (const std::string& word : chosen) {
    const bool known =
        std::ranges::any_of(map.objects, [&](const auto& object) { return IsCalled(object, word); });
    ThrowIf<UsageError>(
        !known, "--objects {}: no such object is left, expected ids and labels as sqslam info lists them",
        word);
  }
}

}  // namespace

RecordingReader OpenMap(const fs::path& recording, const ObjectArguments& a, HiddenObjects hidden) {
  const fs::path file = EditsFile(recording, a.edits);
  if (!a.Changes()) {
    return RecordingReader(recording);
  }
  const ObjectEdits read = file.empty() ? ObjectEdits() : ReadObjectEdits(file);
  const RecordingReader plain(recording);
  if (plain.Size() > 0) {
    const std::vector<int> unknown = UnknownIds(read, *plain.Last());
    if (!unknown.empty()) {
      spdlog::warn("{}: the map has no object {}: are these edits of another map?", file.string(),
                   fmt::join(unknown, ", "));
    }
  }
  const std::vector<std::string> chosen =
      a.chosen.empty() ? std::vector<std::string>() : Split(a.chosen, ',');
  const auto sift = [read, hidden, chosen, reliable_only = a.reliable_only](const MapSnapshotPtr& snapshot) {
    const MapSnapshotPtr edited = Apply(read, *snapshot, hidden);
    if (!reliable_only && chosen.empty()) {
      return edited;
    }
    auto sifted = std::make_shared<MapSnapshot>(*edited);
    std::erase_if(sifted->objects, [&](const SnapshotObject& object) {
      const auto calls = [&](const std::string& word) { return IsCalled(object, word); };
      return (reliable_only && !IsReliable(object)) ||
             (!chosen.empty() && std::ranges::none_of(chosen, calls));
    });
    return MapSnapshotPtr(std::move(sifted));
  };
  if (plain.Size() > 0) {
    CheckChosen(chosen, *sift(plain.Last()));
  }
  return RecordingReader(recording, sift);
}

std::string TruePathError(const fs::path& sequence) {
  return fmt::format(
      "{}: its true poses cannot be aligned with the map, expected at least three at the times of keyframes, "
      "not on one line",
      sequence.string());
}

PointCloud ReadDenseCloud(const fs::path& file) {
  PointCloud cloud = ReadPointCloud(file);
  ThrowIf<InputError>(cloud.points.empty(), "{}: holds no point with finite coordinates", file.string());
  if (cloud.skipped > 0) {
    spdlog::warn("{}: {} points without finite coordinates are left out", file.string(), cloud.skipped);
  }
  return cloud;
}

void AddLayerOptions(Command& command, LayerArguments& a) {
  command.Group("Layers");
  command.Option(
      "--ground-truth SEQUENCE", a.ground_truth,
      "Also draw the true camera path and objects of this sequence folder, aligned with the keyframes by a "
      "similarity, and colour the map by its errors; auto: of the sequence that was mapped");
  command.Option(
      "--dense-cloud FILE", a.dense_cloud,
      "Draw this cloud (.ply with x y z and optionally red green blue, or text with x y z) instead "
      "of that of sqslam densify; --set dense_cloud.show=false omits both");
  command
      .Option("--dense-cloud-frame NAME", a.dense_cloud_frame,
              "Frame of that cloud; world: that of the true poses of --ground-truth, by default of the "
              "sequence that was mapped")
      .OneOf({"map", "world"});
}

CloudLayerPtr PlaceCloud(const PointCloud& cloud, const Sim3d& S_map_file, const Eigen::Vector3d& color) {
  const Eigen::Vector3i plain = (255.0 * color).array().round().cast<int>();
  const std::vector<Eigen::Vector3f> points = ToVector(cloud.points, [&](const Eigen::Vector3d& p) {
    return Eigen::Vector3f((S_map_file * p).cast<float>());
  });
  const double spacing = SpacingOf(points);
  CloudLayerBuilder builder(0.5 * spacing);  // cubes small enough to merge almost no points
  std::vector<CloudLayerBuilder::Source> sources;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const std::array<std::uint8_t, 3> own =
        cloud.rgb.empty()
            ? std::array{static_cast<std::uint8_t>(plain[0]), static_cast<std::uint8_t>(plain[1]),
                         static_cast<std::uint8_t>(plain[2])}
            : cloud.rgb[i];
    sources.push_back({points[i], own, static_cast<float>(spacing)});
  }
  builder.Add(sources);
  return builder.Finish();
}

SurfaceMeshPtr ReadMesh(const fs::path& recording, bool growing) {
  const DepthRecording depths(recording);
  if (depths.Keyframes().empty()) {
    return nullptr;
  }
  SurfaceMesh mesh = *SurfaceOf(recording, 0, [](int, int, const std::string&) { return true; });
  if (growing) {
    MarkFirstSeen(depths, mesh);
  }
  return std::make_shared<const SurfaceMesh>(std::move(mesh));
}

SceneLayers ReadLayers(const LayerArguments& a, const RecordingReader& reader, const fs::path& recording,
                       const SceneStyle& style, bool growing) {
  const fs::path sequence = reader.Info().sequence_path;
  SceneLayers layers;
  const bool in_world = !a.dense_cloud.empty() && a.dense_cloud_frame == "world";
  Sim3d S_map_file;
  if (!a.ground_truth.empty() || in_world) {
    const bool own = a.ground_truth.empty() || a.ground_truth == "auto";
    ThrowIf<UsageError>(own && sequence.empty(),
                        "the map does not say what was mapped, expected --ground-truth SEQUENCE");
    const fs::path folder = own ? sequence : fs::path(a.ground_truth);
    const Trajectory truth = ReadTruePoses(folder);
    const TruePath path = LayOver(*reader.Last(), truth, folder);
    if (!a.ground_truth.empty()) {
      layers.true_path = path.pieces;
      layers.truth = CompareWithTruth(*reader.Last(), truth, path.S_world_map, folder);
    }
    S_map_file = in_world ? path.S_world_map.Inverse() : Sim3d();
  }
  const bool own = a.dense_cloud.empty();
  if (style.dense_cloud.show && own && style.dense_cloud.look == DenseLook::kMesh) {
    layers.dense_mesh = ReadMesh(recording, growing);
    if (!layers.dense_mesh) {
      spdlog::warn("{}: holds no dense surface, the picture shows the sparse map; run sqslam densify first",
                   recording.string());
    }
  } else if (style.dense_cloud.show) {
    layers.dense_cloud =
        own ? ReadCloudLayer(recording)
            : PlaceCloud(ReadDenseCloud(a.dense_cloud), S_map_file, ParseColor(style.dense_cloud.color));
  }
  return layers;
}

}  // namespace sqslam::app
