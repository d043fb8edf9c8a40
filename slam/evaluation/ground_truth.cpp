#include "slam/evaluation/ground_truth.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <regex>
#include <sstream>

#include "slam/io/cameras.h"
#include "slam/io/dataset_layouts.h"
#include "slam/io/image_files.h"
#include "slam/io/pose_json.h"
#include "slam/io/sequence.h"
#include "slam/io/time_unit.h"
#include "slam/util/enum_names.h"
#include "slam/util/json_file.h"
#include "slam/util/text_table.h"
#include "slam/util/throw_if.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace fs = std::filesystem;
namespace {

using json = nlohmann::ordered_json;

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
  const auto name = entry.value("primitive", std::string("superquadric"));
  const std::optional<SolidKind> kind = FromName<SolidKind>(name);
  ThrowIf<InputError>(!kind, "primitive '{}', expected cuboid, cylinder, ellipsoid or superquadric", name);
  Solid solid;
  solid.half_size = Eigen::Vector3d(entry.at("half_size").get<std::array<double, 3>>().data());
  if (!(solid.half_size.allFinite() && solid.half_size.minCoeff() > 0.0)) {
    throw InputError("expected three half sizes above 0");
  }
  SetKind(solid, *kind);
  if (entry.contains("shape") || kind == SolidKind::kSuperquadric) {
    const auto [e1, e2] = entry.at("shape").get<std::array<double, 2>>();
    if (!(e1 > 0.0 && e1 <= 2.0 && e2 > 0.0 && e2 <= 2.0)) {
      throw InputError("expected shape exponents in (0, 2]");
    }
    if (std::abs(e1 - solid.e1) > 1e-6 || std::abs(e2 - solid.e2) > 1e-6) {
      solid.kind = SolidKind::kSuperquadric;
    }
    solid.e1 = e1;
    solid.e2 = e2;
  }
  solid.T_map_object = ParsePose(entry);
  return solid;
}

// Reads the objects of the file into `truth`.
void ParseObjects(const fs::path& path, GroundTruth& truth) {
  const json document = ReadJsonFile(path, "a list of ground-truth objects");
  const json list = document.is_object() && document.contains("objects") ? document.at("objects") : document;
  ThrowIf<InputError>(!list.is_array(),
                      "{}: expected a list of objects, or an object whose key 'objects' holds it",
                      path.string());
  truth.has_objects = true;
  for (const json& entry : list) {
    try {
      GroundTruthObject object;
      object.id = entry.at("id").get<int>();
      object.label = ValidLabel(entry.at("label").get<std::string>());
      object.name = ValidLabel(entry.value("name", std::string()));
      object.solid = ParseSolid(entry);
      object.detections = entry.value("detector_boxes", 0);
      object.scored = entry.value("scored", false);
      truth.has_scored = truth.has_scored || entry.contains("scored");
      truth.has_detection_counts = truth.has_detection_counts || entry.contains("detector_boxes");
      truth.objects.push_back(std::move(object));
    } catch (const std::exception& error) {
      throw InputError("{}: object {} of the list: {}", path.string(), truth.objects.size() + 1,
                       error.what());
    }
  }
  if (!truth.has_scored) {
    for (GroundTruthObject& object : truth.objects) {
      object.scored = true;
    }
  }
}

// Counts the boxes of each object id in boxes.txt; empty if the boxes have no ids.
std::map<int, int> CountBoxes(const fs::path& path) {
  std::map<int, int> counts;
  for (const TextLine& line : ReadTextLines(path, "boxes")) {
    if (line.words.size() >= 8) {
      const double id = NumberAt(path, line, 7, "timestamp label score x y w h object_id");
      ++counts[static_cast<int>(std::lround(id))];
    }
  }
  return counts;
}

// Returns the only file of a folder whose name matches the pattern.
fs::path OnlyFileLike(const fs::path& folder, const char* pattern, const std::string& expected) {
  const std::vector<fs::path> files = FilesLike(folder, std::regex(pattern));
  ThrowIf<InputError>(files.size() != 1, "{}: {} files of ground-truth poses, expected {}", folder.string(),
                      files.empty() ? "no" : std::to_string(files.size()), expected);
  return files.front();
}

