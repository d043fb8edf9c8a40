#include "slam/util/statistics.h"

namespace sqslam {
namespace {

double Position(const std::vector<double>& values, double q) {
  return q * static_cast<double>(values.size() - 1);
}

}  // namespace

double MeanMedian(std::vector<double> values) {
  const double upper = NthSmallest(values, values.size() / 2);
  return values.size() % 2 == 1 ? upper : 0.5 * (NthSmallest(values, values.size() / 2 - 1) + upper);
}

double LowerQuantile(std::vector<double> values, double q) {
  return NthSmallest(values, static_cast<std::size_t>(Position(values, q)));
}

double NearestQuantile(std::vector<double> values, double q) {
  return NthSmallest(values, static_cast<std::size_t>(Position(values, q) + 0.5));
}

double LinearQuantile(std::vector<double> values, double q) {
  const double position = Position(values, q);
  const auto rank = static_cast<std::size_t>(position);
  const double low = NthSmallest(values, rank);
  const double high = NthSmallest(values, std::min(rank + 1, values.size() - 1));
  return low + (position - static_cast<double>(rank)) * (high - low);
}

}  // namespace sqslam
