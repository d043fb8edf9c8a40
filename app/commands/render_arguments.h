#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "app/command_line/command.h"
#include "app/result/map_input.h"
#include "render/video/video.h"

namespace sqslam::app {

// The command line of `sqslam render`.
struct RenderArguments {
  std::string map;
  std::string edits;
  std::string output;
  std::optional<std::array<int, 2>> resolution;  // default: 1280,720, or as the images with --camera-frame
  bool no_background = false;
  std::string backend = "auto";
  std::string style = "paper";
  std::vector<std::string> settings;
  LayerArguments layers;
  std::string view;
  std::optional<std::array<double, 3>> position, focal_point, view_up;
  std::optional<double> view_angle;
  double azimuth = 0.0;
  double elevation = 0.0;
  double zoom = 1.0;
  std::optional<std::int64_t> camera_frame;
  std::optional<std::int64_t> at_frame;
  bool overlay = false;
  std::string path;
  bool growth = false;
  std::string frames;
  std::optional<double> fps;
  double seconds = 10.0;
  std::string shard;
  std::vector<std::string> join;
  std::string reference;
  double threshold = 0.04;
  bool quiet = false;
};

void AddRenderOptions(Command& command, RenderArguments& arguments);

// Options that other commands share: --style and --set; --rendering-backend.
void AddStyleOptions(Command& command, std::string& style, std::vector<std::string>& settings);
void AddBackendOption(Command& command, std::string& backend);

// Combinations that make no sense. Throws UsageError.
void CheckRenderArguments(const RenderArguments& arguments);
bool MakesFrames(const RenderArguments& arguments);  // a video or numbered pictures

// Throw UsageError that names the option.
PictureOptions MakePictureOptions(const RenderArguments& arguments);
VideoOptions MakeVideoOptions(const RenderArguments& arguments, const PictureOptions& picture, double fps);

}  // namespace sqslam::app
