#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "slam/snapshot/snapshot.h"

namespace sqslam {

// Length of a map unit in metres, from a reference of known size. The map itself stays in its own units; its
// readers return metres.
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

// Throws InputError that names the recording for a scale that is not positive or not finite, or beyond
// kMaxMetresPerUnit.
void CheckMapScale(const std::filesystem::path& recording, const MapScale& scale);

// Stores a scale in a finished recording in one transaction, replacing an earlier one, even a broken one;
// empty removes it. Throws InputError.
void StoreMapScale(const std::filesystem::path& recording, const std::optional<MapScale>& scale);

// Returns the comment that states the scale of a file in metres, such as "1 map unit = 2.5 m"; empty
// for a file in map units (`metres` is 1).
std::string UnitComment(double metres);

// Returns the metres per map unit from the comment in a file's first lines; 1 if there is none.
double MetresPerUnitIn(std::string_view text);

}  // namespace sqslam