Eigen::Quaterniond UnitQuaternion(const fs::path& path, const TextLine& line, const Eigen::Quaterniond& q,
                                  const char* expected) {
  if (std::abs(q.norm() - 1.0) > 0.01) {
    ThrowBadLine(path, line, expected);
  }
  return q.normalized();
}

// Reads four rows of four numbers.
Rigid3d ReadMatrix(const fs::path& path) {
  constexpr const char* kExpected = "four rows of four numbers, the camera's pose in the world";
  // The poses of a depth tracker are accumulated products, so they are not exactly orthonormal.
  constexpr double kTolerance = 0.01;
  const std::vector<TextLine> lines = ReadTextLines(path, kExpected);
  ThrowIf<InputError>(lines.size() != 4, "{}: {} lines, expected {}", path.string(), lines.size(), kExpected);
  Eigen::Matrix4d matrix;
  for (std::size_t i = 0; i < 4; ++i) {
    matrix.row(static_cast<int>(i)) = Eigen::RowVector4d::Map(NumbersIn<4>(path, lines[i], kExpected).data());
  }
  const Eigen::Matrix3d rotation = matrix.topLeftCorner<3, 3>();
  ThrowIf<InputError>(!(rotation.transpose() * rotation - Eigen::Matrix3d::Identity()).isZero(kTolerance) ||
                          rotation.determinant() < 0.0,
                      "{}: its upper left 3x3 part is not a rotation, expected {}", path.string(), kExpected);
  if (!(matrix.row(3) - Eigen::RowVector4d(0.0, 0.0, 0.0, 1.0)).isZero(1e-6)) {
    ThrowBadLine(path, lines[3], "the row 0 0 0 1");
  }
  return {Eigen::Quaterniond(rotation).normalized(), matrix.topRightCorner<3, 1>()};
}

Trajectory Read7Scenes(const fs::path& folder, double fps) {
  Trajectory trajectory;
  for (const fs::path& file : FilesLike(folder, std::regex(R"(frame-\d+\.pose\.txt)"))) {
    const auto number = LastNumber(file.filename().string());
    ThrowIf<InputError>(!number, "{}: its number is too large, expected a frame number", file.string());
    trajectory.push_back({static_cast<double>(*number) / fps, ReadMatrix(file)});
  }
  ThrowIf<InputError>(
      trajectory.empty(),
      "{}: no ground-truth pose in it, expected groundtruth.txt or names like frame-000000.pose.txt",
      folder.string());
  return trajectory;
}

// Returns pc/NN.pose, where the dataset keeps the poses of imgs/scene_NN; otherwise the one in the folder.
fs::path ScenesV2File(const fs::path& folder) {
  const fs::path scene = (folder / "").lexically_normal().parent_path();
  std::smatch match;
  const std::string name = scene.filename().string();
  if (std::regex_match(name, match, std::regex(R"(scene_(\d+))"))) {
    const fs::path file = scene.parent_path().parent_path() / "pc" / (match[1].str() + ".pose");
    if (fs::exists(file)) {
      return file;
    }
    return OnlyFileLike(folder, R"(.*\.pose)", fmt::format("{}, or a single *.pose here", file.string()));
  }
  return OnlyFileLike(folder, R"(.*\.pose)", "a single *.pose, or pc/NN.pose beside imgs/scene_NN");
}

Trajectory ReadScenesV2(const fs::path& path, double fps) {
  constexpr const char* kExpected = "'qw qx qy qz x y z'";
  Trajectory trajectory;
  for (const TextLine& line : ReadTextLines(path, "lines 'qw qx qy qz x y z', one a frame")) {
    const std::array<double, 7> v = NumbersIn<7>(path, line, kExpected);
    const Eigen::Quaterniond rotation =
        UnitQuaternion(path, line, {v[0], v[1], v[2], v[3]}, "a quaternion qw qx qy qz of length 1");
    trajectory.push_back({static_cast<double>(trajectory.size()) / fps, {rotation, {v[4], v[5], v[6]}}});
  }
  return trajectory;
}

