#include <benchmark/benchmark.h>

#include <opencv2/imgproc.hpp>

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

}  // namespace
}  // namespace sqslam

int main(int argc, char** argv) {
  cv::setNumThreads(1);
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
}
