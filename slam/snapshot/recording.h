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
  std::string sequence_path;  // the sequence that was mapped
  std::string program_version;
  std::string config;                  // the whole configuration as YAML
  std::optional<MapScale> scale = {};  // where it is known, states are read in metres
};

// Writes map.sqmap: one SQLite database (WAL), one row per snapshot, each snapshot complete
// (zlib-compressed), so that any can be read alone. Each Add is one transaction: a kill at any moment leaves
// a readable file.
class RecordingWriter {
 public:
  // Throws InputError where the file cannot be made or exists already.
  RecordingWriter(const std::filesystem::path& path, const RecordingInfo& info);
  ~RecordingWriter();
  RecordingWriter(RecordingWriter&&) noexcept;

  void Add(const MapSnapshot& snapshot);  // throws InputError on a full disk; what was added before stays
  void Close();                           // folds the WAL into the one file; also done by the destructor

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// Says anew where the images of a finished recording lie. Throws InputError.
void SetSequencePath(const std::filesystem::path& path, const std::string& sequence_path);

// Adds a state to a finished recording, in one transaction and in the units of its map, also where the state
// is in metres. Throws InputError.
void AppendToRecording(const std::filesystem::path& path, const MapSnapshot& snapshot);

class RecordingReader {
 public:
  // Changes what is read, such as edits of the map do: whoever reads sees only the changed snapshots.
  using Edit = std::function<MapSnapshotPtr(MapSnapshotPtr)>;

  // Throws InputError where the file is missing or is no recording.
  explicit RecordingReader(const std::filesystem::path& path, Edit edit = {});
  ~RecordingReader();
  RecordingReader(RecordingReader&&) noexcept;

  const RecordingInfo& Info() const;
  int Version() const;                   // of the format that it is written in
  int Size() const;                      // number of snapshots
  MapSnapshotPtr Read(int index) const;  // index in [0, Size())
  MapSnapshotPtr Last() const;           // throws InputError where there is none
  // Frame and time of a snapshot without reading it.
  std::int64_t FrameIndex(int index) const;
  double Timestamp(int index) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace sqslam
