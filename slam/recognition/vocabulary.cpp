#include "slam/recognition/vocabulary.h"

#include <algorithm>
#include <cmath>

#include "slam/util/error.h"

namespace sqslam {

Vocabulary Vocabulary::Train(const std::vector<std::vector<Descriptor>>& images,
                             const VocabularyOptions& options, const TrainingProgress& progress) {
  std::vector<DescriptorBits> all;
  for (const std::vector<Descriptor>& image : images) {
    std::transform(image.begin(), image.end(), std::back_inserter(all), ToBits);
  }
  if (all.empty()) {
    throw InputError("no features to learn words from, expected images with texture");
  }
  Vocabulary vocabulary;
  vocabulary.trained_images_ = images.size();
  vocabulary.trained_descriptors_ = all.size();
  vocabulary.tree_ = WordTree::Train(std::move(all), options, progress);

  std::vector<std::uint32_t> images_with(vocabulary.Words(), 0);
  std::vector<WordId> words;
  for (const std::vector<Descriptor>& image : images) {
    words.clear();
    for (const Descriptor& descriptor : image) {
      words.push_back(vocabulary.tree_.WordOf(ToBits(descriptor)));
    }
    std::sort(words.begin(), words.end());
    words.erase(std::unique(words.begin(), words.end()), words.end());
    for (const WordId word : words) {
      ++images_with[word];
    }
  }
  for (const std::uint32_t count : images_with) {
    // A word that no training image comes down to (its cluster's borders moved last) is as rare as one.
    const double seen = std::max(1.0, static_cast<double>(count));
    vocabulary.idf_.push_back(static_cast<float>(std::log(static_cast<double>(images.size()) / seen)));
  }
  return vocabulary;
}

BagOfWords Vocabulary::Transform(const std::vector<Descriptor>& descriptors) const {
  std::vector<WordId> words;
  words.reserve(descriptors.size());
  for (const Descriptor& descriptor : descriptors) {
    words.push_back(tree_.WordOf(ToBits(descriptor)));
  }
  std::sort(words.begin(), words.end());
  BagOfWords bag;
  double total = 0.0;
  for (auto word = words.begin(); word != words.end();) {
    const auto next = std::upper_bound(word, words.end(), *word);
    const float weight = static_cast<float>(next - word) * idf_[*word];
    if (weight > 0.0F) {  // a word that every training image showed says nothing
      bag.words.push_back({*word, weight});
      total += static_cast<double>(weight);
    }
    word = next;
  }
  for (WordWeight& entry : bag.words) {
    entry.weight = static_cast<float>(static_cast<double>(entry.weight) / total);
  }
  return bag;
}

}  // namespace sqslam
