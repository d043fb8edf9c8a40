#include "slam/snapshot/snapshot_codec.h"

#include <cstring>
#include <type_traits>

#include "slam/snapshot/byte_archive.h"
#include "slam/util/error.h"
#include "slam/util/limits.h"
#include "slam/util/text_lines.h"

namespace sqslam {
namespace {

// The Visit functions below describe the layout once, for writing and for reading.
class Writer {
 public:
  static constexpr int Version() { return kSnapshotFormatVersion; }
  template <typename Value>
  requires std::is_arithmetic_v<Value>
  void operator()(const Value& value) { bytes_.append(reinterpret_cast<const char*>(&value), sizeof(value)); }
  void operator()(const std::string& text) {
    (*this)(static_cast<std::uint32_t>(text.size()));
    bytes_ += text;
  }
  template <typename Item>
  std::size_t Size(const std::vector<Item>& items) {
    (*this)(static_cast<std::uint32_t>(items.size()));
    return items.size();
  }
  template <typename Value>
  bool Present(const std::optional<Value>& value) {
    (*this)(static_cast<std::uint8_t>(value.has_value()));
    return value.has_value();
  }
  std::string Take() { return std::move(bytes_); }

 private:
  std::string bytes_;
};

// Fewest bytes of an item, for types that take many.
template <typename Item>
constexpr std::size_t kLeastBytes = 4;
template <>
constexpr std::size_t kLeastBytes<SnapshotPoint> = 19;
template <>
constexpr std::size_t kLeastBytes<SnapshotKeyframe> = 80;
template <>
constexpr std::size_t kLeastBytes<SnapshotObject> = 81 * sizeof(double);

class Reader {
 public:
  Reader(std::string_view bytes, int version) : version_(version), bytes_(bytes) {}
  int Version() const { return version_; }
  bool AtEnd() const { return bytes_.empty(); }

  template <typename Value>
  requires std::is_arithmetic_v<Value>
  void operator()(Value& value) { std::memcpy(&value, Take(sizeof(value)).data(), sizeof(value)); }
  void operator()(std::string& text) {
    std::uint32_t size = 0;
    (*this)(size);
    text = std::string(Take(size));
  }
  template <typename Item>
  std::size_t Size(std::vector<Item>& items) {
    std::uint32_t size = 0;
    (*this)(size);
    // Never allocate for a broken count: an item's bytes here are comparable to its memory.
    if (size > bytes_.size() / kLeastBytes<Item>) {
      throw InputError("a snapshot is cut off");
    }
    items.resize(size);
    return size;
  }
  template <typename Value>
  bool Present(std::optional<Value>& value) {
    std::uint8_t present = 0;
    (*this)(present);
    if (present != 0) {
      value.emplace();
    }
    return present != 0;
  }

 private:
  std::string_view Take(std::size_t size) {
    if (size > bytes_.size()) {
      throw InputError("a snapshot is cut off");
    }
    const std::string_view taken = bytes_.substr(0, size);
    bytes_.remove_prefix(size);
    return taken;
  }

