#pragma once

#include <string>

#include "slam/snapshot/kept_map.h"
#include "slam/system.h"
#include "slam/system_options.h"

namespace sqslam {

// Merges two maps that show a common place: moves the second into the frame and scale of the first, fuses
// common points and objects, and optimises everything. The first keeps its ids; those of the second are
// raised, and so are its frames and times unless they are later anyway. Unconnected submaps of both are tried
// too. The names of the maps begin messages. Throws InputError if a map is broken or was made with another
// vocabulary, NoMapError if they show no common place.
RunResult MergeMaps(const KeptMap& first, const std::string& first_name, const KeptMap& second,
                    const std::string& second_name, const SystemOptions& options);

}  // namespace sqslam
