#pragma once

#include <string>

#include "slam/snapshot/kept_map.h"
#include "slam/system.h"
#include "slam/system_options.h"

namespace sqslam {

// Makes one map of two that show a common place: the second is brought into the frame and the scale of the
// first, points and objects that are the same are fused, and all is optimised. The first keeps its ids; those
// of the second are raised, and so are its frames and times unless they are later anyway. Parts of either
// that had stayed apart are tried as well. The names of the maps stand at the beginning of messages. Throws
// InputError where a map is broken or was made with other visual words, NoMapError where they show no common
// place.
RunResult MergeMaps(const KeptMap& first, const std::string& first_name, const KeptMap& second,
                    const std::string& second_name, const SystemOptions& options);

}  // namespace sqslam
