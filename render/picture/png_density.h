#pragma once

#include <string>

namespace sqslam {

inline constexpr double kPrintDpi = 300.0;  // pixels per inch of pictures that say no other

// Inserts a pHYs chunk with the pixels per inch, which OpenCV cannot write, after the header chunk of a PNG.
std::string WithDensity(const std::string& png, double dpi = kPrintDpi);

}  // namespace sqslam
