#include "slam/run/known_map.h"

#include <fmt/format.h>

#include <algorithm>
#include <string>

#include "slam/io/result_files.h"
#include "slam/snapshot/recording.h"
#include "slam/util/options.h"
#include "slam/util/throw_if.h"

namespace sqslam {
namespace fs = std::filesystem;
namespace {

std::string CameraText(const Camera& c) {
  return fmt::format("{}x{}, fx {:.1f}, fy {:.1f}, cx {:.1f}, cy {:.1f}", c.width, c.height, c.fx, c.fy, c.cx,
                     c.cy);
}

// Returns the largest shift of a point in the image between the two cameras, px.
double LargestShift(const Camera& a, const Camera& b) {
  double largest = 0.0;
  for (const double x : {0.0, 0.5, 1.0}) {
    for (const double y : {0.0, 0.5, 1.0}) {
      const Eigen::Vector2d pixel(x * (a.width - 1), y * (a.height - 1));
      const Eigen::Vector3d ray = a.Unproject(a.Undistort(pixel));
      largest = std::max(largest, (b.ProjectDistorted(ray) - pixel).norm());
    }
  }
  return largest;
}

}  // namespace

SystemOptions OptionsOfRun(const fs::path& result) {
  const fs::path recording = ResultFile(result, "map.sqmap");
  SystemOptions options;
  try {
    ParseOptions(RecordingReader(recording).Info().config, "its options", options);
  } catch (const UsageError& error) {
    throw InputError("{}: {}", recording.string(), error.what());
  }
  return options;
}

KnownMap ReadKnownMap(const fs::path& result) {
  const fs::path recording = ResultFile(result, "map.sqmap");
  return {recording, ReadKeptMap(recording), OptionsOfRun(result)};
}

void CheckSameCamera(const fs::path& source, const Camera& camera, const KnownMap& map) {
  constexpr double kMostShift = 0.02;  // of the image's width
  const Camera& known = map.map.camera;
  const bool same_size = camera.width == known.width && camera.height == known.height;
  ThrowIf<InputError>(
      !same_size || LargestShift(camera, known) > kMostShift * known.width,
      "{}: its camera ({}) is not that of {}, expected {}{}", source.string(), CameraText(camera),
      map.recording.string(), CameraText(known),
      same_size ? "" : fmt::format(" (--resize {},{} changes the size)", known.width, known.height));
}

Sequence OpenSequenceFor(const KnownMap& map, const SequenceRequest& request) {
  Sequence sequence = OpenSequence(request);
  const Camera& known = map.map.camera;
  Camera stated = known;  // an uncalibrated camera is assumed to be the map's
  stated.width = sequence.camera.width;
  stated.height = sequence.camera.height;
  CheckSameCamera(request.path, sequence.guessed_by.empty() ? sequence.camera : stated, map);
  const double fps = sequence.camera.fps;
  sequence.camera = known;  // what the map was optimised with
  sequence.camera.fps = fps;
  sequence.guessed_by.clear();
  return sequence;
}

}  // namespace sqslam
