#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "slam/io/map_frame.h"
#include "slam/snapshot/object_account.h"
#include "slam/snapshot/snapshot.h"
#include "slam/util/run_counters.h"
#include "slam/util/stage_times.h"

namespace sqslam {

// Returns `name` in a result folder, or the file itself.
inline std::filesystem::path ResultFile(const std::filesystem::path& result, const char* name) {
  return std::filesystem::is_directory(result) ? result / name : result;
}

// points.ply: binary little-endian PLY with x y z red green blue object_id (-1 for none).
void WritePoints(const std::filesystem::path& path, const std::vector<SnapshotPoint>& points,
                 const MapFrame& frame);

// objects.json: {"format": "sqslam-objects", "version": 1, "unit": "map units" or "metres", "frame": "map",
// "gravity_aligned": true or false, "objects": [...]}, angles in radians, T_map_object as four rows. Without
// `frame` (objects of a cloud in a file) the three are left out. Reading accepts the matrix as rows or as 16
// numbers, and throws InputError that names the broken object.
void WriteObjects(const std::filesystem::path& path, const std::vector<SnapshotObject>& objects,
                  const std::optional<MapFrame>& frame = {});
std::vector<SnapshotObject> ReadObjects(const std::filesystem::path& path);

// The contents of stats.json.
struct RunStats {
  int frames = 0;           // read and handed to the tracker
  int skipped = 0;          // frames that could not be read
  int dropped = 0;          // frames that came too fast (--realtime, live cameras)
  int detector_frames = 0;  // frames that the run's detector processed itself
  int tracked = 0;
  int keyframes = 0;
  int points = 0;
  int objects = 0;
  int uncertain = 0;      // of the objects: those of low reliability
  ObjectAccount classes;  // also of maps that could not be merged with the main one
  RunCounters counters;
  int submaps = 0;            // maps that could not be merged with the main one
  bool interrupted = false;   // ended by Ctrl-C
  double wall_seconds = 0.0;  // from the first frame to the last optimisation
  double peak_memory_mib = 0.0;
  std::string version;   // of the program
  std::string host;      // name of the computer
  std::string job;       // of Slurm, see SlurmJob; empty: none
  std::string command;   // command line of the run, as typed
  std::string camera;    // how the focal length was found, in words
  std::string detector;  // where the boxes came from, in words
  std::vector<std::string> warnings;
  std::map<std::string, StageTimes::Summary> timing_ms;
};

void WriteStats(const std::filesystem::path& path, const RunStats& stats);
RunStats ReadStats(const std::filesystem::path& path);

}  // namespace sqslam
