#pragma once

#include <stdexcept>

namespace sqslam {

// Input that cannot be used. The message names file, line or frame, and what was expected. Exit code 3.
struct InputError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// A command line or a configuration that makes no sense. Exit code 2.
struct UsageError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// The input was read, but no map came out of it (static camera, pure rotation, no texture). Exit code 4.
struct NoMapError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace sqslam