// `camera`: mav0/cam0. The poses are those of the body, in mav0/state_groundtruth_estimate0.
Trajectory ReadEuroc(const fs::path& camera) {
  constexpr const char* kExpected = "'timestamp in ns,x,y,z,qw,qx,qy,qz,...', the body's pose";
  const fs::path path = camera.parent_path() / "state_groundtruth_estimate0" / "data.csv";
  const TextTable table = ReadTextTable(path, kExpected);
  const Rigid3d T_body_camera = ReadEurocExtrinsics(camera / "sensor.yaml");
  Trajectory trajectory;
  for (const TextLine& line : table.rows) {
    std::array<double, 8> v{};
    for (std::size_t i = 0; i < v.size(); ++i) {
      v[i] = NumberAt(path, line, i, kExpected);
    }
    const Eigen::Quaterniond rotation =
        UnitQuaternion(path, line, {v[4], v[5], v[6], v[7]}, "a quaternion qw,qx,qy,qz of length 1");
    trajectory.push_back({1e-9 * v[0], Rigid3d{rotation, {v[1], v[2], v[3]}} * T_body_camera});
  }
  return trajectory;
}

// Reads poses/NN.txt, where the dataset keeps the poses of sequences/NN: one line a frame, the first three
// rows of the pose of camera 0.
Trajectory ReadKitti(const Sequence& sequence) {
  constexpr const char* kExpected = "the 12 numbers of a pose, one line a frame";
  const fs::path folder = (sequence.path / "").lexically_normal().parent_path();
  const fs::path path = folder.parent_path().parent_path() / "poses" / (folder.filename().string() + ".txt");
  const std::vector<TextLine> lines = ReadTextLines(path, kExpected);
  if (lines.size() != sequence.frames.size()) {
    throw InputError("{}: {} lines for {} frames, expected {}", path.string(), lines.size(),
                     sequence.frames.size(), kExpected);
  }
  const fs::path images = sequence.frames.front().image_path.parent_path();
  const Rigid3d T_camera0_camera = ReadKittiExtrinsics(
      folder / "calib.txt", static_cast<int>(LastNumber(images.filename().string()).value_or(0)));
  Trajectory trajectory;
  for (const TextLine& line : lines) {
    const Eigen::Matrix<double, 3, 4, Eigen::RowMajor> rows(NumbersIn<12>(path, line, kExpected).data());
    const Eigen::Matrix3d rotation = rows.leftCols<3>();
    if (!(rotation.transpose() * rotation).isIdentity(0.01) || rotation.determinant() < 0.0) {
      ThrowBadLine(path, line, "a pose whose first three columns are a rotation");
    }
    trajectory.push_back(
        {sequence.frames[trajectory.size()].timestamp,
         Rigid3d{Eigen::Quaterniond(rotation).normalized(), rows.col(3)} * T_camera0_camera});
  }
  return trajectory;
}

// Reads groundtruth.txt, whose times may be in another unit than seconds.
Trajectory ReadTimedPoses(const fs::path& path, double fps) {
  Trajectory trajectory = ReadTrajectory(path);
  const std::vector<TextLine> rows = ReadTextTable(path, "poses").rows;
  const bool whole = std::ranges::all_of(
      rows, [](const TextLine& row) { return ParseNumber<std::int64_t>(row.words.front()).has_value(); });
  const TimeUnit unit = UnitOfTimes(ToVector(trajectory, &TimedPose::timestamp), whole, fps);
  ReportTimeUnit(path.string(), unit);
  for (TimedPose& pose : trajectory) {
    pose.timestamp *= unit.seconds;
  }
  return trajectory;
}

// Returns the rate of camera.yaml, or the usual one without it.
double FpsOf(const fs::path& folder) {
  const fs::path camera = folder / "camera.yaml";
  const auto any_size = [] { return cv::Size(640, 480); };  // it has no influence
  return fs::exists(camera) ? ReadCamera(camera, any_size).fps : Camera().fps;
}

