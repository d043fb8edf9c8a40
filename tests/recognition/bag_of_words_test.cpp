
#include <gtest/gtest.h>

#include <map>

#include "slam/recognition/vocabulary.h"
#include "slam/util/error.h"
#include "tests/recognition/random_descriptors.h"

namespace sqslam::testing {
namespace {

TEST(Similarity, EqualsOneMinusHalfL1Distance) {
  const BagOfWords v{{{1, 0.5F}, {4, 0.25F}, {7, 0.25F}}};
  const BagOfWords w{{{1, 0.25F}, {5, 0.5F}, {7, 0.25F}}};
  // |v - w| = 0.25 + 0.25 + 0.5 + 0
  EXPECT_DOUBLE_EQ(Similarity(v, w), 0.5);
  EXPECT_DOUBLE_EQ(Similarity(w, v), 0.5);
  EXPECT_DOUBLE_EQ(Similarity(v, v), 1.0);
  EXPECT_EQ(Similarity(v, {{{2, 1.0F}}}), 0.0);
  EXPECT_EQ(Similarity(v, {}), 0.0);
}

TEST(Vocabulary, SortsBagsAndNormalisesWeights) {
  const auto images = ClusteredImages(20, 100, 60, 1);
  const Vocabulary vocabulary = Vocabulary::Train(images, {.branching = 6, .depth = 3});
  for (const auto& image : images) {
    const BagOfWords bag = vocabulary.Transform(image);
    double sum = 0.0;
    for (std::size_t i = 0; i < bag.words.size(); ++i) {
      EXPECT_LT(bag.words[i].word, vocabulary.Words());
      EXPECT_GT(bag.words[i].weight, 0.0F);
      EXPECT_TRUE(i == 0 || bag.words[i - 1].word < bag.words[i].word);
      sum += static_cast<double>(bag.words[i].weight);
    }
    EXPECT_NEAR(sum, 1.0, 1e-5);
    EXPECT_NEAR(Similarity(bag, bag), 1.0, 1e-5);
  }
  EXPECT_TRUE(vocabulary.Transform({}).words.empty());
}

TEST(Vocabulary, WeighsRareWordsMore) {
  std::mt19937 random(3);
  const Descriptor common = RandomDescriptor(random);
  const Descriptor rare = RandomDescriptor(random);
  const Descriptor filler = RandomDescriptor(random);
  std::vector<std::vector<Descriptor>> images(8, {common, filler});
  images[0] = {common, rare};
  images[7] = {filler};
  const Vocabulary vocabulary = Vocabulary::Train(images, {.branching = 3, .depth = 1});
  ASSERT_EQ(vocabulary.Words(), 3u);
  const BagOfWords bag = vocabulary.Transform({common, rare});
  ASSERT_EQ(bag.words.size(), 2u);
  const WordId rare_word = vocabulary.Transform({rare}).words.at(0).word;
  const std::size_t rare_at = bag.words[0].word == rare_word ? 0 : 1;
  // ln(8 / 1) to ln(8 / 7)
  EXPECT_NEAR(bag.words[rare_at].weight / bag.words[1 - rare_at].weight, std::log(8.0) / std::log(8.0 / 7.0),
              1e-3);
}

TEST(Vocabulary, KeepsMostWordsOfDisturbedDescriptors) {
  const auto images = ClusteredImages(20, 100, 60, 1);
  const Vocabulary vocabulary = Vocabulary::Train(images, {.branching = 8, .depth = 2});
  std::mt19937 random(9);
  std::vector<Descriptor> disturbed;
  for (const Descriptor& descriptor : images[4]) {
    disturbed.push_back(Disturbed(descriptor, 8, random));
  }
  const BagOfWords query = vocabulary.Transform(disturbed);
  EXPECT_GT(Similarity(query, vocabulary.Transform(images[4])), 0.75);
}

TEST(Vocabulary, RefusesTrainingWithoutDescriptors) {
  EXPECT_THROW(Vocabulary::Train({}, {}), InputError);
  EXPECT_THROW(Vocabulary::Train({{}, {}}, {}), InputError);
}

}  // namespace
}  // namespace sqslam::testing
