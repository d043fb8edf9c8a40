#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace sqslam {

// Order statistics. The set of values must not be empty.

// Returns the value at index `rank` of the sorted values; reorders them.
template <typename T>
T NthSmallest(std::vector<T>& values, std::size_t rank) {
  const auto nth = values.begin() + rank;
  std::nth_element(values.begin(), nth, values.end());
  return *nth;
}

// Returns the median; for an even number of values the larger of the middle two.
template <typename T>
T UpperMedian(std::vector<T> values) {
  return NthSmallest(values, values.size() / 2);
}

// Returns the median; for an even number of values the mean of the middle two.
double MeanMedian(std::vector<double> values);

// Quantiles for q in [0, 1], at position q * (size - 1) of the sorted values: the value at or before it, the
// nearest value, and the linear interpolation between its neighbours.
double LowerQuantile(std::vector<double> values, double q);
double NearestQuantile(std::vector<double> values, double q);
double LinearQuantile(std::vector<double> values, double q);

}  // namespace sqslam
