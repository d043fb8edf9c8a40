#pragma once

#include <filesystem>

#include "render/video/video.h"
#include "slam/snapshot/snapshot.h"
#include "slam/util/stage_times.h"

namespace sqslam::app {

// Draws a finished run into its result folder: map.png (three-quarter view) and figures/ (from above and from
// both sides). `times` takes the duration of each as stage render. Throws InputError where a file cannot be
// written.
void DrawRun(const MapSnapshot& map, const std::filesystem::path& result, StageTimes& times,
             RenderBackend backend = RenderBackend::kAuto);

// The growth of a recorded map as a video of twenty seconds at most (render/video.h). `progress` may end it
// early. Throws as WriteGrowthVideo.
void DrawGrowth(const std::filesystem::path& recording, const std::filesystem::path& video,
                const VideoProgress& progress = {});

}  // namespace sqslam::app
