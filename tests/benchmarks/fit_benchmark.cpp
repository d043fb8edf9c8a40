// How well superquadrics are recovered from half-seen, noisy clouds with outliers, over the range of shapes:
// quartiles of the 3D IoU, in total and for each (e1, e2), and the time of a fit.
// Usage: fit_benchmark [CLOUDS_PER_SHAPE [POINTS [SEED [option=value ...]]]]

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <map>
#include <vector>

#include "slam/fitting/fitting.h"
#include "slam/geometry/solid_iou.h"
#include "slam/util/options.h"
#include "tests/fitting/synthetic_cloud.h"

namespace {

double Quantile(std::vector<double> values, double share) {
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

void PrintRow(const std::string& name, const std::vector<double>& values) {
  fmt::print("{:<22} {:>5} {:>7.3f} {:>7.3f} {:>7.3f} {:>7.3f} {:>7.3f}\n", name, values.size(),
             Quantile(values, 0.0), Quantile(values, 0.05), Quantile(values, 0.25), Quantile(values, 0.5), Quantile(values, 0.75));
}

}  // namespace

int main(int argc, char** argv) {
  using namespace sqslam;  // NOLINT
  const int clouds = argc > 1 ? std::atoi(argv[1]) : 4;
  const int points = argc > 2 ? std::atoi(argv[2]) : 1000;
  std::mt19937_64 random(argc > 3 ? std::atoi(argv[3]) : 1);
  FitOptions fit_options;
  for (int i = 4; i < argc; ++i) {
    SetOption(argv[i], fit_options);
  }
  const bool verbose = std::getenv("VERBOSE") != nullptr;
  std::vector<double> all;
  std::vector<double> milliseconds;
  std::map<std::string, std::vector<double>> by_shape;
  for (const double e1 : {0.1, 0.5, 1.0, 1.5, 1.9}) {
    for (const double e2 : {0.1, 0.5, 1.0, 1.5, 1.9}) {
      for (int i = 0; i < clouds; ++i) {
        const PosedSuperquadric truth = testing::RandomlyPosed(e1, e2, 3.0, random);
        testing::CloudOptions options;
        options.points = points;
        const auto cloud = testing::SampleCloud(truth, options, random);
        const auto begin = std::chrono::steady_clock::now();
        const SuperquadricFit fit = FitSuperquadric(cloud, fit_options);
        const std::chrono::duration<double, std::milli> time = std::chrono::steady_clock::now() - begin;
        milliseconds.push_back(time.count());
        const double iou = IoU(Solid::FromSuperquadric(fit.superquadric), Solid::FromSuperquadric(truth));
        all.push_back(iou);
        by_shape[fmt::format("e1 {:.1f} e2 {:.1f}", e1, e2)].push_back(iou);
        if (verbose && iou < 0.9) {
          const auto& s = fit.superquadric.shape;
          const auto& t = truth.shape;
          fmt::print("{:.1f} {:.1f} [{:.2f} {:.2f} {:.2f}] vol {:.2f} -> {:.2f} {:.2f} [{:.2f} {:.2f} {:.2f}] vol {:.2f} iou {:.3f} inl {:.2f} noise {:.4f} (true {:.4f})\n", e1, e2,
            t.half_size[0], t.half_size[1], t.half_size[2], t.Volume(), s.e1, s.e2, s.half_size[0], s.half_size[1], s.half_size[2], s.Volume(), iou, fit.inlier_share, fit.noise, 0.02*t.half_size.mean());
        }
      }
    }
  }
  fmt::print("{:<22} {:>5} {:>7} {:>7} {:>7} {:>7} {:>7}\n", "3D IoU", "n", "worst", "5 %", "25 %", "median", "75 %");
  PrintRow("all shapes", all);
  for (const auto& [name, values] : by_shape) {
    PrintRow(name, values);
  }
  fmt::print("time of a fit of {} points: median {:.0f} ms, longest {:.0f} ms\n", points,
             Quantile(milliseconds, 0.5), Quantile(milliseconds, 1.0));
  return 0;
}
