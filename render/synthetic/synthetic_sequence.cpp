#include "render/synthetic/synthetic_sequence.h"

#include <fmt/format.h>
#include <unistd.h>

#include <fstream>
#include <future>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <set>

#include "render/synthetic/camera_motion.h"
#include "render/synthetic/exact_boxes.h"
#include "render/synthetic/scene_renderer.h"
#include "slam/util/error.h"

namespace sqslam {
namespace {

namespace fs = std::filesystem;

// A folder under a temporary name that takes its own name on success and vanishes otherwise.
class PendingFolder {
 public:
  explicit PendingFolder(fs::path target) : target_(std::move(target)) {
    if (target_.filename().empty()) {  // "folder/"
      target_ = target_.parent_path();
    }
    if (fs::exists(target_) && !(fs::is_directory(target_) && fs::is_empty(target_))) {
      throw InputError(fmt::format("{}: exists already; expected a new or empty folder", target_.string()));
    }
    pending_ = target_;
    pending_ += fmt::format(".part{}", getpid());
    std::error_code error;
    fs::create_directories(pending_, error);
    if (error) {
      throw InputError(fmt::format("{}: cannot be made: {}", pending_.string(), error.message()));
    }
  }
  ~PendingFolder() {
    std::error_code ignored;
    fs::remove_all(pending_, ignored);
  }
  PendingFolder(const PendingFolder&) = delete;
  PendingFolder& operator=(const PendingFolder&) = delete;

  const fs::path& Path() const { return pending_; }
  void Commit() { fs::rename(pending_, target_); }

 private:
  fs::path target_;
  fs::path pending_;
};

void WriteText(const fs::path& path, const std::string& text) {
  std::ofstream stream(path, std::ios::binary);
  stream << text;
  stream.close();
  if (!stream) {
    throw InputError(fmt::format("{}: cannot be written (is the disk full?)", path.string()));
  }
}

std::string FormatCamera(const Camera& camera) {
  return fmt::format(
      "width: {}\nheight: {}\nfx: {}\nfy: {}\ncx: {}\ncy: {}\ndistortion: [0.0, 0.0, 0.0, 0.0, 0.0]\nfps: "
      "{}\n",
      camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy, camera.fps);
}

std::string FormatPose(double timestamp, const Rigid3d& pose) {
  const Eigen::Quaterniond& q = pose.rotation;
  const Eigen::Vector3d& t = pose.translation;
  return fmt::format("{:.6f} {:.7f} {:.7f} {:.7f} {:.7f} {:.7f} {:.7f} {:.7f}\n", timestamp, t.x(), t.y(),
                     t.z(), q.x(), q.y(), q.z(), q.w());
}

// The name of a shape where it has one, "superquadric" elsewhere; readers go by `shape` then.
std::string PrimitiveName(const Superquadric& shape) {
  const auto sharp = [](double e) { return e <= 0.3; };
  const auto round = [](double e) { return e >= 0.8 && e <= 1.2; };
  if (sharp(shape.e1) && sharp(shape.e2)) {
    return "cuboid";
  }
  if (sharp(shape.e1) && round(shape.e2)) {
    return "cylinder";
  }
  return round(shape.e1) && round(shape.e2) ? "ellipsoid" : "superquadric";
}

std::string FormatObjects(const SceneDescription& scene) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const SceneBody& body : scene.bodies) {
    if (body.id <= 0) {
      continue;
    }
    const Eigen::Matrix<double, 4, 4, Eigen::RowMajor> pose = body.superquadric.T_map_object.Matrix();
    const Eigen::Vector3d& center = body.superquadric.T_map_object.translation;
    const Superquadric& shape = body.superquadric.shape;
    nlohmann::ordered_json entry;
    entry["id"] = body.id;
    entry["label"] = body.label;
    entry["primitive"] = PrimitiveName(shape);
    entry["center"] = {center.x(), center.y(), center.z()};
    entry["yaw"] = body.yaw;
    entry["T_world_object"] = std::vector<double>(pose.data(), pose.data() + 16);
    entry["half_size"] = {shape.half_size.x(), shape.half_size.y(), shape.half_size.z()};
    entry["shape"] = {shape.e1, shape.e2};
    list.push_back(entry);
  }
  std::string text = "[\n";
  for (std::size_t i = 0; i < list.size(); ++i) {
    text += list[i].dump() + (i + 1 < list.size() ? ",\n" : "\n");
  }
  return text + "]\n";
}

std::string FileLabel(std::string label) {
  std::replace(label.begin(), label.end(), ' ', '_');
  return label;
}

std::string FormatDetection(double timestamp, const Detection& detection) {
  const Box2d& box = detection.box;
  return fmt::format("{:.6f} {} {:.3f} {:.2f} {:.2f} {:.2f} {:.2f}", timestamp, FileLabel(detection.label),
                     detection.score, box.x, box.y, box.width, box.height);
}

