#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "app/run/terminal_run.h"
#include "slam/run/run_pipeline.h"

namespace sqslam::app {

// The command line of a run, as it was typed.
struct RunArguments {
  std::string input;
  int camera_index = -1;  // -1: none
  std::string format = "auto";
  std::string camera;
  std::string resize;
  std::string config;
  std::vector<std::string> set;
  std::string detections;
  std::string detector;
  std::string output;
  std::int64_t start = 0;
  std::int64_t frames = std::numeric_limits<std::int64_t>::max();
  std::int64_t stride = 1;
  bool deterministic = false;
  std::int64_t seed = -1;
  bool realtime = false;
  std::string representation;
  std::string association;
  std::string video;
  bool no_render = false;
  bool quiet = false;
  bool dump_config = false;

  void AddTo(CLI::App& command);

  // All throw UsageError where what is said makes no sense.
  SystemOptions Options() const;
  RunPictures Pictures() const;
  RunRequest Request() const;
};

}  // namespace sqslam::app
