#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <vector>

#include "render/gl/offscreen_context.h"
#include "render/synthetic/scene_description.h"
#include "slam/geometry/rigid3.h"

namespace sqslam {

struct SynthesisOptions {
  int frames = 0;  // 0: as many as the scene says
  bool noisy_detections =
      false;                 // boxes.txt as a detector would give them (boxes_noisy.txt is always written)
  std::uint64_t seed = 1;    // of tremor, image noise and detector
  double image_noise = 1.2;  // standard deviation of the sensor's noise, grey levels
  int jpeg_quality = 93;     // in [1, 100]
  int supersampling = 2;     // pictures are drawn this many times larger, then averaged
  RenderBackend backend = RenderBackend::kAuto;
};

struct SynthesisSummary {
  int frames = 0;
  int boxes = 0;
  int objects = 0;              // objects listed in at least one frame
  double path_length = 0.0;     // metres
  double mean_speed = 0.0;      // metres per second
  double mean_turn_rate = 0.0;  // radians per second
};

using SynthesisProgress = std::function<void(int done, int total)>;

// Renders a scene into a sequence folder with exact ground truth: rgb/, rgb.txt, camera.yaml,
// groundtruth.txt, objects_gt.json, boxes.txt and boxes_noisy.txt. The folder is written whole or not at all;
// the same scene and options give the same files, byte for byte. Throws InputError where `output` exists
// already or cannot be written.
SynthesisSummary WriteSyntheticSequence(const SceneDescription& scene, const std::filesystem::path& output,
                                        const SynthesisOptions& options,
                                        const SynthesisProgress& progress = {});

// T_world_camera (x right, y down, z forward) that looks from `position` at `target`, upright.
Rigid3d LookAt(const Eigen::Vector3d& position, const Eigen::Vector3d& target);

// The way of a camera held by hand: through the scene's waypoints on a smooth curve at nearly even speed,
// slow at both ends, with a small tremor. One T_world_camera a frame; deterministic in the seed.
std::vector<Rigid3d> HandHeldMotion(const SceneDescription& scene, int frames, std::uint64_t seed);

}  // namespace sqslam
