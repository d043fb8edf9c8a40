#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "slam/recognition/word_tree.h"

namespace sqslam {

struct WordWeight {
  WordId word = 0;
  float weight = 0.0F;
  friend bool operator==(const WordWeight&, const WordWeight&) = default;
};

// An image as the words it shows: rising word ids, positive weights that add up to 1 (empty for an image
// without features).
struct BagOfWords {
  std::vector<WordWeight> words;
  friend bool operator==(const BagOfWords&, const BagOfWords&) = default;
};

// 1 - |v - w|_1 / 2 (Galvez-Lopez & Tardos 2012, eq. 2): 1 for the same words in the same shares, 0 where no
// word is shared.
inline double Similarity(const BagOfWords& v, const BagOfWords& w) {
  // As both sum up to 1, 1 - |v - w| / 2 is the sum of the smaller weights.
  double sum = 0.0;
  auto a = v.words.begin();
  auto b = w.words.begin();
  while (a != v.words.end() && b != w.words.end()) {
    if (a->word < b->word) {
      ++a;
    } else if (b->word < a->word) {
      ++b;
    } else {
      sum += static_cast<double>(std::min(a->weight, b->weight));
      ++a;
      ++b;
    }
  }
  return sum;
}

}  // namespace sqslam
