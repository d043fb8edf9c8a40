#include "slam/snapshot/recording.h"

#include <cstddef>
#include <mutex>
#include <ranges>
#include <stdexcept>
#include <utility>
#include <vector>

#include "slam/snapshot/byte_archive.h"
#include "slam/snapshot/object_parts.h"
#include "slam/snapshot/snapshot_codec.h"
#include "slam/snapshot/sqlite_file.h"
#include "slam/util/atomic_file.h"
#include "slam/util/error.h"
#include "slam/util/limits.h"
#include "slam/util/text_lines.h"

namespace sqslam {
namespace fs = std::filesystem;
using sqlite::Blob;
using sqlite::Database;
using sqlite::Execute;
using sqlite::Open;
using sqlite::Statement;
namespace {

constexpr int kMaxPatches = 64;  // in a row

// Serializes a snapshot in the map's own units, in which recordings store it.
std::string EncodeInUnits(const MapSnapshot& snapshot, const std::optional<MapScale>& scale) {
  if (!snapshot.metric || !scale) {
    return EncodeSnapshot(snapshot);
  }
  MapSnapshot in_units = snapshot;
  ScaleLengths(1.0 / scale->metres, in_units);
  return EncodeSnapshot(in_units);
}

// Decides for each snapshot whether it is stored complete or as a patch of the last one. A snapshot is
// complete whenever the patches since the last complete one take four times its size: a recording then grows
// with what changes, not with the map, and any snapshot is read in bounded time.
class SnapshotPacker {
 public:
  struct Packed {
    std::optional<std::int64_t> base;  // id of the snapshot that this one is a patch of
    std::string data;
  };

  Packed Pack(std::string raw, std::int64_t id) {
    constexpr std::size_t kPatchesPerComplete = 4;
    Packed packed;
    const bool follows = last_id_ && id == *last_id_ + 1;  // false if the last one could not be stored
    if (follows && patches_ < kMaxPatches && patch_bytes_ <= kPatchesPerComplete * complete_bytes_) {
      packed = {id - 1, PackPatch(raw, last_)};
      patch_bytes_ += packed.data.size();
      ++patches_;
    } else {
      packed = {std::nullopt, PackPatch(raw, {})};
      complete_bytes_ = packed.data.size();
      patch_bytes_ = 0;
      patches_ = 0;
    }
    last_ = std::move(raw);
    last_id_ = id;
    return packed;
  }

  std::int64_t LastId() const { return last_id_.value(); }
  bool IsLastComplete() const { return patches_ == 0; }
  std::string LastComplete() const { return PackPatch(last_, {}); }

 private:
  std::string last_;  // serialized
  std::optional<std::int64_t> last_id_;
  std::size_t complete_bytes_ = 0;
  std::size_t patch_bytes_ = 0;  // since the last complete one
  int patches_ = 0;
};

// Makes a recording without snapshots. It appears whole: a program killed on the way leaves none.
void Create(const fs::path& path, const RecordingInfo& info) {
  AtomicPath draft(path);
  {
    const Database db = Open(draft.Path(), SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE);
    Execute(db.get(), path,
            "PRAGMA page_size=8192; PRAGMA journal_mode=OFF; BEGIN;"
            "CREATE TABLE meta (key TEXT PRIMARY KEY, value TEXT NOT NULL);"
            "CREATE TABLE snapshots (id INTEGER PRIMARY KEY, frame_index INTEGER NOT NULL, timestamp REAL "
            "NOT NULL,"
            " base INTEGER, data BLOB NOT NULL);"
            "CREATE TABLE live_map (piece INTEGER PRIMARY KEY, data BLOB NOT NULL);"
            "CREATE TABLE depth_maps (keyframe INTEGER PRIMARY KEY, frame_index INTEGER NOT NULL,"
            " settings TEXT NOT NULL, camera BLOB NOT NULL, image BLOB NOT NULL, estimate BLOB NOT NULL,"
            " kept BLOB, views BLOB);");
    const auto set = [&](std::string_view key, std::string_view value) {
      Statement(db.get(), path, "INSERT INTO meta (key, value) VALUES (?, ?)", key, value).Run();
    };
    set("format", kRecordingFormat);
    set("version", std::to_string(kRecordingVersion));
    set("sequence_path", info.sequence_path);
    set("program_version", info.program_version);
    set("config", info.config);
    Execute(db.get(), path, "COMMIT");
  }
  draft.CommitNew();  // fails for the second of two programs with one folder
}

}  // namespace

struct RecordingWriter::Impl {
  fs::path path;
  Database db;
  std::optional<MapScale> scale;
  SnapshotPacker packer;
  std::int64_t next = 0;

