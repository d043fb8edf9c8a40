#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "slam/snapshot/snapshot.h"

namespace sqslam {

// Length of a map unit in metres, from a reference of known size. The map itself stays in its own units;
// readers of its recording get metres.
struct MapScale {
  double metres = 1.0;     // of a map unit
  double deviation = 0.0;  // standard deviation of `metres`
  std::string source;      // the reference, in words

  bool operator==(const MapScale&) const = default;
};

// Returns "1 map unit is 2.06 m, give or take 0.05 (2.4 %): by the height of 4 cup, 0.096 m".
std::string ScaleText(const MapScale& scale);

// Multiplies every length in the snapshot, and covariances accordingly.
void ScaleLengths(double factor, MapSnapshot& snapshot);

// Returns the scale of a recording, or nothing if it has none. Throws InputError if it is broken.
std::optional<MapScale> ReadMapScale(const std::filesystem::path& recording);

// Stores a scale in a finished recording, replacing an earlier one; empty removes it. Throws InputError.
void KeepMapScale(const std::filesystem::path& recording, const std::optional<MapScale>& scale);

}  // namespace sqslam
