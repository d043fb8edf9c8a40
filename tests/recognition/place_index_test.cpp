#include "slam/recognition/place_index.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace sqslam::testing {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

// The words, each with the same weight.
BagOfWords Bag(const std::vector<WordId>& words) {
  BagOfWords bag;
  for (const WordId word : words) {
    bag.words.push_back({word, 1.0F / static_cast<float>(words.size())});
  }
  return bag;
}

std::vector<PlaceId> Ids(const std::vector<PlaceCandidate>& candidates) {
  std::vector<PlaceId> ids;
  for (const PlaceCandidate& candidate : candidates) {
    ids.push_back(candidate.id);
  }
  return ids;
}

class PlaceIndexTest : public ::testing::Test {
 protected:
  PlaceQuery query_{.bow = &bag_, .exclude = {}, .covisible = {}};
  BagOfWords bag_ = Bag({1, 2, 3, 4, 5, 6, 7, 8, 9, 10});
  PlaceIndex index_;
};

TEST_F(PlaceIndexTest, FindsNothingWithoutSharedWords) {
  EXPECT_THAT(index_.Query(query_), IsEmpty());
  index_.Add(1, Bag({20, 21}));
  EXPECT_THAT(index_.Query(query_), IsEmpty());
  const BagOfWords empty;
  query_.bow = &empty;
  EXPECT_THAT(index_.Query(query_), IsEmpty());
}

TEST_F(PlaceIndexTest, ScoresIdenticalPlaceOne) {
  index_.Add(7, bag_);
  const auto candidates = index_.Query(query_);
  ASSERT_THAT(Ids(candidates), ElementsAre(7));
  EXPECT_NEAR(candidates[0].score, 1.0, 1e-6);
}

TEST_F(PlaceIndexTest, ScoresBySimilarityOfBags) {
  const BagOfWords other = Bag({1, 2, 3, 4, 5, 6, 7, 8, 50, 51});
  index_.Add(3, other);
  EXPECT_NEAR(index_.Query(query_).at(0).score, Similarity(bag_, other), 1e-9);
}

TEST_F(PlaceIndexTest, RanksByScoreThenId) {
  index_.Add(5, Bag({1, 2, 3, 4, 5, 6, 7, 8, 9, 30}));
  index_.Add(9, bag_);
  index_.Add(4, Bag({1, 2, 3, 4, 5, 6, 7, 8, 9, 30}));
  EXPECT_THAT(Ids(index_.Query(query_)), ElementsAre(9, 4, 5));
  query_.max_candidates = 2;
  EXPECT_THAT(Ids(index_.Query(query_)), ElementsAre(9, 4));
}

TEST_F(PlaceIndexTest, SkipsPlacesWithTooFewSharedWords) {
  query_.min_group_score = 0.0;
  index_.Add(1, bag_);                           // 10 shared
  index_.Add(2, Bag({1, 2, 3, 4, 5, 6, 7, 8}));  // 8
  index_.Add(3, Bag({1, 2, 3, 4, 5, 6, 7}));     // 7
  EXPECT_THAT(Ids(index_.Query(query_)), ElementsAre(1, 2));
}

TEST_F(PlaceIndexTest, IgnoresExcludedPlaces) {
  index_.Add(1, bag_);
  index_.Add(2, Bag({1, 2, 3, 20, 21}));
  EXPECT_THAT(Ids(index_.Query(query_)), ElementsAre(1));
  query_.exclude = [](PlaceId id) { return id == 1; };
  EXPECT_THAT(Ids(index_.Query(query_)), ElementsAre(2));
}

TEST_F(PlaceIndexTest, SkipsPlacesBelowMinScore) {
  index_.Add(1, Bag({1, 2, 3, 4, 5, 20, 21, 22, 23, 24}));
  query_.min_score = 0.49;
  EXPECT_THAT(Ids(index_.Query(query_)), ElementsAre(1));
  query_.min_score = 0.51;
  EXPECT_THAT(index_.Query(query_), IsEmpty());
}