Trajectory ReadIclNuim(const fs::path& path, double fps) {
  Trajectory trajectory = ReadTrajectory(path);
  for (TimedPose& pose : trajectory) {
    ThrowIf<InputError>(
        pose.timestamp != std::floor(pose.timestamp) || pose.timestamp < 0.0,
        "{}: the time {}, expected frame numbers as times (lines in seconds are read from groundtruth.txt)",
        path.string(), pose.timestamp);
    pose = {pose.timestamp / fps, MirrorIclNuim(pose.T_map_camera)};
  }
  return trajectory;
}

}  // namespace

std::vector<GroundTruthObject> ReadGroundTruthObjects(const fs::path& path) {
  GroundTruth truth;
  ParseObjects(path, truth);
  return truth.objects;
}

GroundTruth ReadGroundTruth(const fs::path& sequence) {
  GroundTruth truth;
  ThrowIf<InputError>(!fs::is_directory(sequence),
                      "{}: no such folder; expected a sequence with ground truth", sequence.string());
  // groundtruth.txt has its own times; those of a dataset's poses follow from the camera's fps.
  const SequenceFormat format = DetectFormat(sequence);
  if (format == SequenceFormat::kTum) {
    truth.trajectory = ReadTimedPoses(sequence / "groundtruth.txt", FpsOf(sequence));
    truth.frames = static_cast<int>(ListDataset(format, sequence, FpsOf(sequence)).size());
  } else if (format == SequenceFormat::kImages) {
    truth.trajectory = ReadTimedPoses(sequence / "groundtruth.txt", FpsOf(sequence));
    truth.frames = static_cast<int>(ListColorImages(sequence).size());
    ThrowIf<InputError>(truth.frames == 0,
                        "{}: neither rgb.txt nor images; expected the sequence that was mapped",
                        sequence.string());
  } else {
    const Sequence opened = OpenSequence({.path = sequence});
    truth.trajectory = ReadGroundTruthPoses(opened);
    truth.frames = static_cast<int>(opened.frames.size());
  }
  const fs::path objects = sequence / "objects_gt.json";
  if (!fs::exists(objects)) {
    return truth;
  }
  ParseObjects(objects, truth);
  const fs::path boxes = sequence / "boxes.txt";
  std::map<int, int> counts = fs::exists(boxes) ? CountBoxes(boxes) : std::map<int, int>{};
  if (!counts.empty()) {
    truth.has_detection_counts = true;
    for (GroundTruthObject& object : truth.objects) {
      object.detections = counts[object.id];
    }
  }
  return truth;
}

Rigid3d MirrorIclNuim(const Rigid3d& published) {
  const Eigen::Quaterniond& q = published.rotation;
  const Eigen::Vector3d& t = published.translation;
  return {Eigen::Quaterniond(q.w(), -q.x(), q.y(), -q.z()), {t.x(), -t.y(), t.z()}};
}

Trajectory ReadGroundTruthPoses(const Sequence& sequence) {
  const fs::path& folder = sequence.path;
  const double fps = sequence.camera.fps;
  if (fs::exists(folder / "groundtruth.txt")) {
    return ReadTimedPoses(folder / "groundtruth.txt", fps);
  }
  switch (sequence.format) {
    case SequenceFormat::k7Scenes:
      return Read7Scenes(folder, fps);
    case SequenceFormat::kScenesV2:
      return ReadScenesV2(ScenesV2File(folder), fps);
    case SequenceFormat::kIclNuim:
      return ReadIclNuim(
          OnlyFileLike(folder, R"(.*\.gt\.freiburg)", "groundtruth.txt or a single *.gt.freiburg"), fps);
    case SequenceFormat::kEuroc:
      return ReadEuroc(sequence.frames.front().image_path.parent_path().parent_path());
    case SequenceFormat::kKitti:
      return ReadKitti(sequence);
    default:
      return ReadTimedPoses(folder / "groundtruth.txt", fps);  // throws that it is missing
  }
}

Trajectory ReadTruePoses(const fs::path& sequence) {
  return ReadGroundTruthPoses(OpenSequence({.path = sequence}));
}

}  // namespace sqslam
