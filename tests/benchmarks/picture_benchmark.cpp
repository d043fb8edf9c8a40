#include <benchmark/benchmark.h>

#include "render/picture.h"
#include "tests/render/sample_map.h"

namespace {

// A frame of 1280x720 with 30 superquadrics and 100000 points, from another side each time.
void DrawFrame(benchmark::State& state, const char* anti_aliasing, double opacity) {
  sqslam::PictureOptions options;
  options.style.anti_aliasing = anti_aliasing;
  options.style.objects.opacity = opacity;
  sqslam::PictureRenderer renderer(options);
  renderer.SetMap(sqslam::MakeSampleMap(30, 100000));
  const auto path = sqslam::OrbitPath(renderer.DefaultCamera(), 36);
  renderer.Render(path[0]);  // uploads and compiles
  std::size_t frame = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(renderer.Render(path[++frame % path.size()]));
  }
}

void FirstFrame(benchmark::State& state) {
  const sqslam::MapSnapshot map = sqslam::MakeSampleMap(30, 100000);
  for (auto _ : state) {
    benchmark::DoNotOptimize(sqslam::RenderPicture(map, {}));
  }
}

BENCHMARK_CAPTURE(DrawFrame, fxaa_solid, "fxaa", 1.0)->Unit(benchmark::kMillisecond)->UseRealTime()->MeasureProcessCPUTime();
BENCHMARK_CAPTURE(DrawFrame, fxaa_translucent, "fxaa", 0.85)->Unit(benchmark::kMillisecond)->UseRealTime()->MeasureProcessCPUTime();
BENCHMARK_CAPTURE(DrawFrame, ssaa_solid, "ssaa", 1.0)->Unit(benchmark::kMillisecond)->UseRealTime()->MeasureProcessCPUTime();
BENCHMARK_CAPTURE(DrawFrame, ssaa_translucent, "ssaa", 0.85)->Unit(benchmark::kMillisecond)->UseRealTime()->MeasureProcessCPUTime();
BENCHMARK(FirstFrame)->Unit(benchmark::kMillisecond)->UseRealTime()->MeasureProcessCPUTime();

}  // namespace

BENCHMARK_MAIN();
