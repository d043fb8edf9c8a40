#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "slam/geometry/camera.h"

namespace sqslam {

// The live map at the end of a run, from which it can be extended or localised in. A snapshot only shows a
// map.
struct SavedMap {
  Camera camera;           // that the map was made with
  std::string vocabulary;  // fingerprint of the vocabulary (Vocabulary::Fingerprint); empty: none
  std::string state;       // written by Mapper::Save

  static void VisitState(auto& self, auto&& visit) { visit(self.camera, self.vocabulary, self.state); }
};

// Frames that were added to a saved map: the index of the first one in the map, and the shifts of indices and
// times (s) from their own sequence to the map.
struct AddedFrames {
  std::int64_t first = 0;
  std::int64_t index_shift = 0;
  double time_shift = 0.0;
};

// Stores the map in a recording, replacing an earlier one, in a table of its own (live_map) and in one
// transaction: readers find the old or the new map. Throws InputError.
void SaveMapInRecording(const std::filesystem::path& recording, const SavedMap& map);

// Throws InputError if the file is no recording, if its run was killed before it first saved its map, or if
// the map is damaged.
SavedMap ReadSavedMap(const std::filesystem::path& recording);

}  // namespace sqslam
