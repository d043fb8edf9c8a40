#include <benchmark/benchmark.h>

#include <opencv2/imgproc.hpp>
#include <random>

#include "slam/features/matching.h"
#include "slam/features/orb_extractor.h"
#include "tests/support/textured_world.h"

namespace sqslam {
namespace {

// A frame of 640x480 with corners at all scales, seen from two places.
Frame LargeFrame(double x) {
  const testing::TexturedWorld world;
  Frame frame = world.Render(0, {Eigen::Quaterniond::Identity(), {x, 0.0, 0.0}});
  cv::resize(frame.bgr, frame.bgr, {640, 480}, 0, 0, cv::INTER_CUBIC);
  cv::cvtColor(frame.bgr, frame.gray, cv::COLOR_BGR2GRAY);
  return frame;
}

Camera LargeCamera() {
  Camera camera;
  camera.width = 640;
  camera.height = 480;
  camera.fx = camera.fy = 520.0;
  camera.cx = 320.0;
  camera.cy = 240.0;
  return camera;
}

void BM_Extract(benchmark::State& state) {
  OrbOptions options;
  options.num_features = static_cast<int>(state.range(0));
  OrbExtractor extractor(options);
  const Frame frame = LargeFrame(0.0);
  const Camera camera = LargeCamera();
  std::size_t features = 0;
  for (auto _ : state) {
    features = extractor.Extract(frame.gray, frame.bgr, camera).Size();
  }
  state.counters["features"] = static_cast<double>(features);
}
BENCHMARK(BM_Extract)->Arg(1000)->Arg(2000)->Unit(benchmark::kMillisecond);

// Keypoints all over a photograph, with random descriptors.
FrameFeatures ScatteredFeatures(int count, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> x(0.0, 1280.0);
  std::uniform_real_distribution<double> y(0.0, 960.0);
  FrameFeatures features;
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector2d pixel(x(random), y(random));
    features.keypoints.push_back({pixel, pixel});
    for (std::uint8_t& byte : features.descriptors.emplace_back()) {
      byte = static_cast<std::uint8_t>(random());
    }
  }
  return features;
}

void BM_MatchAlongEpipolarLines(benchmark::State& state) {
  const auto count = static_cast<int>(state.range(0));
  const FrameFeatures a = ScatteredFeatures(count, 1);
  const FrameFeatures b = ScatteredFeatures(count, 2);
  Eigen::Matrix3d F;  // of a camera that moved sideways and forward
  F << 0.0, -0.3, 130.0, 0.3, 0.0, -900.0, -140.0, 880.0, 300.0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(MatchAlongEpipolarLines(a, b, F, 3.0, kMaxUnguidedDistance, 0.85));
  }
}
BENCHMARK(BM_MatchAlongEpipolarLines)->Arg(1000)->Arg(5000)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace sqslam

int main(int argc, char** argv) {
  cv::setNumThreads(1);
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
}