  int version_;
  std::string_view bytes_;
};

// Below, `Like<Archive, T>` is `const T&` for the writer and `T&` for the reader.
template <typename Archive, typename T>
using Like = std::conditional_t<std::is_same_v<Archive, Writer>, const T&, T&>;

template <typename Archive, typename... Values>
void VisitValues(Archive& archive, Values&... values) {
  (archive(values), ...);
}

template <typename Archive>
void Visit(Archive& archive, Like<Archive, Rigid3d> pose) {
  auto& q = pose.rotation.coeffs();
  auto& t = pose.translation;
  VisitValues(archive, q[0], q[1], q[2], q[3], t[0], t[1], t[2]);
}

template <typename Archive>
void Visit(Archive& archive, Like<Archive, Camera> camera) {
  VisitValues(archive, camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy, camera.fps);
  for (auto& coefficient : camera.distortion) {
    archive(coefficient);
  }
}

template <typename Archive>
void VisitPoints(Archive& archive, Like<Archive, std::vector<SnapshotPoint>> points) {
  archive.Size(points);
  const auto column = [&](const auto& value_of) {
    for (auto& point : points) {
      archive(value_of(point));
    }
  };
  for (int i = 0; i < 3; ++i) {
    column([i](auto& point) -> auto& { return point.p_map[i]; });
  }
  for (std::size_t i = 0; i < 3; ++i) {
    column([i](auto& point) -> auto& { return point.rgb[i]; });
  }
  column([](auto& point) -> auto& { return point.object_id; });
  if (archive.Version() >= 3) {
    column([](auto& point) -> auto& { return point.anomaly; });
    column([](auto& point) -> auto& { return point.rejected_by; });
  }
}

template <typename Archive>
void Visit(Archive& archive, Like<Archive, SnapshotObject> object) {
  auto& shape = object.superquadric.shape;
  auto& size = shape.half_size;
  VisitValues(archive, object.id, object.label, object.score, object.observations, object.points, object.yaw,
              size[0], size[1], size[2], shape.e1, shape.e2);
  Visit(archive, object.superquadric.T_map_object);
  VisitValues(archive, object.fit.box_agreement, object.fit.point_rms);
  for (int i = 0; i < 9; ++i) {
    for (int j = 0; j < 9; ++j) {
      archive(object.fit.covariance(i, j));
    }
  }
}

template <typename Archive>
void Visit(Archive& archive, Like<Archive, SnapshotDetection> item) {
  auto& box = item.detection.box;
  VisitValues(archive, item.detection.label, item.detection.score, box.x, box.y, box.width, box.height,
              item.object_id);
}

template <typename Archive>
void Visit(Archive& archive, Like<Archive, SnapshotKeyframe> keyframe) {
  VisitValues(archive, keyframe.id, keyframe.frame_index, keyframe.timestamp);
  Visit(archive, keyframe.T_map_camera);
}

template <typename Archive>
void Visit(Archive& archive, Like<Archive, SnapshotCovisibility> pair) {
  VisitValues(archive, pair.first, pair.second, pair.points);
}

template <typename Archive>
void Visit(Archive& archive, Like<Archive, SnapshotProgress> progress) {
  VisitValues(archive, progress.tracked_points, progress.tracking_ms, progress.mapping_ms,
              progress.counters.loops, progress.counters.merges);
}

template <typename Archive, typename Items>
void VisitAll(Archive& archive, Items& items) {
  archive.Size(items);
  for (auto& item : items) {
    Visit(archive, item);
  }
}

template <typename Archive>
void Visit(Archive& archive, Like<Archive, MapSnapshot> snapshot) {
  VisitValues(archive, snapshot.sequence_number, snapshot.frame_index, snapshot.timestamp,
              snapshot.image_path);
  Visit(archive, snapshot.camera);
  if (archive.Present(snapshot.T_map_camera)) {
    Visit(archive, *snapshot.T_map_camera);
  }
  VisitAll(archive, snapshot.keyframes);
  VisitPoints(archive, snapshot.points);
  VisitAll(archive, snapshot.objects);
  VisitAll(archive, snapshot.detections);
  archive(snapshot.gravity_known);
  if (archive.Present(snapshot.support_height)) {
    archive(*snapshot.support_height);
  }
  if (archive.Version() >= 4 && archive.Present(snapshot.progress)) {
    Visit(archive, *snapshot.progress);
  }
  if (archive.Version() >= 5) {
    VisitAll(archive, snapshot.covisibility);
  }
  if (archive.Version() >= 6) {
    for (auto& object : snapshot.objects) {
      archive(object.fit.reliability);
    }
  }
}

// Sanitizes labels, and throws InputError for objects that cannot be drawn.
void Check(MapSnapshot& snapshot) {
  for (SnapshotObject& object : snapshot.objects) {
    const auto& [shape, T_map_object] = object.superquadric;
    const bool sized = shape.half_size.minCoeff() >= 0.0 && shape.half_size.maxCoeff() <= kMaxMapUnits;
    const bool shaped = shape.e1 >= 0.0 && shape.e1 <= 2.0 && shape.e2 >= 0.0 && shape.e2 <= 2.0;
    if (!sized || !shaped || !(T_map_object.translation.norm() <= kMaxMapUnits)) {
      throw InputError("object {} of a snapshot has an impossible size, shape or place", object.id);
    }
    object.label = ValidText(object.label).substr(0, kMaxLabelBytes);
  }
  for (SnapshotDetection& item : snapshot.detections) {
    item.detection.label = ValidText(item.detection.label).substr(0, kMaxLabelBytes);
  }
}

}  // namespace

std::string EncodeSnapshot(const MapSnapshot& snapshot) {
  Writer writer;
  Visit(writer, snapshot);
  return PackBytes(writer.Take());
}

MapSnapshot DecodeSnapshot(std::string_view bytes, int version) {
  const std::string raw = UnpackBytes(bytes, "a snapshot");
  MapSnapshot snapshot;
  Reader reader(raw, version);
  Visit(reader, snapshot);
  if (!reader.AtEnd()) {
    throw InputError("a snapshot has another layout than its version");
  }
  Check(snapshot);
  return snapshot;
}

}  // namespace sqslam
