#pragma once

#include <string>
#include <string_view>

namespace sqslam {

// 16 hexadecimal digits (FNV-1a of 64 bits) by which equal texts are recognised.
std::string Fingerprint(std::string_view text);

}  // namespace sqslam
