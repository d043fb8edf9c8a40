#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "slam/snapshot/map_scale.h"
#include "slam/snapshot/snapshot.h"

namespace sqslam {

struct RecordingInfo {
  std::string sequence_path;  // the mapped sequence, as stored; show it through ReplaceControls()
  std::string program_version;
  std::string config;                  // the whole configuration as YAML
  std::optional<MapScale> scale = {};  // if known, snapshots are read in metres
};

// Writes map.sqmap: an SQLite database (WAL) with one row per snapshot, each complete or a patch of the one
// before it, so that a few rows suffice to read any of them. Each Add is one transaction: a kill at any
// moment leaves a readable file.
class RecordingWriter {
 public:
  // Throws InputError if the file cannot be created or exists already.
  RecordingWriter(const std::filesystem::path& path, const RecordingInfo& info);
  ~RecordingWriter();
  RecordingWriter(RecordingWriter&&) noexcept;

  void Add(const MapSnapshot& snapshot);  // throws InputError on a full disk; earlier snapshots stay
  void Close();                           // merges the WAL into the one file; also done by the destructor

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// Changes the sequence of a finished recording. Throws InputError.
void SetSequencePath(const std::filesystem::path& path, const std::string& sequence_path);

// Appends a snapshot to a finished recording, in one transaction and in units of the map, even if the
// snapshot is in metres. Throws InputError.
void AppendToRecording(const std::filesystem::path& path, const MapSnapshot& snapshot);

class RecordingReader {
 public:
  // Changes each snapshot on reading, for example by edits of the map.
  using Edit = std::function<MapSnapshotPtr(MapSnapshotPtr)>;

  // Throws InputError if the file is missing, not a recording, or of another version.
  explicit RecordingReader(const std::filesystem::path& path, Edit edit = {});
  ~RecordingReader();
  RecordingReader(RecordingReader&&) noexcept;

  const RecordingInfo& Info() const;
  int Size() const;                      // number of snapshots
  MapSnapshotPtr Read(int index) const;  // index in [0, Size())
  MapSnapshotPtr Last() const;           // throws InputError if there is none
  // Frame and time of a snapshot, without reading it.
  std::int64_t FrameIndex(int index) const;
  double Timestamp(int index) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace sqslam
