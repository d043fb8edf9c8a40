#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "app/cluster/piece_work.h"
#include "app/command_line/command.h"
#include "app/result/map_input.h"
#include "render/video/video.h"

namespace sqslam::app {

// --style and --set.
struct StyleArguments {
  std::string name = "paper";
  std::vector<std::string> settings;

  void AddTo(Command& command);
  // Loads the style, applies `adapt` (null: nothing) and then the settings. Throws UsageError.
  SceneStyle Load(void (*adapt)(SceneStyle& style) = nullptr) const;
};

// --rendering-backend.
void AddBackendOption(Command& command, RenderBackend& backend);

// The command line of `sqslam render`.
struct RenderArguments {
  std::string map;
  ObjectArguments objects;
  std::string output;
  PictureOptions picture;
  std::string font;                              // of vector graphics
  std::optional<std::array<int, 2>> resolution;  // default: 1280,720; with --camera-frame that of the images
  StyleArguments style;
  LayerArguments layers;
  std::optional<std::int64_t> camera_frame;
  std::optional<std::int64_t> at_frame;
  bool overlay = false;
  bool photo = false;
  std::string path;
  bool growth = false;
  std::string frames;
  std::optional<double> fps;
  std::optional<double> seconds;
  std::string shard;
  std::vector<std::string> join;
  ClusterArguments cluster;
  std::string reference;
  double threshold = 0.04;
  bool quiet = false;
};

void AddRenderOptions(Command& command, RenderArguments& arguments);

// Throws UsageError on options that contradict each other.
void CheckRenderArguments(const RenderArguments& arguments);
bool MakesFrames(const RenderArguments& arguments);  // true for a video or numbered pictures
bool MakesPage(const RenderArguments& arguments);    // true for vector graphics

// Throw UsageError that names the option.
PictureOptions MakePictureOptions(const RenderArguments& arguments);
VideoOptions MakeVideoOptions(const RenderArguments& arguments, const PictureOptions& picture, double fps);

// Returns a fingerprint of the style and of the files of edits, camera path and dense cloud. A missing
// file counts as empty: drawing reports it. Throws UsageError on a wrong style, InputError if `--edits auto`
// finds none.
std::string FilesFingerprint(const RenderArguments& arguments);

}  // namespace sqslam::app
