#pragma once

namespace sqslam {

// Quantiles of chi-squared: the squared error, in units of its variance, above which an observation is an
// outlier.
inline constexpr double kChi2OneDof = 3.841;    // 95 %: distance from a line
inline constexpr double kChi2TwoDof = 5.991;    // 95 %: reprojection error
inline constexpr double kChi2TwoDof99 = 9.210;  // 99 %, for matches that were found without a search radius

}  // namespace sqslam
