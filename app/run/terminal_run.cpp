#include "app/run/terminal_run.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <string>
#include <tuple>
#include <utility>

#include "app/export/map_export.h"
#include "app/report/report.h"
#include "render/video/video.h"
#include "slam/snapshot/recording.h"

namespace sqslam::app {
namespace fs = std::filesystem;

void DrawRun(const fs::path& result, const MapSnapshot& map, StageTimes& times, RenderBackend backend) {
  PictureOptions options;
  options.backend = backend;
  options.layers.dense_cloud = ReadCloudLayer(result / "map.sqmap");
  PictureRenderer renderer(options);
  renderer.SetMap(map);
  fs::create_directories(result / "figures");
  // Degrees from the three-quarter view.
  for (const auto& [file, azimuth, elevation] : {std::tuple("map.png", 0.0, 0.0),
                                                 {"figures/above.png", 0.0, 60.0},
                                                 {"figures/left.png", -50.0, 0.0},
                                                 {"figures/right.png", 50.0, 0.0}}) {
    const StageTimes::Scope timer(times, "render");
    WritePicture(result / file,
                 renderer.Render(renderer.ViewOf({.azimuth = azimuth, .elevation = elevation})));
  }
}

int EndInterrupted(const FinishedRun& run) {
  PrintNotice(
      fmt::format("sqslam: interrupted{}", run.result.map.snapshot
                                               ? fmt::format("; the map so far is in {}", run.output.string())
                                               : " before there was a map"));
  return 130;
}

TerminalRun::TerminalRun(RunPictures pictures, bool quiet)
    : pictures_(std::move(pictures)), quiet_(quiet), progress_(quiet) {}

void TerminalRun::Say(const std::string& news) {
  if (!quiet_) {
    spdlog::info(news);
  }
}

void TerminalRun::ShowProgress(std::int64_t done, std::int64_t total, const std::string& state) {
  progress_.Update(done, total, state);
}

void TerminalRun::Draw(const FinishedRun& run, StageTimes& times) {
  if (pictures_.draw) {
    DrawRun(run.output, *run.result.map.snapshot, times);
  }
}

void TerminalRun::Mesh(const FinishedRun& run) {
  WriteSurface(run.output, 0, [this](int done, int total, const std::string& state) {
    ShowProgress(done, total, state);
    return !Stopped();
  });
  EndProgress();
}

void TerminalRun::Film(const FinishedRun& run) {
  if (pictures_.video.empty()) {
    return;
  }
  if (run.interrupted) {
    spdlog::warn("interrupted, no video was made; sqslam render {} --growth --output {} makes it",
                 run.output.string(), pictures_.video.string());
    return;
  }
  VideoOptions options;
  options.seconds = kGrowthSeconds;
  options.picture.layers.dense_cloud = ReadCloudLayer(run.output / "map.sqmap");
  WriteGrowthVideo(RecordingReader(run.output / "map.sqmap"), options, pictures_.video,
                   [this](int done, int total) {
                     ShowProgress(done, total, "of the video");
                     return !Stopped();
                   });
  EndProgress();
  filmed_ = true;
}

void TerminalRun::Report(const FinishedRun& run) {
  if (pictures_.draw) {
    WriteReport({run.output, "", run.sequence, filmed_ ? pictures_.video : fs::path(), &run});
  }
}

}  // namespace sqslam::app
