#include "slam/snapshot/snapshot_codec.h"

#include <bit>
#include <cstdint>

#include "slam/snapshot/byte_archive.h"
#include "slam/util/error.h"
#include "slam/util/limits.h"
#include "slam/util/text_lines.h"

namespace sqslam {
namespace {

constexpr int kDroppedBits = 8;  // of the coordinates of points

// Returns the bits of a 32-bit value, rounded to multiples of 2^dropped.
std::uint32_t RoundedBits(auto value, int dropped) {
  return (std::bit_cast<std::uint32_t>(value) + ((1U << dropped) >> 1)) >> dropped << dropped;
}

void VisitSize(ByteWriter& writer, const std::vector<SnapshotPoint>& points) {
  writer(static_cast<std::uint32_t>(points.size()));
}

void VisitSize(ByteReader& reader, std::vector<SnapshotPoint>& points) {
  constexpr std::size_t kPointBytes = 24;  // see VisitPoints()
  std::uint32_t size = 0;
  reader(size);
  // Never allocate for a broken count.
  if (size > reader.BytesLeft() / kPointBytes) {
    reader.Refuse("is cut off");
  }
  points.resize(size);
}

// Visits a column of 32-bit values by bytes of equal weight, lowest first, rounded to omit the lowest
// `dropped` bits.
void VisitPlanes(ByteWriter& writer, const std::vector<SnapshotPoint>& points, int dropped,
                 const auto& value_of) {
  for (int shift = dropped; shift < 32; shift += 8) {
    for (const SnapshotPoint& point : points) {
      writer(static_cast<std::uint8_t>(RoundedBits(value_of(point), dropped) >> shift));
    }
  }
}

void VisitPlanes(ByteReader& reader, std::vector<SnapshotPoint>& points, int dropped, const auto& value_of) {
  for (int shift = dropped; shift < 32; shift += 8) {
    for (SnapshotPoint& point : points) {
      std::uint8_t byte = 0;
      reader(byte);
      auto& value = value_of(point);
      const std::uint32_t lower = shift == dropped ? 0U : std::bit_cast<std::uint32_t>(value);
      value = std::bit_cast<std::remove_reference_t<decltype(value)>>(lower | std::uint32_t{byte} << shift);
    }
  }
}

// Points by columns, which compress better than rows.
void VisitPoints(auto& archive, auto& points) {
  VisitSize(archive, points);
  for (int i = 0; i < 3; ++i) {
    VisitPlanes(
        archive, points, kDroppedBits, [i](auto& point) -> auto& { return point.p_map[i]; });
  }
  for (std::size_t i = 0; i < 3; ++i) {
    for (auto& point : points) {
      archive(point.rgb[i]);
    }
  }
  VisitPlanes(
      archive, points, 0, [](auto& point) -> auto& { return point.object_id; });
  VisitPlanes(
      archive, points, 0, [](auto& point) -> auto& { return point.anomaly; });
  VisitPlanes(
      archive, points, 0, [](auto& point) -> auto& { return point.rejected_by; });
}

// Describes the layout once, for writing and for reading.
void Visit(auto& archive, auto& snapshot) {
  auto& camera = snapshot.camera;
  archive(snapshot.sequence_number, snapshot.frame_index, snapshot.timestamp, snapshot.image_path);
  archive(camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy, camera.fps,
          camera.distortion, camera.lens);
  archive(snapshot.T_map_camera, snapshot.keyframes);
  VisitPoints(archive, snapshot.points);
  archive(snapshot.objects, snapshot.detections, snapshot.gravity_known, snapshot.support_height);
  archive(snapshot.progress, snapshot.covisibility);
}

// Sanitizes labels, and throws InputError for objects that cannot be drawn.
void Check(MapSnapshot& snapshot) {
  if (!IsLensModel(snapshot.camera.lens)) {
    throw InputError("a snapshot has an unknown lens model");
  }
  if (snapshot.objects.size() > kMaxObjects) {
    throw InputError("a snapshot has {} objects, expected at most {}", snapshot.objects.size(), kMaxObjects);
  }
  for (SnapshotObject& object : snapshot.objects) {
    const auto& [shape, T_map_object] = object.superquadric;
    const bool sized = shape.half_size.allFinite() && shape.half_size.minCoeff() >= 0.0 &&
                       shape.half_size.maxCoeff() <= kMaxMapUnits;
    const bool shaped = shape.e1 >= 0.0 && shape.e1 <= 2.0 && shape.e2 >= 0.0 && shape.e2 <= 2.0;
    if (!sized || !shaped || !(T_map_object.translation.norm() <= kMaxMapUnits)) {
      throw InputError("object {} of a snapshot has a size, shape or position out of range", object.id);
    }
    object.label = ValidLabel(object.label);
  }
  for (SnapshotDetection& item : snapshot.detections) {
    item.detection.label = ValidLabel(item.detection.label);
  }
}

}  // namespace

Eigen::Vector3f RecordedPosition(const Eigen::Vector3d& p_map) {
  return p_map.cast<float>().unaryExpr(
      [](float value) { return std::bit_cast<float>(RoundedBits(value, kDroppedBits)); });
}

std::string EncodeSnapshot(const MapSnapshot& snapshot) {
  ByteWriter writer;
  Visit(writer, snapshot);
  return writer.Take();
}

MapSnapshot DecodeSnapshot(std::string_view raw) {
  MapSnapshot snapshot;
  ByteReader reader(raw, "a snapshot", ByteReader::Numbers::kAny);
  Visit(reader, snapshot);
  if (!reader.AtEnd()) {
    throw InputError("a snapshot has more bytes than its layout");
  }
  Check(snapshot);
  return snapshot;
}

}  // namespace sqslam
