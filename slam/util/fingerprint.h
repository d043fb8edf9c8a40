#pragma once

#include <string>
#include <string_view>

namespace sqslam {

// Returns 16 hexadecimal digits (64-bit FNV-1a) that identify equal texts.
std::string Fingerprint(std::string_view text);

}  // namespace sqslam
