#pragma once

#include <map>
#include <vector>

#include "slam/objects/landmark.h"

namespace sqslam {

// Ids of the landmarks whose estimates are outdated, the most outdated ones, at most `most` (0: no limit).
// Young landmarks change with every box, old ones hardly: what counts is the share of new boxes.
std::vector<int> MostOutdated(const std::map<int, Landmark>& landmarks, int most);

// The ids in the order in which they are estimated, the largest first: small objects profit from what was
// just learnt of the large ones, what hides them and what they stand on.
std::vector<int> LargestFirst(const std::map<int, Landmark>& landmarks, const std::vector<int>& ids);

}  // namespace sqslam
