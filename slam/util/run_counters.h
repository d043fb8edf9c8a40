#pragma once

#include <array>
#include <utility>

namespace sqslam {

// Counted events of a run.
struct RunCounters {
  int resets = 0;           // submaps dropped because they never grew
  int losses = 0;           // times that tracking was lost
  int relocalizations = 0;  // times that relocalisation recovered it
  int loops = 0;            // loops closed
  int returns = 0;          // returns to mapped places that tracking recognised, without a loop closure
  int merges = 0;           // submaps merged into others
  int placed_at_end = 0;    // frames placed at the end of the run
  int tied_at_end = 0;      // merges at the end of the run (counted in `merges` too)

  bool operator==(const RunCounters&) const = default;
};

// Names of the counters in stats.json, in its order.
inline constexpr std::array<std::pair<const char*, int RunCounters::*>, 8> kRunCounters = {
    {{"resets", &RunCounters::resets},
     {"losses", &RunCounters::losses},
     {"relocalisations", &RunCounters::relocalizations},
     {"loops", &RunCounters::loops},
     {"returns", &RunCounters::returns},
     {"merges", &RunCounters::merges},
     {"placed_at_end", &RunCounters::placed_at_end},
     {"tied_at_end", &RunCounters::tied_at_end}}};

inline RunCounters operator+(RunCounters a, const RunCounters& b) {
  for (const auto& [name, counter] : kRunCounters) {
    a.*counter += b.*counter;
  }
  return a;
}

}  // namespace sqslam
