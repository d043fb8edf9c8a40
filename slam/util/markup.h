#pragma once

#include <string>
#include <string_view>

namespace sqslam {

// Text made safe for HTML and SVG, values of attributes in double quotes included. Control characters become
// blanks.
std::string EscapeMarkup(std::string_view text);

// As in RFC 4648, with padding.
std::string Base64(std::string_view bytes);

}  // namespace sqslam
