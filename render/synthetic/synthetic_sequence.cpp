#include "render/synthetic/synthetic_sequence.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <opencv2/imgcodecs.hpp>
#include <random>
#include <set>

#include "render/synthetic/scene_renderer.h"
#include "render/synthetic/true_surface.h"
#include "slam/io/cameras.h"
#include "slam/io/coco.h"
#include "slam/util/atomic_file.h"
#include "slam/util/throw_if.h"
#include "slam/util/worker_thread.h"

namespace sqslam {
namespace fs = std::filesystem;
namespace {

std::string FormatPose(double timestamp, const Rigid3d& pose) {
  return fmt::format("{:.6f} {:.7f} {:.7f}\n", timestamp, fmt::join(pose.translation, " "),
                     fmt::join(pose.rotation.coeffs(), " "));  // x y z w
}

// Returns the name of a shape if it has one, else "superquadric".
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
  std::vector<std::string> lines;
  for (const SceneBody& body : scene.bodies) {
    if (body.id > 0) {
      const auto& [shape, T_world_object] = body.superquadric;
      const Eigen::Matrix<double, 4, 4, Eigen::RowMajor> pose = T_world_object.Matrix();
      nlohmann::ordered_json entry;
      entry["id"] = body.id;
      entry["label"] = body.label;
      entry["primitive"] = PrimitiveName(shape);
      entry["center"] = T_world_object.translation;
      entry["yaw"] = body.yaw;
      entry["T_world_object"] = std::vector<double>(pose.data(), pose.data() + 16);
      entry["half_size"] = shape.half_size;
      entry["shape"] = {shape.e1, shape.e2};
      lines.push_back(entry.dump());
    }
  }
  return fmt::format("[\n{}\n]\n", fmt::join(lines, ",\n"));
}

std::string FormatDetection(double timestamp, const Detection& detection) {
  const Box2d& box = detection.box;
  return fmt::format("{:.6f} {} {:.3f} {:.2f} {:.2f} {:.2f} {:.2f}", timestamp,
                     NormalizedLabel(detection.label), detection.score, box.x, box.y, box.width, box.height);
}

struct DrawnImage {
  fs::path path;
  cv::Mat image;
  std::uint64_t noise_seed = 0;
};

void AddSensorNoise(cv::Mat& image, double sigma, std::uint64_t seed) {
  if (sigma > 0.0) {
    cv::RNG random(seed);
    cv::Mat noise(image.size(), CV_16SC3);
    random.fill(noise, cv::RNG::NORMAL, 0.0, sigma);
    cv::add(image, noise, image, cv::noArray(), CV_8U);
  }
}

// The text files of a sequence, extended frame by frame.
struct SequenceText {
  std::string images = "# color images\n# timestamp filename\n";
  std::string poses = "# ground truth trajectory: T_world_camera\n# timestamp tx ty tz qx qy qz qw\n";
  std::string exact = "# timestamp label score x y w h object_id visible_fraction\n";
  std::string noisy = "# timestamp label score x y w h\n";

