#pragma once

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

// Adds the map to a finished recording, in a table of its own (live_map) and in one transaction. Throws
// InputError.
void AddToRecording(const std::filesystem::path& recording, const KeptMap& map);

// Throws InputError where the file is no recording, older than version 7 (which kept pictures alone), of a
// run that was killed before it could keep its map, or damaged.
KeptMap ReadKeptMap(const std::filesystem::path& recording);

}  // namespace sqslam
