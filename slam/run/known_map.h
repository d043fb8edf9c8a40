#pragma once

#include <filesystem>

#include "slam/io/sequence.h"
#include "slam/snapshot/kept_map.h"
#include "slam/system_options.h"

namespace sqslam {

// A kept map with the options of the run that made it.
struct KnownMap {
  std::filesystem::path recording;
  KeptMap map;
  SystemOptions options;
};

// The options that a result was made with. Throws InputError.
SystemOptions OptionsOfRun(const std::filesystem::path& result);

// `result`: a result folder or its map.sqmap. Throws InputError where it keeps no map that can be used.
KnownMap ReadKnownMap(const std::filesystem::path& result);

// Throws InputError that names `source` where its camera is not that of the map: another size, or a
// calibration that differs by more than refining it in a run would change it.
void CheckSameCamera(const std::filesystem::path& source, const Camera& camera, const KnownMap& map);

// Lists a sequence whose frames are to be found in the map. A camera without a calibration is taken to be
// that of the map. Throws InputError where it is another one: another size, or a calibration that differs by
// more than refining it in a run would change it.
Sequence OpenSequenceFor(const KnownMap& map, const SequenceRequest& request);

}  // namespace sqslam
