#pragma once

#include <filesystem>

namespace sqslam {

// Looks for the parts of the objects in the depth maps of a densified result (FitParts), and writes those
// that it finds to its recording and to objects.json. Hulls stay as they are. The classes are those of the
// run; a run with another representation than superquadrics gets no parts. Returns the number of objects with
// parts. Throws InputError if a file cannot be read or written.
int FindParts(const std::filesystem::path& result);

}  // namespace sqslam
