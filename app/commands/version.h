#pragma once

#include <string>

namespace sqslam::app {

// Several lines: the program's version, how it was built, the libraries, the rendering back ends.
std::string VersionText();

}  // namespace sqslam::app
