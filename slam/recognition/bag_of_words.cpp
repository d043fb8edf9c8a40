#include "slam/recognition/bag_of_words.h"

#include <algorithm>

namespace sqslam {

double Similarity(const BagOfWords& v, const BagOfWords& w) {
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
