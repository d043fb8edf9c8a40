#include "slam/snapshot/snapshot_codec.h"

#include <bit>
#include <cstdint>

#include "slam/snapshot/byte_archive.h"
#include "slam/util/error.h"
#include "slam/util/limits.h"
#include "slam/util/text_lines.h"

namespace sqslam {
namespace {

constexpr const char* kSnapshotName = "a snapshot";
constexpr int kDroppedBits = 8;  // of the coordinates of points

// Returns the bits of a 32-bit value, rounded to multiples of 2^dropped.
std::uint32_t RoundedBits(auto value, int dropped) {
  return (std::bit_cast<std::uint32_t>(value) + ((1U << dropped) >> 1)) >> dropped << dropped;
}

void VisitSize(ByteWriter& writer, const std::vector<SnapshotPoint>& points) {
  writer(static_cast<std::uint32_t>(points.size()));
}

void VisitSize(ByteReader& reader, std::vector<SnapshotPoint>& points) {
  constexpr std::size_t kLeastBytes = 19;  // of a point
  std::uint32_t size = 0;
  reader(size);
  // Never allocate for a broken count: a point's bytes are comparable to its memory.
  if (size > reader.BytesLeft() / kLeastBytes) {
    reader.Refuse("is cut off");
  }
  points.resize(size);
}

// Visits a column of 32-bit values by bytes of equal weight, lowest first, rounded to leave out `dropped`
// bits.
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
void VisitPoints(auto& archive, auto& points, int version) {
  VisitSize(archive, points);
  const auto column = [&](const auto& value_of) {
    for (auto& point : points) {
      archive(value_of(point));
    }
  };
  const auto wide_column = [&](int dropped, const auto& value_of) {
    if (version >= 8) {
      VisitPlanes(archive, points, dropped, value_of);
    } else {
      column(value_of);
    }
  };
  for (int i = 0; i < 3; ++i) {
    wide_column(
        8, [i](auto& point) -> auto& { return point.p_map[i]; });
  }
  for (std::size_t i = 0; i < 3; ++i) {
    column([i](auto& point) -> auto& { return point.rgb[i]; });
  }
  wide_column(
      0, [](auto& point) -> auto& { return point.object_id; });
  if (version >= 3) {
    wide_column(
        0, [](auto& point) -> auto& { return point.anomaly; });
    wide_column(
        0, [](auto& point) -> auto& { return point.rejected_by; });
  }
}

// Describes the layout once, for writing and for reading.
void Visit(auto& archive, auto& snapshot, int version) {
  auto& camera = snapshot.camera;
  archive(snapshot.sequence_number, snapshot.frame_index, snapshot.timestamp, snapshot.image_path);
  archive(camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy, camera.fps,
          camera.distortion);
  archive(snapshot.T_map_camera, snapshot.keyframes);
  VisitPoints(archive, snapshot.points, version);
  archive(snapshot.objects, snapshot.detections, snapshot.gravity_known, snapshot.support_height);
  if (version >= 4) {
    archive(snapshot.progress);
  }
  if (version >= 5) {
    archive(snapshot.covisibility);
  }
  if (version >= 6) {
    for (auto& object : snapshot.objects) {
      archive(object.fit.reliability);
    }
  }
}

// Sanitizes labels, and throws InputError for objects that cannot be drawn.
void Check(MapSnapshot& snapshot) {
  if (snapshot.objects.size() > kMaxObjects) {
    throw InputError("a snapshot has {} objects, expected at most {}", snapshot.objects.size(), kMaxObjects);
  }
  for (SnapshotObject& object : snapshot.objects) {
    const auto& [shape, T_map_object] = object.superquadric;
    const bool sized = shape.half_size.allFinite() && shape.half_size.minCoeff() >= 0.0 &&
                       shape.half_size.maxCoeff() <= kMaxMapUnits;
    const bool shaped = shape.e1 >= 0.0 && shape.e1 <= 2.0 && shape.e2 >= 0.0 && shape.e2 <= 2.0;
    if (!sized || !shaped || !(T_map_object.translation.norm() <= kMaxMapUnits)) {
      throw InputError("object {} of a snapshot has an impossible size, shape or place", object.id);
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

std::string EncodeSnapshot(const MapSnapshot& snapshot, int version) {
  ByteWriter writer;
  Visit(writer, snapshot, version);
  if (snapshot.camera.lens != LensModel::kRadialTangential) {  // such recordings are as they always were
    writer(snapshot.camera.lens);
  }
  return writer.Take();
}

MapSnapshot DecodeSnapshot(std::string_view raw, int version) {
  MapSnapshot snapshot;
  ByteReader reader(raw, kSnapshotName, ByteReader::Numbers::kAny);
  Visit(reader, snapshot, version);
  ReadLens(reader, snapshot.camera);
  if (!reader.AtEnd()) {
    throw InputError("a snapshot has another layout than its version");
  }
  Check(snapshot);
  return snapshot;
}

}  // namespace sqslam
