#pragma once

#include <fmt/core.h>

#include <stdexcept>
#include <utility>

namespace sqslam {

// An error with a text as its message, or a format and its values as in fmt::format().
struct FormattedError : std::runtime_error {
  using std::runtime_error::runtime_error;
  template <typename First, typename... Values>
  explicit FormattedError(fmt::format_string<First, Values...> format, First&& first, Values&&... values)
      : std::runtime_error(fmt::format(format, std::forward<First>(first), std::forward<Values>(values)...)) {
  }
};

// Unusable input. The message names file, line or frame, and what was expected. Exit code 3.
struct InputError : FormattedError {
  using FormattedError::FormattedError;
};

// An invalid command line or configuration. Exit code 2.
struct UsageError : FormattedError {
  using FormattedError::FormattedError;
};

// The input was read, but gave no map (static camera, pure rotation, no texture). Exit code 4.
struct NoMapError : FormattedError {
  using FormattedError::FormattedError;
};

}  // namespace sqslam
