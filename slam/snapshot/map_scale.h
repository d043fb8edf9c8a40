#pragma once

#include <array>
#include <filesystem>
#include <functional>
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

// Throws InputError that names the recording for a scale that is not positive or not finite, or beyond
// kMaxMetresPerUnit.
void CheckMapScale(const std::filesystem::path& recording, const MapScale& scale);

// Files beside a recording whose lengths are in its scale.
inline constexpr std::array kScaledFiles = {"trajectory.txt", "keyframes.txt", "points.ply", "objects.json",
                                            "dense.ply"};

// Writes a file of the old scale in the new one, under the name `rescaled`. `factor`: new lengths by old
// ones; empty if the old scale is broken. A file that is not written stays as it is.
using RescaleFile =
    std::function<void(const std::filesystem::path& file, const std::filesystem::path& rescaled,
                       const std::optional<double>& factor)>;

// Stores a scale in a finished recording, replacing an earlier one, even a broken one; empty removes it.
// `rescale` is called for each of kScaledFiles that is there. Keeps other programs from doing the same
// meanwhile. If it throws InputError, or if its program is killed, scale and files are all the old ones, or
// FinishRescaling() makes them all the new ones.
void KeepMapScale(const std::filesystem::path& recording, const std::optional<MapScale>& scale,
                  const RescaleFile& rescale = {});

// Puts files in place that wait beside the recording since a program was killed in KeepMapScale(). A
// RecordingReader does so itself; to be called before kScaledFiles are read without one. Does nothing if
// there is no recording. Throws InputError if the folder cannot be written.
void FinishRescaling(const std::filesystem::path& recording);

}  // namespace sqslam
