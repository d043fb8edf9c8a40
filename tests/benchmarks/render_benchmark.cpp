#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string_view>

#include "render/gl/offscreen_context.h"
#include "render/picture/picture.h"
#include "slam/util/enum_names.h"
#include "slam/util/error.h"

namespace sqslam {
namespace {

RenderBackend backend = RenderBackend::kOsmesa;  // of all benchmarks, as --rendering-backend says

// Superquadrics on a square grid and points around them in a room.
MapSnapshot LargeMap(int objects, int points) {
  MapSnapshot map;
  map.gravity_known = true;
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  const int columns = static_cast<int>(std::ceil(std::sqrt(objects)));
  const double room = columns;
  for (int i = 0; i < objects; ++i) {
    SnapshotObject object;
    object.id = i;
    object.label = "class_" + std::to_string(i % 9);
    object.superquadric.shape.half_size = {0.1 + 0.2 * uniform(random), 0.1 + 0.2 * uniform(random), 0.2};
    object.superquadric.shape.e1 = 0.1 + 1.4 * uniform(random);
    object.superquadric.shape.e2 = 0.1 + 1.4 * uniform(random);
    object.superquadric.T_map_object.translation = {i % columns - 0.5 * (room - 1),
                                                    i / columns - 0.5 * (room - 1), 0.2};
    map.objects.push_back(object);
  }
  for (int i = 0; i < points; ++i) {
    const Eigen::Vector3d p(room * (uniform(random) - 0.5), room * (uniform(random) - 0.5),
                            0.5 * uniform(random));
    map.points.push_back({p.cast<float>(), {90, 110, 130}, i % 4 == 0 ? i % objects : -1});
  }
  for (int i = 0; i < 100; ++i) {
    map.keyframes.push_back({i,
                             i,
                             0.1 * i,
                             {Eigen::Quaterniond::Identity(),
                              {0.7 * room * std::cos(0.03 * i), -0.7 * room * std::sin(0.03 * i), 1.5}}});
  }
  return map;
}

// Plain surfaces, without what is done to the finished picture.
void Plain(SceneStyle& style) {
  style.light.ambient_occlusion = 0.0;
  style.light.outline = 0.0;
  style.light.eye_dome = 0.0;
  style.light.shadow = 0.0;
}

// One frame of 1280x720 with the camera moving, everything already on the device.
void DrawFrames(benchmark::State& state, const PictureOptions& options, const MapSnapshot& map) {
  PictureRenderer renderer(options);
  renderer.SetMap(map);
  renderer.Render();
  double angle = 0.0;
  for (auto _ : state) {
    angle += 3.0;
    benchmark::DoNotOptimize(renderer.Render(Azimuth(renderer.DefaultCamera(), angle)));
  }
}

void BM_Plain(benchmark::State& state, const char* anti_aliasing, double opacity) {
  PictureOptions options;
  options.backend = backend;
  options.style.anti_aliasing = *FromName<AntiAliasing>(anti_aliasing);
  options.style.objects.opacity = opacity;
  Plain(options.style);
  DrawFrames(state, options, LargeMap(30, 100000));
}
BENCHMARK_CAPTURE(BM_Plain, opaque, "none", 1.0)
    ->Unit(benchmark::kMillisecond)
    ->MeasureProcessCPUTime()
    ->UseRealTime();
BENCHMARK_CAPTURE(BM_Plain, translucent, "none", 0.5)
    ->Unit(benchmark::kMillisecond)
    ->MeasureProcessCPUTime()
    ->UseRealTime();
BENCHMARK_CAPTURE(BM_Plain, opaque_ssaa, "ssaa", 1.0)
    ->Unit(benchmark::kMillisecond)
    ->MeasureProcessCPUTime()
    ->UseRealTime();
BENCHMARK_CAPTURE(BM_Plain, translucent_ssaa, "ssaa", 0.5)
    ->Unit(benchmark::kMillisecond)
    ->MeasureProcessCPUTime()
    ->UseRealTime();

// The default style: ambient occlusion, outlines, eye-dome lighting, shadow.
void BM_Paper(benchmark::State& state, const char* anti_aliasing) {
  PictureOptions options;
  options.backend = backend;
  options.style.anti_aliasing = *FromName<AntiAliasing>(anti_aliasing);
  DrawFrames(state, options, LargeMap(30, 100000));
}
BENCHMARK_CAPTURE(BM_Paper, no_anti_aliasing, "none")
    ->Unit(benchmark::kMillisecond)
    ->MeasureProcessCPUTime()
    ->UseRealTime();
BENCHMARK_CAPTURE(BM_Paper, fxaa, "fxaa")
    ->Unit(benchmark::kMillisecond)
    ->MeasureProcessCPUTime()
    ->UseRealTime();
BENCHMARK_CAPTURE(BM_Paper, ssaa, "ssaa")
    ->Unit(benchmark::kMillisecond)
    ->MeasureProcessCPUTime()
    ->UseRealTime();

// 500 superquadrics and a million points.
void BM_Huge(benchmark::State& state, const char* anti_aliasing, double opacity) {
  PictureOptions options;
  options.backend = backend;
  options.style.anti_aliasing = *FromName<AntiAliasing>(anti_aliasing);
  options.style.objects.opacity = opacity;
  DrawFrames(state, options, LargeMap(500, 1000000));
}
BENCHMARK_CAPTURE(BM_Huge, opaque, "none", 1.0)
    ->Unit(benchmark::kMillisecond)
    ->MeasureProcessCPUTime()
    ->UseRealTime();
BENCHMARK_CAPTURE(BM_Huge, translucent, "none", 0.85)
    ->Unit(benchmark::kMillisecond)
    ->MeasureProcessCPUTime()
    ->UseRealTime();
BENCHMARK_CAPTURE(BM_Huge, translucent_ssaa, "ssaa", 0.85)
    ->Unit(benchmark::kMillisecond)
    ->MeasureProcessCPUTime()
    ->UseRealTime();

// 20 superquadrics in a room of about 300,000 dense points: floor and two walls.
CloudLayerPtr Room() {
  constexpr float kSide = 5.0F;
  constexpr int kSteps = 380;  // along a side
  constexpr float kStep = kSide / kSteps;
  CloudLayerBuilder cloud(kStep);
  for (int i = 0; i < kSteps; ++i) {
    for (int k = 0; k < kSteps; ++k) {
      const float a = kStep * (static_cast<float>(i) + 0.5F) - 0.5F * kSide;
      const float b = kStep * (static_cast<float>(k) + 0.5F);
      const auto level = static_cast<std::uint8_t>(60 + (i / 20 + k / 20) % 2 * 120);
      cloud.Add({a, b - 0.5F * kSide, 0.0F}, {level, 130, 90}, kStep);
      if (k < kSteps * 11 / 20) {
        cloud.Add({a, 0.5F * kSide, b}, {90, level, 130}, kStep);
        cloud.Add({-0.5F * kSide, a, b}, {130, 90, level}, kStep);
      }
    }
  }
  return cloud.Finish();
}

void BM_Dense(benchmark::State& state, const char* anti_aliasing) {
  PictureOptions options;
  options.backend = backend;
  options.style.anti_aliasing = *FromName<AntiAliasing>(anti_aliasing);
  options.layers.dense_cloud = Room();
  state.counters["points"] = static_cast<double>(options.layers.dense_cloud->points.size());
  DrawFrames(state, options, LargeMap(20, 4000));
}
BENCHMARK_CAPTURE(BM_Dense, fxaa, "fxaa")
    ->Unit(benchmark::kMillisecond)
    ->MeasureProcessCPUTime()
    ->UseRealTime();
BENCHMARK_CAPTURE(BM_Dense, ssaa, "ssaa")
    ->Unit(benchmark::kMillisecond)
    ->MeasureProcessCPUTime()
    ->UseRealTime();

// From nothing to the first frame of a small map.
void BM_FirstFrame(benchmark::State& state) {
  PictureOptions options;
  options.backend = backend;
  const MapSnapshot map = LargeMap(30, 100000);
  for (auto _ : state) {
    benchmark::DoNotOptimize(RenderPicture(map, options));
  }
}
BENCHMARK(BM_FirstFrame)->Unit(benchmark::kMillisecond)->MeasureProcessCPUTime()->UseRealTime();

// A new map on the device and a frame of it, as for each frame of a growth video.
void BM_NewMapAndFrame(benchmark::State& state) {
  PictureOptions options;
  options.backend = backend;
  PictureRenderer renderer(options);
  const MapSnapshot map = LargeMap(30, 100000);
  renderer.SetMap(map);
  for (auto _ : state) {
    renderer.SetMapKeepingFrame(map);
    benchmark::DoNotOptimize(renderer.Render());
  }
}
BENCHMARK(BM_NewMapAndFrame)->Unit(benchmark::kMillisecond)->MeasureProcessCPUTime()->UseRealTime();

// Takes --rendering-backend=NAME out of the arguments.
void TakeBackend(int& argc, char** argv) {
  constexpr std::string_view kFlag = "--rendering-backend=";
  const auto flag =
      std::find_if(argv, argv + argc, [&](const char* a) { return std::string_view(a).starts_with(kFlag); });
  if (flag == argv + argc) {
    return;
  }
  const auto named = FromName<RenderBackend>(std::string_view(*flag).substr(kFlag.size()));
  if (!named) {
    throw UsageError(std::string(*flag) + ": expected auto, osmesa or egl");
  }
  backend = *named;
  std::rotate(flag, flag + 1, argv + argc);
  --argc;
}

}  // namespace
}  // namespace sqslam

int main(int argc, char** argv) {
  sqslam::TakeBackend(argc, argv);
  benchmark::Initialize(&argc, argv);
  benchmark::AddCustomContext("drawn by", sqslam::OffscreenContext(sqslam::backend).Description());
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
