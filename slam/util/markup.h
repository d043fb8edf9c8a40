#pragma once

#include <string>
#include <string_view>

namespace sqslam {

// Escapes text for HTML and SVG, including attribute values in double quotes. Control characters become
// blanks, invalid UTF-8 becomes U+FFFD.
std::string EscapeMarkup(std::string_view text);

// Encodes bytes as in RFC 4648, with padding.
std::string Base64(std::string_view bytes);

// Returns 16 hexadecimal digits (64-bit FNV-1a) that identify equal texts.
std::string Fingerprint(std::string_view text);

}  // namespace sqslam
