#pragma once

#include <cstddef>
#include <nanoflann.hpp>
#include <utility>

// The types of nanoflann's searches, renamed with 1.5: Debian 12 has 1.4, Debian 13 has 1.7.
namespace sqslam {

#if NANOFLANN_VERSION >= 0x150
using NearestParameters = nanoflann::SearchParameters;
using NearestPoint = nanoflann::ResultItem<std::size_t, double>;  // first: index, second: squared distance
#else
using NearestParameters = nanoflann::SearchParams;
using NearestPoint = std::pair<std::size_t, double>;  // first: index, second: squared distance
#endif

}  // namespace sqslam
