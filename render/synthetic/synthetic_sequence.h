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
  int frames = 0;                 // 0: from the scene
  bool noisy_detections = false;  // boxes.txt with detector noise; else boxes_noisy.txt has it
  std::uint64_t seed = 1;         // of tremor, image noise and detector noise
  double image_noise = 1.2;       // standard deviation of sensor noise, grey levels
  int jpeg_quality = 93;          // in [1, 100]
  int supersampling = 2;          // pictures are drawn this many times larger, then averaged
  RenderBackend backend = RenderBackend::kAuto;
};

struct SynthesisSummary {
  int frames = 0;
  int boxes = 0;
  int objects = 0;              // objects with a box in at least one frame
  double path_length = 0.0;     // metres
  double mean_speed = 0.0;      // metres per second
  double mean_turn_rate = 0.0;  // radians per second
};

using SynthesisProgress = std::function<void(int done, int total)>;

// Renders a scene into a sequence folder with exact ground truth: rgb/, rgb.txt, camera.yaml,
// groundtruth.txt, objects_gt.json, dense.ply (true_surface.h), boxes.txt, and boxes_noisy.txt or
// boxes_exact.txt. The folder is written completely or not at all; the same scene and options give identical
// files. Throws InputError if `output` is not empty or cannot be written.
SynthesisSummary WriteSyntheticSequence(const SceneDescription& scene, const std::filesystem::path& output,
                                        const SynthesisOptions& options,
                                        const SynthesisProgress& progress = {});

// Returns T_world_camera (x right, y down, z forward) of an upright camera at `position` that looks at
// `target`.
Rigid3d LookAt(const Eigen::Vector3d& position, const Eigen::Vector3d& target);

// Returns the motion of a hand-held camera, T_world_camera per frame: a smooth curve along the scene's
// waypoints at nearly constant speed, slow at both ends, with a small tremor. Deterministic in the seed.
std::vector<Rigid3d> HandHeldMotion(const SceneDescription& scene, int frames, std::uint64_t seed);

}  // namespace sqslam
