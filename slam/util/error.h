#pragma once

#include <stdexcept>
#include <string>

namespace sqslam {

// Input that cannot be used. The message names file, line or frame, and what was expected. Exit code 3.
class InputError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// A command line or a configuration that makes no sense. Exit code 2.
class UsageError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// The input was read, but no map came out of it (static camera, pure rotation, no texture). Exit code 4.
class NoMapError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace sqslam
