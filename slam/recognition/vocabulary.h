#pragma once

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "slam/recognition/word_tree.h"

namespace sqslam {

struct WordWeight {
  WordId word = 0;
  float weight = 0.0F;
  friend bool operator==(const WordWeight&, const WordWeight&) = default;
};

// An image as its visual words: ascending word ids and positive weights that sum to 1 (empty without
// features).
struct BagOfWords {
  std::vector<WordWeight> words;
  friend bool operator==(const BagOfWords&, const BagOfWords&) = default;
};

// Returns 1 - |v - w|_1 / 2 (Galvez-Lopez & Tardos 2012, eq. 2): 1 for the same words with the same weights,
// 0 if no word is shared.
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

// Visual words for ORB descriptors, weighted by how much they say about the place (tf-idf; Sivic & Zisserman
// 2003, Galvez-Lopez & Tardos 2012). A value; const members are thread-safe.
class Vocabulary {
 public:
  // Learns from the descriptors of many images, one inner vector per image. Throws InputError if there is no
  // descriptor at all.
  static Vocabulary Train(const std::vector<std::vector<Descriptor>>& images,
                          const VocabularyOptions& options, const TrainingProgress& progress = {});

  // Throws InputError that names the file and what was expected: no vocabulary, another version, truncated,
  // damaged.
  static Vocabulary Load(const std::filesystem::path& path);
  void Save(const std::filesystem::path& path) const;               // atomic; throws InputError on failure
  static bool IsVocabularyFile(const std::filesystem::path& path);  // by its first bytes

  // Returns the bag of words of an image.
  BagOfWords Transform(const std::vector<Descriptor>& descriptors) const;

  // Returns a checksum of the contents as text, to tell vocabularies apart.
  std::string Fingerprint() const;

  std::size_t Words() const { return tree_.Words(); }
  std::size_t Nodes() const { return tree_.Nodes(); }
  int Depth() const { return tree_.Depth(); }
  std::uint64_t TrainedImages() const { return trained_images_; }
  std::uint64_t TrainedDescriptors() const { return trained_descriptors_; }

 private:
  Vocabulary() = default;

  WordTree tree_;
  std::vector<float> idf_;  // by word: ln(images / images that show it)
  std::uint64_t trained_images_ = 0;
  std::uint64_t trained_descriptors_ = 0;
};

}  // namespace sqslam
