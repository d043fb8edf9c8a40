#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "slam/geometry/camera.h"

namespace sqslam {

// The live map at the end of a run: all that mapping on and finding the way in it take. A snapshot is a
// picture of a map, this is the map.
struct KeptMap {
  Camera camera;           // that the map was made with
  std::string vocabulary;  // fingerprint of the visual words (Vocabulary::Fingerprint); empty: none
  std::string state;       // what Mapper::Save wrote
};

// The frames that were added to a kept map: the number of the first in the map, and by how much their numbers
// and times (s) in the map exceed those in their own sequence.
struct AddedFrames {
  std::int64_t first = 0;
  std::int64_t index_shift = 0;
  double time_shift = 0.0;
};

// Puts the map into a recording in place of the one that is there, in a table of its own (live_map) and in
// one transaction: who reads finds the one or the other whole. Throws InputError.
void KeepInRecording(const std::filesystem::path& recording, const KeptMap& map);

// Throws InputError where the file is no recording, older than version 7 (which kept pictures alone), of a
// run that was killed before it first kept its map, or damaged.
KeptMap ReadKeptMap(const std::filesystem::path& recording);

}  // namespace sqslam
