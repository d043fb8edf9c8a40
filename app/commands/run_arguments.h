#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "app/command_line/command.h"
#include "app/run/terminal_run.h"
#include "slam/io/frame_source.h"
#include "slam/io/sequence.h"
#include "slam/run/run_pipeline.h"

namespace sqslam::app {

// Returns the name of the sequence, for the default result folder, also for "." or "data/kitchen/".
std::string NameOfInput(const std::filesystem::path& input);

// Options that select the images of a command.
struct SequenceArguments {
  std::string input;
  SequenceFormat format = SequenceFormat::kAuto;
  std::string camera;
  std::string resize;
  std::optional<std::int64_t> start;
  std::string frames;
  std::int64_t stride = 1;

  // Adds INPUT with this help, the options below, and --camera if `with_camera`.
  Argument& AddTo(Command& command, const std::string& input_help, bool with_camera = true);

  SequenceRequest Request() const;  // without boxes
  FrameRange Range() const { return ParseFrameRange(frames, start, stride); }
};

// The command line of a run, as it was typed.
struct RunArguments : SequenceArguments {
  std::optional<int> camera_index;
  std::string config;
  std::vector<std::string> set;
  std::string detections;
  std::string detector;
  std::string mask;
  std::string ignore;
  std::string extend;
  std::string scale_from;
  std::string output;
  bool deterministic = false;
  std::optional<std::int64_t> seed;
  std::optional<DenseTime> dense;  // empty: for pictures of a recording, at the end
  bool no_dense = false;
  bool realtime = false;
  std::optional<Representation> representation;
  std::optional<QuadricInit> quadric_init;
  std::optional<AssociationMethod> association;
  std::string video;
  bool no_render = false;
  bool quiet = false;
  bool dump_config = false;

  void AddTo(Command& command);

  // All throw UsageError on invalid or contradictory arguments.
  SystemOptions Options() const;
  RunPictures Pictures() const;
  RunRequest Request() const;

 private:
  std::optional<DenseTime> Dense(bool live) const;
};

}  // namespace sqslam::app
