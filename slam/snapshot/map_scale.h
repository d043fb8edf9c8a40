#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "slam/snapshot/snapshot.h"

namespace sqslam {

// The length of a map unit in metres, found from a thing of known size. The map itself stays in its own
// units; readers of its recording see metres.
struct MapScale {
  double metres = 1.0;     // of a map unit
  double deviation = 0.0;  // standard deviation of `metres`
  std::string source;      // in words: what was known

  bool operator==(const MapScale&) const = default;
};

// Returns "1 map unit is 2.06 m, give or take 0.05 (2.4 %): by the height of 4 cup, 0.096 m".
std::string ScaleText(const MapScale& scale);

// Multiplies every length in the snapshot, covariances with them.
void ScaleLengths(double factor, MapSnapshot& snapshot);

// The scale that a recording keeps; empty where it has none. Throws InputError where it is broken.
std::optional<MapScale> ReadMapScale(const std::filesystem::path& recording);

// Keeps a scale in a finished recording in place of the one that is there, or takes it away. Throws
// InputError.
void KeepMapScale(const std::filesystem::path& recording, const std::optional<MapScale>& scale);

}  // namespace sqslam
