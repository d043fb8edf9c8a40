#include <benchmark/benchmark.h>

#include <cmath>
#include <random>

#include "render/picture.h"

namespace sqslam {
namespace {

// 30 superquadrics and 100,000 points in a room.
MapSnapshot LargeMap() {
  MapSnapshot map;
  map.gravity_known = true;
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  for (int i = 0; i < 30; ++i) {
    SnapshotObject object;
    object.id = i;
    object.label = "class_" + std::to_string(i % 9);
    object.superquadric.shape.half_size = {0.1 + 0.2 * uniform(random), 0.1 + 0.2 * uniform(random), 0.2};
    object.superquadric.shape.e1 = 0.1 + 1.4 * uniform(random);
    object.superquadric.shape.e2 = 0.1 + 1.4 * uniform(random);
    object.superquadric.T_map_object.translation = {i % 6 - 2.5, i / 6 - 2.0, 0.2};
    map.objects.push_back(object);
  }
  for (int i = 0; i < 100000; ++i) {
    const Eigen::Vector3d p(6.0 * uniform(random) - 3.0, 6.0 * uniform(random) - 3.0, 0.5 * uniform(random));
    map.points.push_back({p.cast<float>(), {90, 110, 130}, i % 4 == 0 ? i % 30 : -1});
  }
  for (int i = 0; i < 100; ++i) {
    map.keyframes.push_back(
        {i, i, 0.1 * i, {{}, {4.0 * std::cos(0.03 * i), -4.0 * std::sin(0.03 * i), 1.5}}});
  }
  return map;
}

// One frame of 1280x720 with the camera moving, everything already on the device.
void BM_Frame(benchmark::State& state, const char* anti_aliasing, double opacity) {
  PictureOptions options;
  options.backend = RenderBackend::kOsmesa;
  options.style.anti_aliasing = anti_aliasing;
  options.style.objects.opacity = opacity;
  PictureRenderer renderer(options);
  renderer.SetMap(LargeMap());
  renderer.Render();
  double angle = 0.0;
  for (auto _ : state) {
    angle += 3.0;
    benchmark::DoNotOptimize(renderer.Render(Azimuth(renderer.DefaultCamera(), angle)));
  }
}
BENCHMARK_CAPTURE(BM_Frame, opaque, "none", 1.0)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK_CAPTURE(BM_Frame, opaque_fxaa, "fxaa", 1.0)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK_CAPTURE(BM_Frame, opaque_ssaa, "ssaa", 1.0)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK_CAPTURE(BM_Frame, translucent, "none", 0.5)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK_CAPTURE(BM_Frame, translucent_fxaa, "fxaa", 0.5)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK_CAPTURE(BM_Frame, translucent_ssaa, "ssaa", 0.5)->Unit(benchmark::kMillisecond)->UseRealTime();

// A new map on the device and a frame of it, as for each frame of a growth video.
void BM_NewMapAndFrame(benchmark::State& state) {
  PictureOptions options;
  options.backend = RenderBackend::kOsmesa;
  PictureRenderer renderer(options);
  const MapSnapshot map = LargeMap();
  renderer.SetMap(map);
  for (auto _ : state) {
    renderer.SetMapKeepingFrame(map);
    benchmark::DoNotOptimize(renderer.Render());
  }
}
BENCHMARK(BM_NewMapAndFrame)->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace
}  // namespace sqslam

BENCHMARK_MAIN();