  // Stores the newest snapshot, which is read most, complete: damage to others does not reach it.
  void CompleteLast() {
    if (!packer.IsLastComplete()) {
      const std::string data = packer.LastComplete();
      Statement(db.get(), path, "UPDATE snapshots SET base = NULL, data = ? WHERE id = ?", Blob{data},
                packer.LastId())
          .Run();
    }
  }
};

RecordingWriter::RecordingWriter(const fs::path& path, const RecordingInfo& info)
    : impl_(std::make_unique<Impl>()) {
  impl_->path = path;
  Create(path, info);
  impl_->db = Open(path, SQLITE_OPEN_READWRITE | SQLITE_OPEN_FULLMUTEX);
  // WAL: a commit is one append; NORMAL: a killed process loses nothing, a power cut only the last snapshots.
  Execute(impl_->db.get(), path, "PRAGMA journal_mode=WAL; PRAGMA synchronous=NORMAL;");
  if (info.scale) {
    StoreMapScale(path, info.scale);
    impl_->scale = info.scale;
  }
}

RecordingWriter::~RecordingWriter() {
  try {
    if (impl_) {
      Close();
    }
  } catch (const InputError&) {
    // The file is readable with its WAL beside it; a destructor cannot report the error.
  }
}

RecordingWriter::RecordingWriter(RecordingWriter&&) noexcept = default;

void RecordingWriter::Add(const MapSnapshot& snapshot) {
  if (!impl_->db) {
    throw std::logic_error("snapshot added to a recording that is closed");
  }
  const auto [base, data] = impl_->packer.Pack(EncodeInUnits(snapshot, impl_->scale), impl_->next);
  Statement(impl_->db.get(), impl_->path,
            "INSERT INTO snapshots (id, frame_index, timestamp, base, data) VALUES (?, ?, ?, ?, ?)",
            impl_->next, snapshot.frame_index, snapshot.timestamp, base, Blob{data})
      .Run();
  ++impl_->next;
}

void RecordingWriter::Close() {
  if (!impl_->db) {
    return;
  }
  impl_->CompleteLast();
  const Database db = std::move(impl_->db);
  sqlite::AbsorbLog(db.get(), impl_->path);
}

void AppendToRecording(const fs::path& path, const MapSnapshot& snapshot) {
  const std::string data = PackPatch(EncodeInUnits(snapshot, ReadMapScale(path)), {});
  const Database db = sqlite::OpenRecording(path, SQLITE_OPEN_READWRITE);
  Statement(db.get(), path,
            "INSERT INTO snapshots (id, frame_index, timestamp, data)"
            " SELECT MAX(id) + 1, ?, ?, ? FROM snapshots",
            snapshot.frame_index, snapshot.timestamp, Blob{data})
      .Run();
}

void SetSequencePath(const fs::path& path, const std::string& sequence_path) {
  const Database db = sqlite::OpenRecording(path, SQLITE_OPEN_READWRITE);
  Statement(db.get(), path, "UPDATE meta SET value = ? WHERE key = 'sequence_path'", sequence_path).Run();
}

struct RecordingReader::Impl {
  fs::path path;
  Database db;
  RecordingInfo info;
  std::vector<ObjectParts> parts;
  std::vector<std::pair<std::int64_t, double>> frames;  // index and time of each snapshot's frame
  Edit edit;
  std::mutex mutex;  // guards the snapshot read last, which the next one may be a patch of
  std::int64_t last = -1;
  std::string last_raw;  // serialized

  std::string Meta(std::string_view key) const {
    Statement select(db.get(), path, "SELECT value FROM meta WHERE key = ?", key);
    return select.Next() ? select.Bytes(0) : "";
  }

