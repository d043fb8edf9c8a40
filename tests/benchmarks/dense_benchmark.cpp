#include <benchmark/benchmark.h>

#include <opencv2/core.hpp>

#include "slam/dense/dense_cloud.h"
#include "slam/dense/stereo.h"
#include "tests/dense/panel_world.h"

namespace sqslam {
namespace {

// Depth of a keyframe of 320x240 pixels from four views.
void BM_EstimateDepth(benchmark::State& state) {
  const testing::PaintedScene scene;
  const StereoView keyframe = scene.View({0.0, 0.0, 0.0});
  const std::vector<StereoView> views = {scene.View({0.25, 0.0, 0.0}), scene.View({-0.25, 0.02, 0.0}),
                                         scene.View({0.12, 0.0, 0.03}), scene.View({-0.12, 0.0, 0.0})};
  for (auto _ : state) {
    benchmark::DoNotOptimize(EstimateDepth(keyframe, views, views, scene.camera, {1.2, 6.0}, {}));
  }
}
BENCHMARK(BM_EstimateDepth)->Unit(benchmark::kMillisecond);

// A cloud of 40 depth maps along a wall and a box.
void BM_FuseCloud(benchmark::State& state) {
  const testing::PaintedScene scene;
  std::vector<DepthMap> maps;
  for (int i = 0; i < 40; ++i) {
    const Eigen::Vector3d place(0.02 * (i - 20), 0.0, 0.0);
    DepthMap& map = maps.emplace_back();
    map.camera = scene.camera;
    map.T_map_camera = {Eigen::Quaterniond::Identity(), place};
    map.depth = cv::Mat(scene.camera.height, scene.camera.width, CV_32F);
    map.views = cv::Mat(map.depth.size(), CV_8U, cv::Scalar(3));
    map.bgr = cv::Mat(map.depth.size(), CV_8UC3, cv::Scalar(30, 20, 10));
    for (int y = 0; y < map.depth.rows; ++y) {
      for (int x = 0; x < map.depth.cols; ++x) {
        map.depth.at<float>(y, x) = static_cast<float>(scene.Depth(place, x, y) * (1.0 + 0.003 * (i % 3)));
      }
    }
  }
  for (auto _ : state) {
    CloudFusion fusion(0.01, 1);
    for (const DepthMap& map : maps) {
      fusion.Add(map);
    }
    benchmark::DoNotOptimize(fusion.Cloud());
  }
}
BENCHMARK(BM_FuseCloud)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace sqslam

int main(int argc, char** argv) {
  cv::setNumThreads(1);
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
}
