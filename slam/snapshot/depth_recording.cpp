#include "slam/snapshot/depth_recording.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <utility>

#include "slam/snapshot/byte_archive.h"
#include "slam/snapshot/map_scale.h"
#include "slam/snapshot/sqlite_file.h"
#include "slam/util/image_decoding.h"
#include "slam/util/limits.h"

namespace sqslam {
namespace fs = std::filesystem;
namespace {

constexpr const char* kDepthVersion = "1";

// Camera and pose of a row: width, height, fx, fy, cx, cy, quaternion x y z w, translation.
std::string HeaderOf(const DepthMap& map, double metres) {
  const Camera& c = map.camera;
  const Eigen::Vector3d t = map.T_map_camera.translation / metres;
  ByteWriter header;
  header(double(c.width), double(c.height), c.fx, c.fy, c.cx, c.cy, map.T_map_camera.rotation, t);
  return header.Take();
}

constexpr const char* kDepthMapName = "a depth map";

[[noreturn]] void ThrowCutOff() { throw InputError("{} is cut off", kDepthMapName); }

// Smallest and largest inverse depth in the map's units, then for each pixel 0 for no depth or 1 to 65535
// between these, as difference to the pixel on its left: low bytes first, then high bytes (compresses best).
std::string EncodeDepth(const cv::Mat& metric_depth, double metres) {
  constexpr double kSteps = 65534.0;
  const cv::Mat depth = metres == 1.0 ? metric_depth : cv::Mat(metric_depth / metres);
  double smallest = 0.0, largest = 0.0;
  for (auto z = depth.begin<float>(); z != depth.end<float>(); ++z) {
    if (*z > 0.0F) {
      const double inverse = 1.0 / *z;
      smallest = smallest == 0.0 ? inverse : std::min(smallest, inverse);
      largest = std::max(largest, inverse);
    }
  }
  const double scale = largest > smallest ? kSteps / (largest - smallest) : 0.0;
  std::string raw(2 * depth.total(), '\0');
  std::uint16_t left = 0;
  std::size_t i = 0;
  for (auto z = depth.begin<float>(); z != depth.end<float>(); ++z, ++i) {
    const auto value =
        static_cast<std::uint16_t>(*z > 0.0F ? 1.0 + std::round((1.0 / *z - smallest) * scale) : 0.0);
    const auto difference = static_cast<std::uint16_t>(value - left);
    left = value;
    raw[i] = static_cast<char>(difference & 255U);
    raw[i + depth.total()] = static_cast<char>(difference >> 8U);
  }
  ByteWriter range;
  range(smallest, largest);
  return range.Take() + Deflate(raw);
}

cv::Mat DecodeDepth(std::string_view bytes, cv::Size size) {
  constexpr double kSteps = 65534.0;
  double smallest = 0.0, largest = 0.0;
  ByteReader(bytes, kDepthMapName)(smallest, largest);
  if (!(smallest >= 0.0 && largest >= smallest)) {
    ThrowCutOff();
  }
  bytes.remove_prefix(sizeof(smallest) + sizeof(largest));
  cv::Mat depth(size, CV_32F);
  const std::string raw = Inflate(bytes, 2 * depth.total(), kDepthMapName);
  std::uint16_t value = 0;
  for (std::size_t i = 0; i < depth.total(); ++i) {
    const auto low = static_cast<std::uint8_t>(raw[i]);
    const auto high = static_cast<std::uint8_t>(raw[i + depth.total()]);
    value = static_cast<std::uint16_t>(value + low + 256U * high);
    const double z = value == 0 ? 0.0 : 1.0 / (smallest + (value - 1) / kSteps * (largest - smallest));
    if (!(z <= kMaxMapUnits)) {
      ThrowCutOff();
    }
    depth.at<float>(static_cast<int>(i)) = static_cast<float>(z);
  }
  return depth;
}

std::string EncodeImage(const cv::Mat& bgr) {
  std::vector<std::uint8_t> jpeg;
  cv::imencode(".jpg", bgr, jpeg, {cv::IMWRITE_JPEG_QUALITY, 92});
  return {jpeg.begin(), jpeg.end()};
}

}  // namespace

struct DepthRecording::Impl {
  fs::path path;
  sqlite::Database db;
  Access access = Access::kRead;
  double metres = 1.0;
  bool has_table = false;

  [[noreturn]] void ThrowBroken(std::int64_t keyframe) const {
    throw InputError("{}: the depth map of keyframe {} is broken", path.string(), keyframe);
  }

