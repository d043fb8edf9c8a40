#pragma once

#include <charconv>
#include <optional>
#include <string_view>
#include <system_error>

namespace sqslam {

// The number that the whole text is, with or without a plus before it; empty for anything else.
template <typename Number>
std::optional<Number> ParseNumber(std::string_view text) {
  text.remove_prefix(text.starts_with('+') ? 1 : 0);
  Number number{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  return error == std::errc() && end == text.data() + text.size() ? std::optional(number) : std::nullopt;
}

}  // namespace sqslam
