#include "slam/snapshot/depth_recording.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <utility>

#include "slam/snapshot/byte_archive.h"
#include "slam/snapshot/map_scale.h"
#include "slam/util/image_decoding.h"
#include "slam/util/limits.h"

namespace sqslam {
namespace fs = std::filesystem;
namespace {

constexpr const char* kDepthMapName = "a depth map";
constexpr double kDepthSteps = 65534.0;

[[noreturn]] void ThrowOutOfRange() { throw InputError("{} is out of range", kDepthMapName); }

// Camera and pose of a row.
void VisitHeader(auto&& archive, auto& camera, auto& T_map_camera) {
  archive(camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy, T_map_camera);
}

void ReadHeader(const std::string& header, DepthMap& map) {
  const Camera& c = map.camera;
  VisitHeader(ByteReader(header, kDepthMapName), map.camera, map.T_map_camera);
  const auto is_side = [](int side) { return side >= 1 && side <= kMaxImageSide; };
  const auto within = [](double number) { return std::abs(number) <= kMaxMapUnits; };
  const Eigen::Array3d distances = map.T_map_camera.translation.array().abs();
  if (!is_side(c.width) || !is_side(c.height) || !within(c.fx) || !within(c.fy) || !within(c.cx) ||
      !within(c.cy) || !(distances <= kMaxMapUnits).all() || !(c.fx * c.fy > 0.0)) {
    ThrowOutOfRange();
  }
}

// Standard deviations are stored as steps of their logarithm: 19 % apart are finer than any prediction.
constexpr double kLeastSigma = 1e-5;  // share of the depth
constexpr double kSigmaSteps = 4.0;   // per factor of two

std::uint8_t SigmaStep(double sigma) {
  return static_cast<std::uint8_t>(std::clamp(
      std::round(kSigmaSteps * std::log2(std::max(sigma, kLeastSigma) / kLeastSigma)), 0.0, 255.0));
}

// Returns the standard deviation of each step.
std::array<float, 256> SigmasOfSteps() {
  std::array<float, 256> sigmas{};
  for (std::size_t step = 0; step < sigmas.size(); ++step) {
    sigmas[step] = static_cast<float>(kLeastSigma * std::exp2(static_cast<double>(step) / kSigmaSteps));
  }
  return sigmas;
}

// Smallest and largest inverse depth in the map's units, then for each pixel 0 for no depth or 1 to 65535
// between these, as difference to the pixel on its left: low bytes first, then high bytes (compresses best).
// At last the steps of the standard deviations, 0 where there is no depth.
std::string EncodeDepth(const DepthMap& map, double metres) {
  const cv::Mat depth = metres == 1.0 ? map.depth : cv::Mat(map.depth / metres);
  double smallest = 0.0, largest = 0.0;
  for (auto z = depth.begin<float>(); z != depth.end<float>(); ++z) {
    if (*z > 0.0F) {
      const double inverse = 1.0 / *z;
      smallest = smallest == 0.0 ? inverse : std::min(smallest, inverse);
      largest = std::max(largest, inverse);
    }
  }
  const double scale = largest > smallest ? kDepthSteps / (largest - smallest) : 0.0;
  std::string raw(3 * depth.total(), '\0');
  std::uint16_t left = 0;
  std::size_t i = 0;
  for (auto z = depth.begin<float>(); z != depth.end<float>(); ++z, ++i) {
    const auto value =
        static_cast<std::uint16_t>(*z > 0.0F ? 1.0 + std::round((1.0 / *z - smallest) * scale) : 0.0);
    const auto difference = static_cast<std::uint16_t>(value - left);
    left = value;
    raw[i] = static_cast<char>(difference & 255U);
    raw[i + depth.total()] = static_cast<char>(difference >> 8U);
    if (value > 0) {
      const auto at = static_cast<int>(i);
      raw[i + 2 * depth.total()] =
          static_cast<char>(SigmaStep(map.SigmaAt(at % depth.cols, at / depth.cols)));
    }
  }
  ByteWriter range;
  range(smallest, largest);
  return range.Take() + Deflate(raw);
}

void DecodeDepth(std::string_view bytes, cv::Size size, DepthMap& map) {
  static const std::array<float, 256> sigmas = SigmasOfSteps();
  double smallest = 0.0, largest = 0.0;
  ByteReader(bytes, kDepthMapName)(smallest, largest);
  if (!(smallest >= 0.0 && largest >= smallest)) {
    ThrowOutOfRange();
  }
  bytes.remove_prefix(sizeof(smallest) + sizeof(largest));
  cv::Mat& depth = map.depth;
  depth.create(size, CV_32F);
  map.sigma.create(size, CV_32F);
  const std::string raw = Inflate(bytes, 3 * depth.total(), kDepthMapName);
  std::uint16_t value = 0;
  for (std::size_t i = 0; i < depth.total(); ++i) {
    const auto low = static_cast<std::uint8_t>(raw[i]);
    const auto high = static_cast<std::uint8_t>(raw[i + depth.total()]);
    value = static_cast<std::uint16_t>(value + low + 256U * high);
    const double z = value == 0 ? 0.0 : 1.0 / (smallest + (value - 1) / kDepthSteps * (largest - smallest));
    if (!(z <= kMaxMapUnits)) {
      ThrowOutOfRange();
    }
    depth.at<float>(static_cast<int>(i)) = static_cast<float>(z);
    map.sigma.at<float>(static_cast<int>(i)) = sigmas[static_cast<std::uint8_t>(raw[i + 2 * depth.total()])];
  }
}

std::string EncodeImage(const cv::Mat& bgr) {
  std::vector<std::uint8_t> jpeg;
  cv::imencode(".jpg", bgr, jpeg, {cv::IMWRITE_JPEG_QUALITY, 98});
  return {jpeg.begin(), jpeg.end()};
}

// Reads the columns frame_index, camera, image, depth, views; empty bytes leave `views` empty. Throws
// InputError or cv::Exception if they are not a depth map.
DepthMap DecodeRow(sqlite::Statement& select) {
  DepthMap map;
  map.frame_index = select.Int(0);
  ReadHeader(select.Bytes(1), map);
  if (const std::string image = select.Bytes(2); !image.empty()) {
    map.bgr = DecodeImage(image, cv::IMREAD_COLOR).pixels;
  }
  if (map.bgr.empty() || map.bgr.size() != cv::Size(map.camera.width, map.camera.height)) {
    ThrowOutOfRange();
  }
  DecodeDepth(select.Bytes(3), map.bgr.size(), map);
  if (const std::string views = select.Bytes(4); !views.empty()) {
    const std::string raw = Inflate(views, map.depth.total(), kDepthMapName);
    map.views.create(map.depth.size(), CV_8U);
    std::copy(raw.begin(), raw.end(), map.views.begin<std::uint8_t>());
  }
  return map;
}

std::string FirstText(sqlite::Statement select) { return select.Next() ? select.Bytes(0) : ""; }

}  // namespace

DepthRecording::DepthRecording(const fs::path& recording, Access access)
    : path_(recording),
      db_(sqlite::OpenRecording(recording,
                                access == Access::kRead ? SQLITE_OPEN_READONLY : SQLITE_OPEN_READWRITE)),
      access_(access) {
  if (const std::optional<MapScale> scale = ReadMapScale(recording)) {
    metres_ = scale->metres;
  }
  if (access != Access::kRead) {
    sqlite::Execute(db_.get(), recording, "PRAGMA journal_mode=WAL; PRAGMA synchronous=NORMAL;");
  }
}

DepthRecording::~DepthRecording() {
  try {
    Close();
  } catch (const InputError&) {
    // The file is readable with its WAL beside it; a destructor cannot report the error.
  }
}

std::vector<std::int64_t> DepthRecording::List(const char* sql) const {
  std::vector<std::int64_t> keyframes;
  sqlite::Statement select = Prepare(sql);
  while (select.Next()) {
    keyframes.push_back(select.Int(0));
  }
  return keyframes;
}

DepthMap DepthRecording::Read(std::int64_t keyframe, const char* sql) const {
  sqlite::Statement select = Prepare(sql, keyframe);
  if (!select.Next()) {
    throw InputError("{}: has no depth map of keyframe {}", path_.string(), keyframe);
  }
  const auto refuse = [&] {
    throw InputError("{}: the depth map of keyframe {} is broken", path_.string(), keyframe);
  };
  DepthMap map;
  try {
    map = DecodeRow(select);
  } catch (const InputError&) {
    refuse();
  } catch (const cv::Exception&) {  // not an image
    refuse();
  }
  map.keyframe = keyframe;
  map.T_map_camera.translation *= metres_;
  map.depth *= metres_;
  return map;
}

std::vector<std::int64_t> DepthRecording::Keyframes() const {
  return List("SELECT keyframe FROM depth_maps WHERE kept IS NOT NULL ORDER BY frame_index, keyframe");
}

std::vector<std::int64_t> DepthRecording::Estimated() const {
  return List("SELECT keyframe FROM depth_maps ORDER BY frame_index, keyframe");
}

DepthMap DepthRecording::Kept(std::int64_t keyframe) const {
  return Read(keyframe,
              "SELECT frame_index, camera, image, kept, views FROM depth_maps WHERE keyframe = ? AND "
              "kept IS NOT NULL");
}

DepthMap DepthRecording::Estimate(std::int64_t keyframe) const {
  return Read(keyframe, "SELECT frame_index, camera, image, estimate, '' FROM depth_maps WHERE keyframe = ?");
}

std::string DepthRecording::Settings(std::int64_t keyframe) const {
  return FirstText(Prepare("SELECT settings FROM depth_maps WHERE keyframe = ?", keyframe));
}

// Executes statements that read the tables of another recording as `other`.
void DepthRecording::RunWithOther(const fs::path& recording, std::initializer_list<const char*> statements) {
  DepthRecording{recording};  // throws if it is not a recording
  Prepare("ATTACH DATABASE ? AS other", recording.string()).Run();
  for (const char* statement : statements) {
    Prepare(statement).Run();
  }
  Prepare("DETACH DATABASE other").Run();
}

void DepthRecording::TakeEstimates(const fs::path& recording) {
  RunWithOther(
      recording,
      {"INSERT OR REPLACE INTO main.depth_maps (keyframe, frame_index, settings, camera, image, estimate)"
       " SELECT keyframe, frame_index, settings, camera, image, estimate FROM other.depth_maps"});
}

void DepthRecording::TakeFinished(const fs::path& recording) {
  RunWithOther(recording,
               {"INSERT OR REPLACE INTO main.depth_maps"
                " (keyframe, frame_index, settings, camera, image, estimate, kept, views)"
                " SELECT keyframe, 0, settings, camera, image, estimate, kept, views FROM other.depth_maps",
                "INSERT OR REPLACE INTO main.meta SELECT * FROM other.meta WHERE key LIKE 'dense.%'"});
}

void DepthRecording::PutEstimate(const DepthMap& map, const std::string& settings) {
  Rigid3d T_map_camera = map.T_map_camera;
  T_map_camera.translation /= metres_;
  ByteWriter header;
  VisitHeader(header, map.camera, T_map_camera);
  const std::string image = EncodeImage(map.bgr);
  const std::string estimate = EncodeDepth(map, metres_);
  Prepare(
      "INSERT OR REPLACE INTO depth_maps (keyframe, frame_index, settings, camera, image, estimate)"
      " VALUES (?, ?, ?, ?, ?, ?)",
      map.keyframe, map.frame_index, settings, sqlite::Blob{header.Bytes()}, sqlite::Blob{image},
      sqlite::Blob{estimate})
      .Run();
}

void DepthRecording::PutKept(const DepthMap& map) {
  const std::string kept = EncodeDepth(map, metres_);
  const std::string views =
      Deflate(std::string(map.views.begin<std::uint8_t>(), map.views.end<std::uint8_t>()));
  Prepare("UPDATE depth_maps SET kept = ?, views = ? WHERE keyframe = ?", sqlite::Blob{kept},
          sqlite::Blob{views}, map.keyframe)
      .Run();
}

void DepthRecording::Remove(std::int64_t keyframe) {
  Prepare("DELETE FROM depth_maps WHERE keyframe = ?", keyframe).Run();
}

void DepthRecording::PutText(const std::string& name, const std::string& text) {
  Prepare("INSERT OR REPLACE INTO meta (key, value) VALUES ('dense.' || ?, ?)", name, text).Run();
}

std::string DepthRecording::Text(const std::string& name) const {
  return FirstText(Prepare("SELECT value FROM meta WHERE key = 'dense.' || ?", name));
}

void DepthRecording::Close() {
  const sqlite::Database db = std::move(db_);
  if (db && access_ == Access::kWrite) {
    sqlite::AbsorbLog(db.get(), path_);
  }
}

}  // namespace sqslam