  sqlite::Statement Prepare(const char* sql, const auto&... values) const {
    return {db.get(), path, sql, values...};
  }

  std::vector<std::int64_t> List(const char* sql) const {
    std::vector<std::int64_t> keyframes;
    if (has_table) {
      sqlite::Statement select = Prepare(sql);
      while (select.Next()) {
        keyframes.push_back(select.Int(0));
      }
    }
    return keyframes;
  }

  // The statement selects frame_index, camera, image, depth, views; empty bytes leave `views` empty.
  DepthMap Read(std::int64_t keyframe, const char* sql) const {
    sqlite::Statement select = Prepare(sql, keyframe);
    if (!has_table || !select.Next()) {
      throw InputError("{}: no depth map of keyframe {}", path.string(), keyframe);
    }
    try {
      DepthMap map = Decode(select);
      map.keyframe = keyframe;
      map.T_map_camera.translation *= metres;
      map.depth *= metres;
      return map;
    } catch (const InputError&) {
      ThrowBroken(keyframe);
    } catch (const cv::Exception&) {  // not an image
      ThrowBroken(keyframe);
    }
  }

  // Throws InputError or cv::Exception if the columns are no depth map.
  static DepthMap Decode(sqlite::Statement& select) {
    DepthMap map;
    map.frame_index = select.Int(0);
    const std::string header = select.Bytes(1);
    std::array<double, 13> h{};  // see HeaderOf()
    ByteReader reader(header, kDepthMapName);
    reader(h);
    const bool sizes = h[0] >= 1 && h[1] >= 1 && h[0] <= kMaxImageSide && h[1] <= kMaxImageSide;
    if (!sizes || !std::ranges::all_of(h, [](double v) { return std::abs(v) <= kMaxMapUnits; }) ||
        !(h[2] * h[3] > 0.0)) {
      ThrowCutOff();
    }
    map.camera.width = static_cast<int>(h[0]);
    map.camera.height = static_cast<int>(h[1]);
    std::tie(map.camera.fx, map.camera.fy, map.camera.cx, map.camera.cy) = std::tie(h[2], h[3], h[4], h[5]);
    map.T_map_camera = {Eigen::Quaterniond(h[9], h[6], h[7], h[8]), {h[10], h[11], h[12]}};
    const std::string image = select.Bytes(2);
    if (!image.empty()) {
      map.bgr = DecodeImage(image, cv::IMREAD_COLOR).pixels;
    }
    if (map.bgr.empty() || map.bgr.size() != cv::Size(map.camera.width, map.camera.height)) {
      ThrowCutOff();
    }
    map.depth = DecodeDepth(select.Bytes(3), map.bgr.size());
    if (const std::string views = select.Bytes(4); !views.empty()) {
      const std::string raw = Inflate(views, map.depth.total(), kDepthMapName);
      map.views.create(map.depth.size(), CV_8U);
      std::copy(raw.begin(), raw.end(), map.views.begin<std::uint8_t>());
    }
    return map;
  }
};

DepthRecording::DepthRecording(const fs::path& recording, Access access) : impl_(std::make_unique<Impl>()) {
  impl_->path = recording;
  impl_->access = access;
  const bool write = access != Access::kRead;
  impl_->db = sqlite::OpenRecording(recording, write ? SQLITE_OPEN_READWRITE : SQLITE_OPEN_READONLY);
  const std::optional<MapScale> scale = ReadMapScale(recording);
  impl_->metres = scale ? scale->metres : 1.0;
  std::string version;
  {
    sqlite::Statement select = impl_->Prepare("SELECT value FROM meta WHERE key = 'depth_version'");
    version = select.Next() ? select.Bytes(0) : "";
  }
  if (!version.empty() && version != kDepthVersion) {
    throw InputError("{}: depth maps of version {}, expected version {}", recording.string(), version,
                     kDepthVersion);
  }
  if (write) {
    sqlite::Execute(impl_->db.get(), recording, "PRAGMA journal_mode=WAL; PRAGMA synchronous=NORMAL;");
    sqlite::Execute(impl_->db.get(), recording,
                    "BEGIN;"
                    "CREATE TABLE IF NOT EXISTS depth_maps (keyframe INTEGER PRIMARY KEY,"
                    " frame_index INTEGER NOT NULL, settings TEXT NOT NULL, camera BLOB NOT NULL,"
                    " image BLOB NOT NULL, estimate BLOB NOT NULL, kept BLOB, views BLOB);"
                    "INSERT OR IGNORE INTO meta (key, value) VALUES ('depth_version', '1');"
                    "COMMIT");
  }
  impl_->has_table = write || !version.empty();
}

DepthRecording::~DepthRecording() {
  try {
    if (impl_) {
      Close();
    }
  } catch (const InputError&) {
    // The file is readable with its WAL beside it; a destructor cannot report the error.
  }
}

DepthRecording::DepthRecording(DepthRecording&&) noexcept = default;

std::vector<std::int64_t> DepthRecording::Keyframes() const {
  return impl_->List("SELECT keyframe FROM depth_maps WHERE kept IS NOT NULL ORDER BY frame_index, keyframe");
}

std::vector<std::int64_t> DepthRecording::Estimated() const {
  return impl_->List("SELECT keyframe FROM depth_maps ORDER BY frame_index, keyframe");
}

DepthMap DepthRecording::Kept(std::int64_t keyframe) const {
  return impl_->Read(keyframe,
                     "SELECT frame_index, camera, image, kept, views FROM depth_maps WHERE keyframe = ? AND "
                     "kept IS NOT NULL");
}

DepthMap DepthRecording::Estimate(std::int64_t keyframe) const {
  return impl_->Read(keyframe,
                     "SELECT frame_index, camera, image, estimate, '' FROM depth_maps WHERE keyframe = ?");
}

double DepthRecording::Metres() const { return impl_->metres; }

std::string DepthRecording::Settings(std::int64_t keyframe) const {
  if (!impl_->has_table) {
    return {};
  }
  sqlite::Statement select = impl_->Prepare("SELECT settings FROM depth_maps WHERE keyframe = ?", keyframe);
  return select.Next() ? select.Bytes(0) : "";
}

void DepthRecording::TakeEstimates(const fs::path& recording) {
  DepthRecording{recording};  // throws if it is none
  impl_->Prepare("ATTACH DATABASE ? AS other", recording.string()).Run();
  impl_
      ->Prepare(
          "INSERT OR REPLACE INTO main.depth_maps (keyframe, frame_index, settings, camera, image, estimate)"
          " SELECT keyframe, frame_index, settings, camera, image, estimate FROM other.depth_maps")
      .Run();
  impl_->Prepare("DETACH DATABASE other").Run();
}

void DepthRecording::PutEstimate(const DepthMap& map, const std::string& settings) {
  const std::string header = HeaderOf(map, impl_->metres);
  const std::string image = EncodeImage(map.bgr);
  const std::string estimate = EncodeDepth(map.depth, impl_->metres);
  sqlite::Statement insert = impl_->Prepare(
      "INSERT OR REPLACE INTO depth_maps (keyframe, frame_index, settings, camera, image, estimate)"
      " VALUES (?, ?, ?, ?, ?, ?)",
      map.keyframe, map.frame_index, settings, sqlite::Blob{header}, sqlite::Blob{image},
      sqlite::Blob{estimate});
  insert.Run();
}

void DepthRecording::PutKept(const DepthMap& map) {
  const std::string kept = EncodeDepth(map.depth, impl_->metres);
  const std::string views =
      Deflate(std::string(map.views.begin<std::uint8_t>(), map.views.end<std::uint8_t>()));
  sqlite::Statement update = impl_->Prepare("UPDATE depth_maps SET kept = ?, views = ? WHERE keyframe = ?",
                                            sqlite::Blob{kept}, sqlite::Blob{views}, map.keyframe);
  update.Run();
}

void DepthRecording::Remove(std::int64_t keyframe) {
  sqlite::Statement remove = impl_->Prepare("DELETE FROM depth_maps WHERE keyframe = ?", keyframe);
  remove.Run();
}

void DepthRecording::PutText(const std::string& name, const std::string& text) {
  sqlite::Statement insert =
      impl_->Prepare("INSERT OR REPLACE INTO meta (key, value) VALUES ('dense.' || ?, ?)", name, text);
  insert.Run();
}

std::string DepthRecording::Text(const std::string& name) const {
  sqlite::Statement select = impl_->Prepare("SELECT value FROM meta WHERE key = 'dense.' || ?", name);
  return select.Next() ? select.Bytes(0) : "";
}

void DepthRecording::Close() {
  const sqlite::Database db = std::move(impl_->db);
  if (db && impl_->access == Access::kWrite) {
    sqlite::AbsorbLog(db.get(), impl_->path);
  }
}

}  // namespace sqslam
