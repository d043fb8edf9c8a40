#pragma once

#include <filesystem>

#include "app/terminal/terminal.h"
#include "render/picture/picture.h"
#include "slam/run/run_host.h"

namespace sqslam::app {

// Draws the map of a run into its result folder: map.png (three-quarter view) and figures/ (from above, left
// and right). Adds the time of each picture to `times` as stage "render". Throws InputError if a file cannot
// be written.
void DrawRun(const std::filesystem::path& result, const MapSnapshot& map, StageTimes& times,
             RenderBackend backend = RenderBackend::kAuto);

// Reports on stderr that the run was interrupted and where its map is. Returns the exit code, 130.
int EndInterrupted(const FinishedRun& run);

struct RunPictures {
  std::filesystem::path video;  // growth of the map as a video; empty: none
  bool draw = true;             // map.png, figures/ and report.html
};

// Hosts a run in a terminal: Ctrl-C ends the run, progress goes to stderr, pictures need no display.
class TerminalRun : public RunHost {
 public:
  TerminalRun(RunPictures pictures, bool quiet);

  bool Stopped() const override { return interrupt_.Interrupted(); }
  void Say(const std::string& news) override;
  void ShowProgress(std::int64_t done, std::int64_t total, const std::string& state) override;
  void EndProgress() override { progress_.Finish(); }
  void Mesh(const FinishedRun& run) override;  // dense.glb
  void Draw(const FinishedRun& run, StageTimes& times) override;
  void Film(const FinishedRun& run) override;  // at most kGrowthSeconds of video; Ctrl-C cuts it short
  void Report(const FinishedRun& run) override;

 private:
  RunPictures pictures_;
  bool quiet_;
  bool filmed_ = false;
  InterruptGuard interrupt_;
  Progress progress_;
};

}  // namespace sqslam::app
