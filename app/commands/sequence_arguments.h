#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <limits>
#include <string>

#include "slam/io/frame_source.h"
#include "slam/io/sequence.h"

namespace sqslam::app {

// The options that say which images a command works on.
struct SequenceArguments {
  std::string input;
  std::string format = "auto";
  std::string camera;
  std::string resize;
  std::int64_t start = 0;
  std::int64_t frames = std::numeric_limits<std::int64_t>::max();
  std::int64_t stride = 1;

  void AddTo(CLI::App& command);

  SequenceRequest Request() const;  // without boxes
  FrameRange Range() const { return {start, frames, stride}; }
};

// The names of --format.
SequenceFormat ParseSequenceFormat(const std::string& name);

}  // namespace sqslam::app