// Encodes one picture on a thread of its own while the next is drawn.
class ImageWriter {
 public:
  explicit ImageWriter(int quality) : quality_(quality) {}
  void Write(const fs::path& path, const cv::Mat& image) {
    Wait();
    pending_ = std::async(std::launch::async, [path, image, quality = quality_] {
      if (!cv::imwrite(path.string(), image, {cv::IMWRITE_JPEG_QUALITY, quality})) {
        throw InputError(fmt::format("{}: cannot be written (is the disk full?)", path.string()));
      }
    });
  }
  void Wait() {
    if (pending_.valid()) {
      pending_.get();
    }
  }

 private:
  int quality_;
  std::future<void> pending_;
};

void AddSensorNoise(cv::Mat& image, double sigma, std::uint64_t seed) {
  if (sigma <= 0.0) {
    return;
  }
  cv::RNG random(seed);
  cv::Mat noise(image.size(), CV_16SC3);
  random.fill(noise, cv::RNG::NORMAL, 0.0, sigma);
  cv::add(image, noise, image, cv::noArray(), CV_8U);
}

// The text files of a sequence as they grow frame by frame.
struct SequenceText {
  std::string images = "# color images\n# timestamp filename\n";
  std::string poses = "# ground truth trajectory: T_world_camera\n# timestamp tx ty tz qx qy qz qw\n";
  std::string exact = "# timestamp label score x y w h object_id visible_fraction\n";
  std::string noisy = "# timestamp label score x y w h\n";

  void Save(const fs::path& folder, bool noisy_detections) const {
    WriteText(folder / "rgb.txt", images);
    WriteText(folder / "groundtruth.txt", poses);
    WriteText(folder / "boxes.txt", noisy_detections ? noisy : exact);
    WriteText(folder / (noisy_detections ? "boxes_exact.txt" : "boxes_noisy.txt"),
              noisy_detections ? exact : noisy);
  }
};

void AddMotion(const std::vector<Rigid3d>& poses, double fps, SynthesisSummary& summary) {
  double angle = 0.0;
  for (std::size_t i = 1; i < poses.size(); ++i) {
    summary.path_length += (poses[i].translation - poses[i - 1].translation).norm();
    angle += poses[i].rotation.angularDistance(poses[i - 1].rotation);
  }
  const double seconds = static_cast<double>(std::max<std::size_t>(poses.size(), 2) - 1) / fps;
  summary.mean_speed = summary.path_length / seconds;
  summary.mean_turn_rate = angle / seconds;
}

std::vector<std::string> Labels(const SceneDescription& scene) {
  std::vector<std::string> labels;
  for (const SceneBody& body : scene.bodies) {
    if (body.id > 0) {
      labels.push_back(body.label);
    }
  }
  return labels;
}

}  // namespace

SynthesisSummary WriteSyntheticSequence(const SceneDescription& scene, const fs::path& output,
                                        const SynthesisOptions& options, const SynthesisProgress& progress) {
  PendingFolder folder(output);
  fs::create_directories(folder.Path() / "rgb");
  SynthesisSummary summary;
  summary.frames = options.frames > 0 ? options.frames : scene.frames;
  // Fewer frames are the beginning of the same motion, not the same way in less time.
  std::vector<Rigid3d> poses = HandHeldMotion(scene, std::max(summary.frames, scene.frames), options.seed);
  poses.resize(static_cast<std::size_t>(summary.frames));
  AddMotion(poses, scene.camera.fps, summary);

  SceneRenderer renderer(scene, options.supersampling, options.backend);
  DetectorNoise detector(options.seed, Labels(scene));
  ImageWriter writer(options.jpeg_quality);
  SequenceText text;
  std::set<std::int32_t> seen;
  for (int i = 0; i < summary.frames; ++i) {
    const Rigid3d& pose = poses[static_cast<std::size_t>(i)];
    const double timestamp = i / scene.camera.fps;
    cv::Mat image = renderer.RenderColor(pose);
    AddSensorNoise(image, options.image_noise, options.seed * 1000003U + static_cast<std::uint64_t>(i) + 1);
    const std::string name = fmt::format("rgb/{:06}.jpg", i);
    writer.Write(folder.Path() / name, image);
    text.images += fmt::format("{:.6f} {}\n", timestamp, name);
    text.poses += FormatPose(timestamp, pose);
    const auto boxes = FindExactBoxes(scene, pose, renderer.RenderIds(pose), options.supersampling);
    for (const ExactBox& box : boxes) {
      seen.insert(box.object_id);
      text.exact += fmt::format("{} {} {:.3f}\n", FormatDetection(timestamp, box.detection), box.object_id,
                                box.visible_fraction);
    }
    for (const Detection& detection : detector.Apply(boxes, scene.camera)) {
      text.noisy += FormatDetection(timestamp, detection) + "\n";
    }
    summary.boxes += static_cast<int>(boxes.size());
    if (progress) {
      progress(i + 1, summary.frames);
    }
  }
  writer.Wait();
  summary.objects = static_cast<int>(seen.size());
  text.Save(folder.Path(), options.noisy_detections);
  WriteText(folder.Path() / "camera.yaml", FormatCamera(scene.camera));
  WriteText(folder.Path() / "objects_gt.json", FormatObjects(scene));
  folder.Commit();
  return summary;
}

}  // namespace sqslam
