#include "slam/snapshot/saved_map.h"

#include <string>
#include <string_view>
#include <vector>

#include "slam/snapshot/byte_archive.h"
#include "slam/snapshot/recording.h"
#include "slam/snapshot/sqlite_file.h"
#include "slam/util/limits.h"
#include "slam/util/throw_if.h"

namespace sqslam {
namespace {

bool IsUsableCamera(const Camera& c) {
  const auto side = [](int pixels) { return pixels >= kMinImageSide && pixels <= kMaxImageSide; };
  return side(c.width) && side(c.height) && c.fx > 0.0 && c.fy > 0.0 && IsLensModel(c.lens);
}

constexpr std::size_t kPieceBytes = std::size_t{4} << 20;  // a row of SQLite holds less than a gigabyte

std::vector<std::string> PackPieces(std::string_view bytes) {
  std::vector<std::string> pieces;
  for (std::size_t begin = 0; begin < bytes.size(); begin += kPieceBytes) {
    pieces.push_back(PackPatch(bytes.substr(begin, kPieceBytes), {}));
  }
  return pieces;
}

}  // namespace

void SaveMapInRecording(const std::filesystem::path& recording, const SavedMap& map) {
  ByteWriter writer;
  writer(map);
  const std::vector<std::string> pieces = PackPieces(writer.Bytes());  // before the file is locked
  const sqlite::Database db = sqlite::OpenRecording(recording, SQLITE_OPEN_READWRITE);
  sqlite::Execute(db.get(), recording, "BEGIN IMMEDIATE; DELETE FROM live_map;");
  for (const std::string& piece : pieces) {
    sqlite::Statement(db.get(), recording, "INSERT INTO live_map (data) VALUES (?)", sqlite::Blob{piece})
        .Run();
  }
  sqlite::Execute(db.get(), recording, "COMMIT");
}

SavedMap ReadSavedMap(const std::filesystem::path& recording) {
  RecordingReader{recording};  // undoes or completes the changes of killed programs
  const sqlite::Database db = sqlite::OpenRecording(recording, SQLITE_OPEN_READONLY);
  const std::string what = recording.string() + ": its live map";
  std::string bytes;
  sqlite::Statement select(db.get(), recording, "SELECT data FROM live_map ORDER BY piece");
  while (select.Next()) {
    bytes += UnpackPatch(select.Bytes(0), {}, kPieceBytes, what);
  }
  ThrowIf<InputError>(bytes.empty(), "{}: holds no map to continue, expected the recording of a finished run",
                      recording.string());
  ByteReader reader(bytes, what);
  SavedMap map;
  reader(map);
  if (!reader.AtEnd() || !IsUsableCamera(map.camera)) {
    reader.Refuse("is broken");
  }
  return map;
}

}  // namespace sqslam
