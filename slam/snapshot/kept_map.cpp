#include "slam/snapshot/kept_map.h"

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "slam/snapshot/byte_archive.h"
#include "slam/snapshot/recording.h"
#include "slam/snapshot/sqlite_file.h"
#include "slam/util/limits.h"

namespace sqslam {
namespace {

// A row of SQLite holds less than a gigabyte; small pieces need no second copy of the map in memory.
constexpr std::size_t kPieceBytes = std::size_t{4} << 20;
constexpr int kFirstVersion = 7;  // of the recordings that keep their maps

bool IsCamera(const Camera& c) {
  const auto side = [](int pixels) { return pixels >= kMinImageSide && pixels <= kMaxImageSide; };
  return side(c.width) && side(c.height) && c.fx > 0.0 && c.fy > 0.0;
}

// Serializes and packs a map piece by piece.
std::vector<std::string> PackPieces(const KeptMap& map) {
  ByteWriter begin;
  begin(map.camera, map.vocabulary, static_cast<std::uint32_t>(map.state.size()));
  ByteWriter end;
  if (map.camera.lens != LensModel::kRadialTangential) {
    end(map.camera.lens);
  }
  std::vector<std::string> pieces;
  std::string piece;
  for (std::string_view part :
       {std::string_view(begin.Bytes()), std::string_view(map.state), std::string_view(end.Bytes())}) {
    while (!part.empty()) {
      const std::string_view fits = part.substr(0, kPieceBytes - piece.size());
      piece += fits;
      part.remove_prefix(fits.size());
      if (piece.size() == kPieceBytes) {
        pieces.push_back(PackBytes(piece));
        piece.clear();
      }
    }
  }
  if (!piece.empty()) {
    pieces.push_back(PackBytes(piece));
  }
  return pieces;
}

}  // namespace

void KeepInRecording(const std::filesystem::path& recording, const KeptMap& map) {
  const std::vector<std::string> pieces = PackPieces(map);  // before the file is locked
  const sqlite::Database db = sqlite::OpenRecording(recording, SQLITE_OPEN_READWRITE);
  sqlite::Execute(db.get(), recording,
                  "BEGIN IMMEDIATE; CREATE TABLE IF NOT EXISTS live_map"
                  " (piece INTEGER PRIMARY KEY, data BLOB NOT NULL); DELETE FROM live_map;");
  for (const std::string& piece : pieces) {
    sqlite::Statement(db.get(), recording, "INSERT INTO live_map (data) VALUES (?)", sqlite::Blob{piece})
        .Run();
  }
  sqlite::Execute(db.get(), recording, "COMMIT");
}

KeptMap ReadKeptMap(const std::filesystem::path& recording) {
  const int version = RecordingReader(recording).Version();  // throws if it is no recording
  if (version < kFirstVersion) {
    throw InputError(
        "{}: version {} stores its map without keypoints and descriptors, expected version {} or newer (map "
        "the sequence again)",
        recording.string(), version, kFirstVersion);
  }
  const sqlite::Database db = sqlite::OpenRecording(recording, SQLITE_OPEN_READONLY);
  const std::string what = recording.string() + ": its live map";
  std::string bytes;
  if (!sqlite::Statement(db.get(), recording, "SELECT 1 FROM sqlite_master WHERE name = 'live_map'").Next()) {
    throw InputError("{}: holds no map to continue, expected the recording of a finished run",
                     recording.string());
  }
  sqlite::Statement select(db.get(), recording, "SELECT data FROM live_map ORDER BY piece");
  while (select.Next()) {
    bytes += UnpackBytes(select.Bytes(0), what);
  }
  ByteReader reader(bytes, what);
  KeptMap map;
  reader(map.camera, map.vocabulary, map.state);
  ReadLens(reader, map.camera);
  if (!reader.AtEnd() || !IsCamera(map.camera)) {
    reader.Refuse("is broken");
  }
  return map;
}

}  // namespace sqslam
