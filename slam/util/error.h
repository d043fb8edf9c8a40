#pragma once

#include <stdexcept>

namespace sqslam {

// Unusable input. The message names file, line or frame, and what was expected. Exit code 3.
struct InputError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// An invalid command line or configuration. Exit code 2.
struct UsageError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// The input was read, but gave no map (static camera, pure rotation, no texture). Exit code 4.
struct NoMapError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace sqslam
