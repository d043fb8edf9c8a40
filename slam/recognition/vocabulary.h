#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

#include "slam/recognition/bag_of_words.h"
#include "slam/recognition/word_tree.h"

namespace sqslam {

// Visual words for ORB descriptors, with the weight of each: how much seeing it says about the place (tf-idf;
// Sivic & Zisserman 2003, Galvez-Lopez & Tardos 2012). A value; all members that are const may be called from
// several threads.
class Vocabulary {
 public:
  // Learns from the descriptors of many images, one inner vector an image. Throws InputError where there is
  // no descriptor at all.
  static Vocabulary Train(const std::vector<std::vector<Descriptor>>& images,
                          const VocabularyOptions& options, const TrainingProgress& progress = {});

  // Throws InputError that names the file and what was expected: no vocabulary, another version, cut short,
  // damaged.
  static Vocabulary Load(const std::filesystem::path& path);
  void Save(const std::filesystem::path& path) const;  // whole or not at all; InputError where it cannot
  static bool IsVocabularyFile(const std::filesystem::path& path);  // by its first bytes

  // The words of an image.
  BagOfWords Transform(const std::vector<Descriptor>& descriptors) const;

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
