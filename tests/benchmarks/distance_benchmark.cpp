// Measures signed distances and gradients of many points: from one solid, and from a map of 13.

#include <benchmark/benchmark.h>

#include <random>

#include "slam/scene/distance_field.h"
#include "slam/scene/distance_table.h"
#include "tests/scene/made_room.h"

namespace sqslam {
namespace {

std::vector<Eigen::Vector3d> PointsAround(const Eigen::Vector3d& center, double reach, std::size_t count) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  std::vector<Eigen::Vector3d> points(count);
  for (Eigen::Vector3d& p : points) {
    p = center + reach * Eigen::Vector3d(unit(random), unit(random), unit(random));
  }
  return points;
}

void Measure(benchmark::State& state, const MapSnapshot& map, double reach, int threads) {
  const auto count = static_cast<std::size_t>(state.range(0));
  const std::vector<Eigen::Vector3d> points = PointsAround({0.0, 0.0, 0.5}, reach, count);
  std::vector<double> distances(count);
  std::vector<Eigen::Vector3d> gradients(count);
  for (auto _ : state) {
    DistanceField(map).At(points, distances, gradients, threads);
    benchmark::DoNotOptimize(distances.data());
  }
  state.SetItemsProcessed(state.iterations() * state.range(0));
}

MapSnapshot OneSolid(double e1, double e2) {
  MapSnapshot map;
  map.objects.emplace_back().superquadric = {{{0.3, 0.2, 0.15}, e1, e2}, {{}, {0.0, 0.0, 0.5}}};
  return map;
}

void BM_Solid(benchmark::State& state) {
  Measure(state,
          OneSolid(0.1 * static_cast<double>(state.range(1)), 0.1 * static_cast<double>(state.range(2))), 1.0,
          2);
}
BENCHMARK(BM_Solid)
    ->Args({3'000'000, 2, 2})
    ->Args({3'000'000, 2, 10})
    ->Args({3'000'000, 10, 10})
    ->Args({10'000, 2, 10})
    ->UseRealTime();

void BM_Map(benchmark::State& state) {
  MapSnapshot map = testing::MadeRoom();
  map.objects.resize(13);
  Measure(state, map, 2.0, 2);
}
BENCHMARK(BM_Map)->Arg(3'000'000)->Arg(10'000)->UseRealTime();

}  // namespace
}  // namespace sqslam

BENCHMARK_MAIN();