  struct Row {
    std::optional<std::int64_t> base;
    std::string data;
  };
  Row ReadRow(std::int64_t id) const;
  std::string ReadRaw(std::int64_t id);
};

RecordingReader::Impl::Row RecordingReader::Impl::ReadRow(std::int64_t id) const {
  Statement select(db.get(), path, "SELECT data, base FROM snapshots WHERE id = ?", id);
  if (!select.Next()) {
    throw InputError("needs snapshot {}, which is missing", id);
  }
  Row row{std::nullopt, select.Bytes(0)};
  if (!select.IsNull(1)) {
    row.base = select.Int(1);
  }
  return row;
}

// Returns a snapshot's serialized bytes: the nearest complete one before it, or the one read last, with the
// patches from there.
std::string RecordingReader::Impl::ReadRaw(std::int64_t id) {
  const std::lock_guard lock(mutex);
  std::vector<std::string> patches;  // newest first
  std::string raw;
  for (std::int64_t at = id;;) {
    if (at == last) {
      raw = last_raw;
      break;
    }
    Row row = ReadRow(at);
    if (row.base && (*row.base >= at || patches.size() >= kMaxPatches)) {
      throw InputError("is a patch of snapshot {}, expected an earlier one and at most {} patches in a row",
                       *row.base, kMaxPatches);
    }
    patches.push_back(std::move(row.data));
    if (!row.base) {
      break;
    }
    at = *row.base;
  }
  for (const std::string& patch : std::views::reverse(patches)) {
    raw = UnpackPatch(patch, raw, kMaxSnapshotBytes, "its state");
  }
  last = id;
  last_raw = raw;
  return raw;
}

namespace {

// Completes or undoes the changes of other programs: a killed one leaves a log or a journal beside the
// recording, one that ended while another was reading leaves a log. SQLite rolls a journal back when the
// recording is opened for writing.
void RecoverInterruptedWrites(const fs::path& path) {
  std::error_code none;
  if (!fs::exists(path.string() + "-wal", none) && !fs::exists(path.string() + "-journal", none)) {
    return;
  }
  try {
    const Database db = sqlite::OpenRecording(path, SQLITE_OPEN_READWRITE);
    sqlite3_busy_timeout(db.get(), 0);
    sqlite::AbsorbLog(db.get(), path);
  } catch (const InputError&) {  // in a folder that is read-only: the recording is read with its log
  }
}

}  // namespace

RecordingReader::RecordingReader(const fs::path& path, Edit edit) : impl_(std::make_unique<Impl>()) {
  RecoverInterruptedWrites(path);
  impl_->path = path;
  impl_->edit = std::move(edit);
  impl_->db = sqlite::OpenRecording(path, SQLITE_OPEN_READONLY);
  impl_->info = {impl_->Meta("sequence_path"), ReplaceControls(impl_->Meta("program_version")),
                 ReplaceControlsInLines(impl_->Meta("config")), ReadMapScale(path)};
  impl_->parts = ReadObjectParts(path);
  Statement select(impl_->db.get(), path, "SELECT frame_index, timestamp FROM snapshots ORDER BY id");
  while (select.Next()) {
    impl_->frames.emplace_back(select.Int(0), select.Real(1));
  }
}

RecordingReader::~RecordingReader() = default;
RecordingReader::RecordingReader(RecordingReader&&) noexcept = default;

const RecordingInfo& RecordingReader::Info() const { return impl_->info; }
int RecordingReader::Size() const { return static_cast<int>(impl_->frames.size()); }

std::int64_t RecordingReader::FrameIndex(int index) const {
  return impl_->frames.at(static_cast<std::size_t>(index)).first;
}

double RecordingReader::Timestamp(int index) const {
  return impl_->frames.at(static_cast<std::size_t>(index)).second;
}

MapSnapshotPtr RecordingReader::Read(int index) const {
  if (index < 0 || index >= Size()) {
    throw InputError("{}: no snapshot {}, expected 0 to {}", impl_->path.string(), index, Size() - 1);
  }
  try {
    auto snapshot = std::make_shared<MapSnapshot>(DecodeSnapshot(impl_->ReadRaw(index)));
    AddParts(impl_->parts, *snapshot);
    if (impl_->info.scale) {
      ScaleLengths(impl_->info.scale->metres, *snapshot);
      snapshot->metric = true;
    }
    return impl_->edit ? impl_->edit(std::move(snapshot)) : snapshot;
  } catch (const InputError& e) {
    throw InputError("{}: snapshot {}: {}", impl_->path.string(), index, e.what());
  }
}

MapSnapshotPtr RecordingReader::Last() const {
  if (Size() == 0) {
    throw InputError("{}: contains no snapshot, expected a map", impl_->path.string());
  }
  return Read(Size() - 1);
}

}  // namespace sqslam
