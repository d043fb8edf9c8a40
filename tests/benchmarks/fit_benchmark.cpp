// Measures how well superquadrics are recovered from half-seen, noisy clouds with outliers over all shapes:
// quartiles of the 3D IoU, in total and for each (e1, e2); how exactly the fit commutes with similarities and
// permutations of the cloud; the time of a fit.
// Usage: fit_benchmark [CLOUDS_PER_SHAPE [POINTS [SEED [OPTION=VALUE ...]]]]

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <map>
#include <string>
#include <vector>

#include "slam/fitting/fitting.h"
#include "slam/geometry/solid_iou.h"
#include "slam/util/options.h"
#include "tests/fitting/synthetic_cloud.h"

namespace {

using namespace sqslam;  // NOLINT

struct Sample {
  double e1, e2;
  double iou;
  double milliseconds;
  double deviation;  // of the fit of the moved cloud from the moved fit
};

double Quantile(std::vector<double> values, double share) {
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

void PrintRow(const std::string& name, const std::vector<double>& values) {
  fmt::print("{:<22} {:>5} {:>7.3f} {:>7.3f} {:>7.3f} {:>7.3f} {:>7.3f}\n", name, values.size(),
             Quantile(values, 0.0), Quantile(values, 0.05), Quantile(values, 0.25), Quantile(values, 0.5),
             Quantile(values, 0.75));
}

Sample Measure(double e1, double e2, int points, const FitOptions& options, std::mt19937_64& random) {
  const PosedSuperquadric truth = testing::RandomlyPosed(e1, e2, 3.0, random);
  std::vector<Eigen::Vector3d> cloud = testing::SampleCloud(truth, {points, 0.1, 0.01, true}, random);
  const auto begin = std::chrono::steady_clock::now();
  const SuperquadricFit fit = FitSuperquadric(cloud, options);
  const std::chrono::duration<double, std::milli> time = std::chrono::steady_clock::now() - begin;
  const double iou = IoU(Solid::FromSuperquadric(fit.superquadric), Solid::FromSuperquadric(truth));
  const double scale = std::exp(std::uniform_real_distribution<double>(-4.0, 4.0)(random));
  const Sim3d S{scale, testing::RandomRotation(random), scale * Eigen::Vector3d(3.0, -20.0, 7.0)};
  std::shuffle(cloud.begin(), cloud.end(), random);
  std::transform(cloud.begin(), cloud.end(), cloud.begin(), [&](const Eigen::Vector3d& p) { return S * p; });
  return {e1, e2, iou, time.count(),
          testing::Difference(FitSuperquadric(cloud, options).superquadric,
                              testing::Transformed(S, fit.superquadric))};
}

}  // namespace

int main(int argc, char** argv) {
  const int clouds = argc > 1 ? std::atoi(argv[1]) : 4;
  const int points = argc > 2 ? std::atoi(argv[2]) : 1000;
  std::mt19937_64 random(argc > 3 ? std::atoi(argv[3]) : 1);
  FitOptions options;
  for (int i = 4; i < argc; ++i) {
    SetOption(argv[i], options);
  }
  std::vector<double> all;
  std::vector<double> milliseconds;
  std::vector<double> deviations;
  std::map<std::string, std::vector<double>> by_shape;
  for (const double e1 : {0.1, 0.5, 1.0, 1.5, 1.9}) {
    for (const double e2 : {0.1, 0.5, 1.0, 1.5, 1.9}) {
      for (int i = 0; i < clouds; ++i) {
        const Sample sample = Measure(e1, e2, points, options, random);
        all.push_back(sample.iou);
        by_shape[fmt::format("e1 {:.1f} e2 {:.1f}", e1, e2)].push_back(sample.iou);
        milliseconds.push_back(sample.milliseconds);
        deviations.push_back(sample.deviation);
      }
    }
  }
  fmt::print("{:<22} {:>5} {:>7} {:>7} {:>7} {:>7} {:>7}\n", "3D IoU", "n", "worst", "5 %", "25 %", "median",
             "75 %");
  PrintRow("all shapes", all);
  for (const auto& [name, values] : by_shape) {
    PrintRow(name, values);
  }
  fmt::print(
      "parameters of the moved and shuffled cloud against the moved fit: median {:.1e}, "
      "99 % {:.1e}, worst {:.1e}\n",
      Quantile(deviations, 0.5), Quantile(deviations, 0.99), Quantile(deviations, 1.0));
  fmt::print("time of a fit of {} points: median {:.0f} ms, longest {:.0f} ms\n", points,
             Quantile(milliseconds, 0.5), Quantile(milliseconds, 1.0));
  return 0;
}