TEST_F(PlaceIndexTest, GroupsCovisiblePlacesIntoOneCandidate) {
  index_.Add(1, Bag({1, 2, 3, 4, 5, 6, 7, 8, 30, 31}));  // 0.8, alone
  index_.Add(10, Bag({1, 2, 3, 4, 5, 6, 7, 8, 9, 32}));  // 0.9, and its neighbours
  index_.Add(11, Bag({1, 2, 3, 4, 5, 6, 7, 8, 33, 34}));
  index_.Add(12, Bag({1, 2, 3, 4, 5, 6, 7, 9, 33, 35}));
  EXPECT_THAT(Ids(index_.Query(query_)), ElementsAre(10, 1, 11, 12));
  query_.covisible = [](PlaceId id) {
    return id >= 10 ? std::vector<PlaceId>{10, 11, 12, 99} : std::vector<PlaceId>{};
  };
  const auto candidates = index_.Query(query_);
  ASSERT_THAT(Ids(candidates), ElementsAre(10)) << "alone is less than three quarters of the group";
  EXPECT_NEAR(candidates[0].score, 0.9, 1e-6);
  EXPECT_NEAR(candidates[0].group_score, 0.9 + 0.8 + 0.8, 1e-6);
}

TEST_F(PlaceIndexTest, DoesNotFindRemovedPlaces) {
  index_.Add(1, bag_);
  index_.Add(2, bag_);
  index_.Remove(1);
  index_.Remove(77);
  EXPECT_FALSE(index_.Contains(1));
  EXPECT_EQ(index_.Size(), 1u);
  EXPECT_THAT(Ids(index_.Query(query_)), ElementsAre(2));
  index_.Add(3, bag_);  // takes the free place
  EXPECT_THAT(Ids(index_.Query(query_)), ElementsAre(2, 3));
}

TEST_F(PlaceIndexTest, DropsWordsOfRemovedPlaces) {
  index_.Add(1, Bag({1, 2, 3}));
  index_.Add(2, Bag({3, 4}));
  index_.Remove(1);
  EXPECT_EQ(index_.NumWords(), 2U);
  index_.Add(2, Bag({5}));
  EXPECT_EQ(index_.NumWords(), 1U);
  index_.Remove(2);
  EXPECT_EQ(index_.NumWords(), 0U);
}

TEST_F(PlaceIndexTest, ReplacesPlaceWhenAddedAgain) {
  index_.Add(1, bag_);
  index_.Add(1, Bag({20, 21}));
  EXPECT_EQ(index_.Size(), 1u);
  EXPECT_THAT(index_.Query(query_), IsEmpty());
}

TEST_F(PlaceIndexTest, CopiesDoNotShareState) {
  index_.Add(1, bag_);
  PlaceIndex copy = index_;
  copy.Remove(1);
  copy.Add(2, bag_);
  EXPECT_THAT(Ids(index_.Query(query_)), ElementsAre(1));
  EXPECT_THAT(Ids(copy.Query(query_)), ElementsAre(2));
}

TEST_F(PlaceIndexTest, ResultDoesNotDependOnOrderOfAdding) {
  const auto bag_of = [](PlaceId id) {
    const auto w = static_cast<WordId>(id % 3);
    return Bag({1, 2, 3, 4, 5, 6, 7, 8 + w, 20 + w});
  };
  PlaceIndex reverse;
  for (PlaceId id = 0; id < 30; ++id) {
    index_.Add(id, bag_of(id));
    reverse.Add(29 - id, bag_of(29 - id));
  }
  query_.max_candidates = 100;
  query_.covisible = [](PlaceId id) { return std::vector<PlaceId>{id - 1, id + 1}; };
  EXPECT_EQ(index_.Query(query_), reverse.Query(query_));
  EXPECT_FALSE(index_.Query(query_).empty());
}

}  // namespace
}  // namespace sqslam::testing
