#include "tests/fuzz/fuzz_targets.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <sstream>
#include <stdexcept>
#include <vector>

#include "app/experiment/config.h"
#include "app/viewer/model/edited_document.h"
#include "render/scene/style.h"
#include "render/synthetic/scene_description.h"
#include "render/video/video.h"
#include "slam/dense/dense_cloud.h"
#include "slam/detection/detector.h"
#include "slam/evaluation/ground_truth.h"
#include "slam/io/cameras.h"
#include "slam/io/detections.h"
#include "slam/io/point_cloud.h"
#include "slam/io/result_files.h"
#include "slam/io/sequence.h"
#include "slam/io/trajectory.h"
#include "slam/objects/object_class.h"
#include "slam/recognition/vocabulary.h"
#include "slam/snapshot/byte_archive.h"
#include "slam/snapshot/depth_recording.h"
#include "slam/snapshot/object_edits.h"
#include "slam/snapshot/recording.h"
#include "slam/snapshot/snapshot_codec.h"
#include "slam/system_options.h"
#include "slam/util/options.h"
#include "slam/util/text_lines.h"
#include "tests/io/temporary_folder.h"
#include "tests/recognition/random_descriptors.h"

namespace sqslam::testing {
namespace {

namespace fs = std::filesystem;

const Camera kCamera{64, 48, 50.0, 50.0, 32.0, 24.0};

std::string FileOfProject(const char* name) {
  return ReadFile(fs::path(SQSLAM_SOURCE_DIR) / name, "a file of the project");
}

std::string FirstLines(const char* name, int count) {
  std::istringstream file(FileOfProject(name));
  std::string lines;
  for (std::string line; count > 0 && std::getline(file, line); --count) {
    lines += line + '\n';
  }
  return lines;
}

// The bytes that `write` puts into the file it is given.
std::string Written(const std::string& name, const std::function<void(const fs::path& file)>& write) {
  const TemporaryFolder folder;
  write(folder.Path() / name);
  return ReadFile(folder.Path() / name, "a seed");
}

SnapshotObject Cup() {
  SnapshotObject cup;
  cup.id = 3;
  cup.label = "cup";
  cup.observations = 7;
  cup.superquadric.shape.half_size = {0.04, 0.04, 0.05};
  return cup;
}

MapSnapshot SmallMap() {
  MapSnapshot map;
  map.camera = kCamera;
  map.image_path = "a.png";
  map.T_map_camera = Rigid3d();
  map.keyframes.resize(2);
  map.keyframes[1].id = 1;
  map.points.resize(5);
  map.objects = {Cup()};
  map.detections = {{{"cup", 0.5, {1, 2, 3, 4}}, 3}};
  map.support_height = 0.1;
  map.covisibility = {{0, 1, 20}};
  return map;
}

std::string SmallScene() {
  return R"(name: desk
frames: 24
camera: {width: 64, height: 48, fx: 52.5, fy: 52.5, cx: 31.9, cy: 23.9, fps: 30}
motion:
  tremor_position: 0.002
  waypoints:
    - {position: [-1.2, -0.3, 1.2], look_at: [-0.3, 0, 0.7]}
    - {position: [-1.1, -0.5, 1.2], look_at: [-0.1, 0, 0.7]}
ambient: [0.2, 0.2, 0.3]
lights: [{center: [0.4, -0.5, 2.4], half_u: [0, 0.4, 0], half_v: [0.4, 0, 0], rgb: [4.4, 4.1, 3.6]}]
objects:
  - {id: 3, label: cup, half_size: [0.04, 0.04, 0.05], shape: [0.1, 1], center: [-0.2, -0.1, 0], base: 0.74, yaw: 30,
     texture: {pattern: ceramic, seed: 3, title: "", colors: [[232, 226, 214], [80, 134, 92]]}}
furniture:
  - {half_size: [0.9, 0.4, 0.02], shape: [0.1, 0.1], center: [0, 0, 0.7], yaw: 0,
     texture: {pattern: wood, seed: 31, title: "", colors: [[176, 128, 84], [112, 74, 44]]}}
panels:
  - {corner: [-0.8, -0.4, 0.74], u: [1.7, 0, 0], v: [0, 0.9, 0], shading_step: 0.1,
     texture: {pattern: wood, seed: 101, title: "", colors: [[186, 140, 96], [120, 82, 52]]}}
)";
}

std::string Photograph() {
  std::vector<unsigned char> jpeg;
  cv::imencode(".jpg", cv::Mat(16, 16, CV_8UC3, cv::Scalar::all(99)), jpeg);
  // Exif of one entry: the focal length for 35 mm film, 26 mm.
  static constexpr unsigned char kExif[] = {0xFF, 0xE1, 0, 46, 'E', 'x', 'i',  'f',  0, 0, 'I',  'I',  '*', 0,
                                            8,    0,    0, 0,  1,   0,   0x69, 0x87, 4, 0, 1,    0,    0,   0,
                                            26,   0,    0, 0,  0,   0,   0,    0,    1, 0, 0x05, 0xA4, 3,   0,
                                            1,    0,    0, 0,  26,  0,   0,    0,    0, 0, 0,    0};
  std::string bytes(jpeg.begin(), jpeg.end());
  bytes.insert(2, reinterpret_cast<const char*>(kExif), sizeof(kExif));
  bytes[5] = static_cast<char>(sizeof(kExif) - 2);
  return bytes;
}

std::string DensifiedRecording() {
  return Written("map.sqmap", [](const fs::path& file) {
    RecordingWriter writer(file, {"sequence", "1.0", ""});
    writer.Add(SmallMap());
    writer.Close();
    DepthRecording depths(file, DepthRecording::Access::kWrite);
    DepthMap map;
    map.camera = {16, 16, 12.0, 12.0, 8.0, 8.0};
    map.depth = cv::Mat(16, 16, CV_32FC1, cv::Scalar(1.5));
    map.views = cv::Mat(16, 16, CV_8UC1, cv::Scalar(2));
    map.bgr = cv::Mat(16, 16, CV_8UC3, cv::Scalar::all(80));
    depths.PutEstimate(map, "settings");
    depths.PutKept(map);
    depths.Close();
  });
}

// Reads a network whose weights nobody opens.
void ReadNetwork(const fs::path& file) {
  if (const fs::path weights = file.parent_path() / "yolox_nano.onnx"; !fs::exists(weights)) {
    std::ofstream(weights) << "weights";
  }
  LoadNetwork(file.string());
}

void ReadBoxes(const fs::path& file) { ReadDetections(file, {{64, 48}}, {0.0, 0.033, 0.067, 0.1}); }

void ReadRecording(const fs::path& file) {
  const RecordingReader reader(file);
  for (int i = 0; i < std::min(reader.Size(), 20); ++i) {
    reader.FrameIndex(i);
    reader.Read(i);
  }
  const DepthRecording depths(file);
  for (const std::int64_t keyframe : depths.Keyframes()) {
    depths.Kept(keyframe);
  }
  for (const std::int64_t keyframe : depths.Estimated()) {
    depths.Estimate(keyframe);
  }
}

// Reads the poses of a sequence of one frame, whose image nobody opens.
void ReadTruth(const fs::path& file) {
  if (const fs::path images = file.parent_path() / "rgb.txt"; !fs::exists(images)) {
    std::ofstream(images) << "0.0 groundtruth.txt\n";
  }
  ReadGroundTruth(file.parent_path());
}

constexpr std::array kTargets{
    FuzzTarget{"annotation", "objects_gt.json", [](const fs::path& file) { viewer::ReadAnnotation(file); },
               [] {
                 return std::string(
                     R"({"up_world": [0, 0, 1], "objects": [{"id": 1, "label": "cup", "primitive": "cylinder",
 "yaw": 0.1, "center": [1, 2, 3], "half_size": [0.04, 0.04, 0.05], "shape": [0.1, 1.0],
 "T_world_object": [[1, 0, 0, 1], [0, 1, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1]]}]})");
               }},
    FuzzTarget{"boxes", "boxes.txt", ReadBoxes,
               [] {
                 return std::string(
                     "# timestamp label score x y w h\n0.000 cup 0.7 10 12 20 22\n0.033 tv 1 1 2 60 40\n");
               }},
    FuzzTarget{
        "boxes_coco", "boxes.json", ReadBoxes,
        [] {
          return std::string(
              R"({"images": [{"id": 7, "file_name": "0.033.png"}], "categories": [{"id": 3, "name": "pot"}],
 "annotations": [{"id": 1, "image_id": 7, "category_id": 3, "bbox": [10, 12, 20, 22], "score": 0.5}]})");
        }},
    FuzzTarget{
        "boxes_folder", "labels/film_1.txt", [](const fs::path& file) { ReadBoxes(file.parent_path()); },
        [] { return std::string("41 0.5 0.5 0.1 0.2 0.75 1\n0 0.4 0.4 0.5 0.4 0.5 0.6 0.4 0.6 0.5 2\n"); }},
    FuzzTarget{"boxes_table", "boxes.csv", ReadBoxes,
               [] { return std::string("frame;class;conf;xmin;ymin;xmax;ymax\n1;cup;0.5;10;12;30;40\n"); }},
    FuzzTarget{"boxes_tracks", "boxes.txt", ReadBoxes,
               [] { return std::string("1,-1,11,12,20,22,0.5,-1,-1,-1\n2,4,1,1,60,40,1,3,1\n"); }},
    FuzzTarget{"camera", "camera.yaml", [](const fs::path& file) { ReadCamera(file); },
               [] { return FileOfProject("configs/cameras/tum-freiburg1.yaml"); }},
    FuzzTarget{"camera_colmap", "cameras.txt", [](const fs::path& file) { ReadCamera(file); },
               [] { return std::string("# cameras\n1 OPENCV 640 480 500 500 320 240 0.1 0.2 0 0\n"); }},
    FuzzTarget{"camera_colmap_binary", "cameras.bin", [](const fs::path& file) { ReadCamera(file); },
               [] {  // one camera, PINHOLE, 640x640, with 512 for each of its four parameters
                 std::string seed("\1\0\0\0\0\0\0\0\1\0\0\0\1\0\0\0", 16);
                 for (int i = 0; i < 2; ++i) {
                   seed += std::string("\x80\2\0\0\0\0\0\0", 8);
                 }
                 for (int i = 0; i < 4; ++i) {
                   seed += std::string("\0\0\0\0\0\0\x80\x40", 8);
                 }
                 return seed;
               }},
    FuzzTarget{
        "camera_opencv_xml", "camera.xml", [](const fs::path& file) { ReadCamera(file); },
        [] {
          return std::string(
              "<?xml version=\"1.0\"?>\n<opencv_storage>\n<image_width>640</image_width>\n"
              "<image_height>480</image_height>\n<!-- lens -->\n<camera_matrix type_id=\"opencv-matrix\">"
              "<data>500 0 320 0 500 240 0 0 1</data></camera_matrix>\n</opencv_storage>\n");
        }},
    FuzzTarget{"boxes_poses", "labels/film_1.txt",
               [](const fs::path& file) { ReadBoxes(file.parent_path()); },
               [] {
                 return std::string(
                     "0 0.5 0.5 0.4 0.6 0.4 0.3 2 0.6 0.3 1 0.5 0.7 2 0.9\n0 0.5 0.5 0.4 0.6 0.4 0.3 2 0 0 0 "
                     "0.5 0.7 1 0.8\n");
               }},
    FuzzTarget{
        "camera_orb_slam", "orb.yaml", [](const fs::path& file) { ReadCamera(file); },
        [] {
          return std::string(
              "%YAML:1.0\nCamera.type: \"PinHole\"\nCamera1.fx: 500.0\nCamera1.fy: 500.0\nCamera1.cx: 319.5\n"
              "Camera1.cy: 239.5\nCamera1.k1: 0.1\nCamera.width: 640\nCamera.height: 480\n");
        }},
    FuzzTarget{
        "camera_transforms", "transforms.json", [](const fs::path& file) { ReadCamera(file); },
        [] {
          return std::string(
              R"({"camera_model": "OPENCV", "w": 640, "h": 480, "fl_x": 500, "fl_y": 500, "cx": 320, "cy": 240,
 "frames": [{"file_path": "images/0.png", "k1": 0.1}]})");
        }},
    FuzzTarget{"camera_path", "tour.yaml", [](const fs::path& file) { ReadCameraPath(file, 30.0); },
               [] { return FileOfProject("configs/camera_paths/tour.yaml"); }},
    FuzzTarget{"classes", "classes.yaml", [](const fs::path& file) { ClassTable::Named(file); },
               [] { return FirstLines("configs/classes.yaml", 31); }},
    FuzzTarget{"config", "config.yaml",
               [](const fs::path& file) {
                 SystemOptions options;
                 LoadOptions(file, options);
               },
               [] { return FileOfProject("configs/default.yaml"); }},
    FuzzTarget{"dense_points", "dense.ply", [](const fs::path& file) { ReadDensePoints(file); },
               [] {
                 return Written("dense.ply",
                                [](const fs::path& file) { WriteDenseCloud(file, DenseCloud(3)); });
               }},
    FuzzTarget{"edits", "map.sqmap.edits.json", [](const fs::path& file) { ReadObjectEdits(file); },
               [] {
                 return Written("edits.json", [](const fs::path& file) {
                   ObjectEdits edits;
                   edits.SetLabel(1, "mug");
                   edits.Hide(2);
                   edits.Merge(4, 5);
                   WriteObjectEdits(file, edits);
                 });
               }},
    FuzzTarget{"experiment", "experiment.yaml", [](const fs::path& file) { app::ReadExperiment(file); },
               [] { return FileOfProject("configs/experiments/desk.yaml"); }},
    FuzzTarget{"ground_truth", "groundtruth.txt", ReadTruth,
               [] {
                 return std::string(
                     "# timestamp tx ty tz qx qy qz qw\n0.0 1 2 3 0 0 0 1\n0.033 1 2 4 0 0 0 1\n");
               }},
    FuzzTarget{"network", "network.yaml", ReadNetwork,
               [] { return FileOfProject("configs/detectors/yolox-nano.yaml"); }},
    FuzzTarget{
        "objects", "objects.json", [](const fs::path& file) { ReadObjects(file); },
        [] { return Written("objects.json", [](const fs::path& file) { WriteObjects(file, {Cup()}); }); }},
    FuzzTarget{"photograph", "photo.jpg", [](const fs::path& file) { GuessCamera(file, 30.0); }, Photograph},
    FuzzTarget{"point_cloud", "cloud.ply", [](const fs::path& file) { ReadPointCloud(file); },
               [] {
                 return std::string(
                     "ply\nformat ascii 1.0\ncomment made by hand\nelement vertex 2\nproperty float "
                     "x\nproperty float "
                     "y\nproperty double z\nproperty uchar red\nproperty uchar green\nproperty uchar "
                     "blue\nelement face "
                     "0\nproperty list uchar int vertex_indices\nend_header\n0 1 2 3 4 5\n1 2 3 4 5 6\n");
               }},
    FuzzTarget{"point_cloud_text", "cloud.csv", [](const fs::path& file) { ReadPointCloud(file); },
               [] { return std::string("\xEF\xBB\xBFx;y;z\r\n0,5;1;2\r\n1;2;3\r\n"); }},
    FuzzTarget{"recording", "map.sqmap", ReadRecording, DensifiedRecording},
    FuzzTarget{"scene", "scene.yaml", [](const fs::path& file) { ReadScene(file); }, SmallScene},
    FuzzTarget{"sequence", "rgb.txt",
               [](const fs::path& file) {
                 OpenSequence(
                     {.path = file.parent_path(), .format = SequenceFormat::kTum, .camera = "tum-freiburg1"});
               },
               [] { return std::string("# timestamp filename\n0.0 rgb.txt\n0.033 rgb.txt\n"); }},
    FuzzTarget{"snapshot", "snapshot",
               [](const fs::path& file) { DecodeSnapshot(ReadFile(file, "a snapshot")); },
               [] { return EncodeSnapshot(SmallMap()); }},
    FuzzTarget{"stats", "stats.json", [](const fs::path& file) { ReadStats(file); },
               [] {
                 return Written("stats.json", [](const fs::path& file) {
                   RunStats stats;
                   stats.timing_ms["tracking"] = {};
                   WriteStats(file, stats);
                 });
               }},
    FuzzTarget{"style", "style.yaml", [](const fs::path& file) { CheckStyle(LoadStyle(file.string())); },
               [] { return FileOfProject("configs/styles/paper.yaml"); }},
    FuzzTarget{"trajectory", "trajectory.txt", [](const fs::path& file) { ReadTrajectory(file); },
               [] {
                 return Written("trajectory.txt", [](const fs::path& file) {
                   WriteTrajectory(file, {{0.0, Rigid3d()}, {0.033, Rigid3d()}});
                 });
               }},
    FuzzTarget{"vocabulary", "words.bin", [](const fs::path& file) { Vocabulary::Load(file); },
               [] {
                 return Written("words.bin", [](const fs::path& file) {
                   Vocabulary::Train(ClusteredImages(3, 8, 4, 2), {.branching = 2, .depth = 2}).Save(file);
                 });
               },
               [](std::string_view bytes) {
                 std::string file(bytes);
                 if (file.size() >= 4) {  // the checksum at the end
                   const auto sum = static_cast<std::uint32_t>(
                       ::crc32_z(0, reinterpret_cast<const Bytef*>(file.data()), file.size() - 4));
                   std::memcpy(file.data() + file.size() - 4, &sum, 4);
                 }
                 return file;
               }},
};

}  // namespace

std::span<const FuzzTarget> FuzzTargets() { return kTargets; }

const FuzzTarget& FindFuzzTarget(std::string_view name) {
  const auto* const found = std::ranges::find(kTargets, name, &FuzzTarget::name);
  if (found == kTargets.end()) {
    throw std::out_of_range("no such fuzz target");
  }
  return *found;
}

std::string ReadFuzzed(const FuzzTarget& target, const fs::path& folder, std::string_view bytes) {
  const fs::path file = folder / target.file;
  fs::create_directories(file.parent_path());
  std::ofstream(file, std::ios::binary) << target.wrap(bytes);
  try {
    target.read(file);
  } catch (const InputError& error) {
    return error.what();
  } catch (const UsageError& error) {
    return error.what();
  } catch (const fs::filesystem_error& error) {  // an overlong path, which `main` shortens
    return error.path1().string();
  }
  return "";
}

}  // namespace sqslam::testing
