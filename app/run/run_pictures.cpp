#include "app/run/run_pictures.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <string>

#include "render/picture/picture.h"
#include "slam/snapshot/recording.h"
#include "slam/util/atomic_file.h"
#include "slam/util/error.h"

namespace sqslam::app {
namespace {

struct PictureView {
  const char* file;
  double azimuth;    // degrees from the three-quarter view
  double elevation;  // degrees from the three-quarter view
};

void WritePicture(const std::filesystem::path& path, const cv::Mat& picture) {
  AtomicPath file(path);
  if (!cv::imwrite(file.Path().string(), picture)) {
    throw InputError(fmt::format(
        "{}: the picture cannot be written, expected free space and a writable folder", path.string()));
  }
  file.Commit();
}

}  // namespace

void DrawRun(const MapSnapshot& map, const std::filesystem::path& result, StageTimes& times,
             RenderBackend backend) {
  PictureOptions options;
  options.backend = backend;
  PictureRenderer renderer(options);
  renderer.SetMap(map);
  std::filesystem::create_directories(result / "figures");
  for (const PictureView& view :
       {PictureView{"map.png", 0.0, 0.0}, PictureView{"figures/above.png", 0.0, 60.0},
        PictureView{"figures/left.png", -50.0, 0.0}, PictureView{"figures/right.png", 50.0, 0.0}}) {
    const StageTimes::Scope timer(times, "render");
    CameraOverrides turn;
    turn.azimuth = view.azimuth;
    turn.elevation = view.elevation;
    WritePicture(result / view.file, renderer.Render(turn.ApplyTo(renderer.DefaultCamera())));
  }
}

void DrawGrowth(const std::filesystem::path& recording, const std::filesystem::path& video,
                const VideoProgress& progress) {
  const RecordingReader reader(recording);
  VideoOptions options;
  options.fps = 15.0;  // half a camera's rate: new maps come a few times a second
  options.seconds = 20.0;
  WriteGrowthVideo(reader, options, video, progress);
}

}  // namespace sqslam::app
