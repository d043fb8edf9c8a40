#pragma once

namespace sqslam::testing {

// A book and a box on a table, seen in 30 small images: rendered and mapped in a second or two.
inline constexpr const char* kScene = R"(name: tiny
frames: 30
camera: {width: 320, height: 240, fx: 262.5, fy: 262.5, cx: 159.5, cy: 119.5, fps: 30}
motion:
  tremor_position: 0.0
  tremor_angle: 0.0
  waypoints:
    - {position: [-0.45, -0.8, 0.6], look_at: [0, 0, 0.05]}
    - {position: [-0.15, -0.9, 0.6], look_at: [0, 0, 0.05]}
    - {position: [0.15, -0.9, 0.6], look_at: [0, 0, 0.05]}
    - {position: [0.45, -0.8, 0.6], look_at: [0, 0, 0.05]}
ambient: [0.6, 0.6, 0.6]
lights:
  - {center: [0, 0, 2], half_u: [0.0, 0.4, 0.0], half_v: [0.4, 0.0, 0.0], rgb: [2, 2, 2]}
objects:
  - {id: 1, label: book, half_size: [0.12, 0.09, 0.03], shape: [0.1, 0.1], center: [-0.15, 0, 0], base: 0, yaw: 20,
     texture: {pattern: book, seed: 2, title: "MAPS AND MOTION", colors: [[34, 74, 110], [70, 128, 150], [240, 232, 208], [208, 120, 52], [150, 190, 190]]}}
  - {id: 2, label: cereal_box, half_size: [0.09, 0.04, 0.12], shape: [0.1, 0.1], center: [0.15, 0.05, 0], base: 0, yaw: -10,
     texture: {pattern: package, seed: 1, title: "OAT RINGS", colors: [[226, 178, 52], [238, 214, 120], [176, 36, 34], [250, 240, 215], [60, 34, 28], [24, 82, 130]]}}
panels:
  - {corner: [-0.9, -0.6, 0], u: [1.8, 0, 0], v: [0, 1.4, 0], shading_step: 0.2,
     texture: {pattern: terrazzo, seed: 102, title: "", colors: [[168, 160, 150], [120, 112, 104], [206, 198, 186], [140, 92, 72], [88, 96, 100], [226, 220, 208]]}}
)";

inline constexpr const char* kExperiment = R"(
sequences: [{scene: tiny.yaml}]
deterministic: true
grids:
  - {representations: [superquadric, quadric]}
)";

}  // namespace sqslam::testing
