#pragma once

#include <filesystem>

namespace sqslam {

// Where a file that comes with the program lies, e.g. "assets/scenes/desk.yaml" or "configs/default.yaml":
// below PREFIX/share/sqslam of an installed program, or in the source tree of one that runs from
// build/PRESET/bin. Throws InputError where it is in neither.
std::filesystem::path DataPath(const std::filesystem::path& name);

}  // namespace sqslam