  void Save(const fs::path& folder, bool noisy_detections) const {
    WriteFileAtomically(folder / "rgb.txt", images);
    WriteFileAtomically(folder / "groundtruth.txt", poses);
    WriteFileAtomically(folder / "boxes.txt", noisy_detections ? noisy : exact);
    WriteFileAtomically(folder / (noisy_detections ? "boxes_exact.txt" : "boxes_noisy.txt"),
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

using Vector6d = Eigen::Matrix<double, 6, 1>;  // position, look-at

Vector6d Waypoint(const SceneDescription& scene, int i) {
  const auto last = static_cast<int>(scene.waypoints.size()) - 1;
  const SceneWaypoint& waypoint = scene.waypoints[static_cast<std::size_t>(std::clamp(i, 0, last))];
  return (Vector6d() << waypoint.position, waypoint.look_at).finished();
}

// Uniform cubic B-spline over the waypoints, with two continuous derivatives like the motion of a hand. It
// passes through the ends and near the waypoints between.
Vector6d SplineAt(const SceneDescription& scene, double t) {
  const int i = static_cast<int>(std::floor(t));
  const double u = t - i;
  const std::array<double, 4> weights = {(1 - u) * (1 - u) * (1 - u) / 6.0,
                                         (3 * u * u * u - 6 * u * u + 4) / 6.0,
                                         (-3 * u * u * u + 3 * u * u + 3 * u + 1) / 6.0, u * u * u / 6.0};
  Vector6d sum = Vector6d::Zero();
  for (int k = 0; k < 4; ++k) {
    sum += weights[static_cast<std::size_t>(k)] * Waypoint(scene, i - 1 + k);
  }
  return sum;
}

// Samples of the curve with the arc length at each, for motion at constant speed. Arc length is measured in
// position and look-at point together, so that turning takes time too.
struct MeasuredCurve {
  std::vector<Vector6d> samples;
  std::vector<double> way;

  explicit MeasuredCurve(const SceneDescription& scene) {
    constexpr int kSamplesPerSpan = 100;
    const double first = -1.0;  // repeated end points: the curve starts and ends there
    const double last = static_cast<double>(scene.waypoints.size());
    const int count = static_cast<int>((last - first) * kSamplesPerSpan);
    for (int i = 0; i <= count; ++i) {
      samples.push_back(SplineAt(scene, first + (last - first) * i / count));
      way.push_back(i == 0 ? 0.0 : way.back() + (samples.back() - samples[samples.size() - 2]).norm());
    }
  }

  Vector6d At(double distance) const {
    const auto it = std::upper_bound(way.begin() + 1, way.end() - 1, distance);
    const auto i = static_cast<std::size_t>(it - way.begin());
    const double span = way[i] - way[i - 1];
    const double u = span > 0.0 ? std::clamp((distance - way[i - 1]) / span, 0.0, 1.0) : 0.0;
    return samples[i - 1] + u * (samples[i] - samples[i - 1]);
  }
};

// Returns the share of the path travelled after the share `t` of the time: constant speed with smooth ends.
double Progress(double t) {
  constexpr double kRamp = 0.06;
  const auto integral = [](double x) {  // of a speed that smoothly rises from 0 to 1 within kRamp
    const double u = std::min(x / kRamp, 1.0);
    return kRamp * (u * u * u - 0.5 * u * u * u * u) + std::max(0.0, x - kRamp);
  };
  const double total = 1.0 - kRamp;
  return t <= 0.5 ? integral(t) / total : 1.0 - integral(1.0 - t) / total;
}

// Hand tremor: per axis (six), a sum of sines with incommensurable frequencies.
class Tremor {
 public:
  explicit Tremor(std::uint64_t seed) {
    std::mt19937_64 random(seed);
    for (auto& axis : phases_) {
      for (double& phase : axis) {
        phase = 2.0 * std::numbers::pi * (static_cast<double>(random() >> 11) * 0x1.0p-53);
      }
    }
  }

  double At(std::size_t axis, double seconds) const {
    static constexpr std::array<double, 4> kHertz = {0.53, 1.31, 2.7, 5.3};
    static constexpr std::array<double, 4> kWeight = {0.6, 0.4, 0.2, 0.07};
    double sum = 0.0;
    for (std::size_t i = 0; i < kHertz.size(); ++i) {
      sum += kWeight[i] * std::sin(2.0 * std::numbers::pi * kHertz[i] * seconds + phases_[axis][i]);
    }
    return sum;
  }

 private:
  std::array<std::array<double, 4>, 6> phases_{};
};

}  // namespace

SynthesisSummary WriteSyntheticSequence(const SceneDescription& scene, const fs::path& output,
                                        const SynthesisOptions& options, const SynthesisProgress& progress) {
  const fs::path target = output.filename().empty() ? output.parent_path() : output;  // "folder/"
  ThrowIf<InputError>(fs::exists(target) && !(fs::is_directory(target) && fs::is_empty(target)),
                      "{}: exists already; expected a new or empty folder", target.string());
  AtomicPath folder(target);
  std::error_code error;
  fs::create_directories(folder.Path() / "rgb", error);
  if (error) {
    throw InputError("{}: cannot be created: {}", target.string(), error.message());
  }
  SynthesisSummary summary;
  summary.frames = options.frames > 0 ? options.frames : scene.frames;
  // Fewer frames are the beginning of the same motion, not a faster one.
  std::vector<Rigid3d> poses = HandHeldMotion(scene, std::max(summary.frames, scene.frames), options.seed);
  poses.resize(static_cast<std::size_t>(summary.frames));
  AddMotion(poses, scene.camera.fps, summary);

  SceneRenderer renderer(scene, options.supersampling, options.backend);
  DetectorNoise detector(options.seed, Labels(scene));
  WorkerThread<DrawnImage> writer(1, [&options](DrawnImage& file) {  // while the next is drawn
    AddSensorNoise(file.image, options.image_noise, file.noise_seed);
    if (!cv::imwrite(file.path.string(), file.image, {cv::IMWRITE_JPEG_QUALITY, options.jpeg_quality})) {
      throw InputError("{}: cannot be written (is the disk full?)", file.path.string());
    }
  });
  SequenceText text;
  std::set<std::int32_t> seen;
  for (int i = 0; i < summary.frames; ++i) {
    const Rigid3d& pose = poses[static_cast<std::size_t>(i)];
    const double timestamp = i / scene.camera.fps;
    const SceneImage drawn = renderer.Render(pose);
    const std::string name = fmt::format("rgb/{:06}.jpg", i);
    writer.Add(
        {folder.Path() / name, drawn.color, options.seed * 1000003U + static_cast<std::uint64_t>(i) + 1});
    text.images += fmt::format("{:.6f} {}\n", timestamp, name);
    text.poses += FormatPose(timestamp, pose);
    const auto boxes = FindExactBoxes(scene, pose, drawn.ids, options.supersampling);
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
  writer.Finish();
  summary.objects = static_cast<int>(seen.size());
  text.Save(folder.Path(), options.noisy_detections);
  WriteCamera(folder.Path() / "camera.yaml", scene.camera);
  WriteFileAtomically(folder.Path() / "objects_gt.json", FormatObjects(scene));
  WriteSurface(folder.Path() / "dense.ply", SeenSurface(scene, poses));
  folder.Commit();
  return summary;
}

Rigid3d LookAt(const Eigen::Vector3d& position, const Eigen::Vector3d& target) {
  const Eigen::Vector3d forward = (target - position).normalized();
  Eigen::Vector3d right = forward.cross(Eigen::Vector3d::UnitZ());
  right = right.norm() > 1e-6 ? right.normalized() : Eigen::Vector3d::UnitX();
  Eigen::Matrix3d rotation;
  rotation << right, forward.cross(right), forward;
  return {Eigen::Quaterniond(rotation).normalized(), position};
}

std::vector<Rigid3d> HandHeldMotion(const SceneDescription& scene, int frames, std::uint64_t seed) {
  const MeasuredCurve curve(scene);
  const Tremor tremor(seed);
  std::vector<Rigid3d> poses;
  poses.reserve(static_cast<std::size_t>(frames));
  for (int i = 0; i < frames; ++i) {
    const double seconds = i / scene.camera.fps;
    const double part = frames > 1 ? static_cast<double>(i) / (frames - 1) : 0.0;
    const Vector6d state = curve.At(Progress(part) * curve.way.back());
    Rigid3d pose = LookAt(state.head<3>(), state.tail<3>());
    Eigen::Vector3d angles;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      pose.translation[static_cast<Eigen::Index>(axis)] += scene.tremor_position * tremor.At(axis, seconds);
      angles[static_cast<Eigen::Index>(axis)] = scene.tremor_angle * tremor.At(axis + 3, seconds);
    }
    if (angles.norm() > 0.0) {
      pose.rotation = (pose.rotation * Eigen::AngleAxisd(angles.norm(), angles.normalized())).normalized();
    }
    poses.push_back(pose);
  }
  return poses;
}

}  // namespace sqslam
