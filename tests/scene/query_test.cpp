#include "slam/scene/query.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "slam/util/error.h"
#include "slam/util/to_vector.h"
#include "tests/scene/made_room.h"

namespace sqslam {
namespace {

using ::testing::HasSubstr;
using ::testing::UnorderedElementsAreArray;

class Query : public ::testing::Test {
 protected:
  std::vector<int> Ask(const std::string& question) const {
    return ToVector(AnswerQuery(question, map_, graph_, classes_), [this](const QueryAnswer& answer) {
      return map_.objects[static_cast<std::size_t>(answer.object)].id;
    });
  }
  std::string ErrorOf(const std::string& question) const {
    try {
      Ask(question);
    } catch (const UsageError& e) {
      return e.what();
    }
    return "none";
  }

  MapSnapshot map_ = testing::MadeRoom();
  ClassTable classes_ = ClassTable::Named("default");
  SceneGraph graph_ = MakeSceneGraph(map_, classes_, {{{-3.0, 1.2}, {3.0, 1.2}}});
};

TEST_F(Query, AnswersFortySentences) {
  const std::vector<std::pair<std::string, std::vector<int>>> sentences = {
      {"cups", {2, 3}},
      {"cup", {2, 3}},
      {"show me all the mugs", {2, 3}},
      {"Which cups are on the table?", {2, 3}},
      {"cups on the dining table", {2, 3}},
      {"certain cups on the table", {2}},
      {"uncertain objects", {3}},
      {"oil", {4}},
      {"books", {5, 6, 13}},
      {"books on the table", {5}},
      {"books on a book", {6}},
      {"books in the bookshelf", {13}},
      {"books in the shelves", {13}},
      {"what is in the bowl", {8}},
      {"apples inside bowls", {8}},
      {"chairs under the table", {9}},
      {"chairs not under the table", {10}},
      {"the table above the chair", {1}},
      {"things under cup 2", {1}},
      {"objects on chair 10", {11}},
      {"pillows on seats", {11}},
      {"cups and bottles", {2, 3, 4}},
      {"cups, bottles and bowls on the table", {2, 3, 4, 7}},
      {"largest book", {13}},
      {"smallest book on the table", {5}},
      {"tallest object", {12}},
      {"2 largest objects", {1, 12}},
      {"lowest cup", {2}},
      {"highest book", {13}},
      {"cup nearest to the bottle", {2}},
      {"cup farthest from the bottle", {3}},
      {"objects next to cup 2", {4}},
      {"cup beside the oil", {2}},
      {"box next to the bookshelf", {14}},
      {"objects within 15 cm of bottle", {1, 2}},
      {"cups within 0.5 m of the bowl", {3}},
      {"objects leaning against the shelf", {16}},
      {"chairs right of the table seen from 0", {9, 10}},
      {"chairs left of the table seen from frame 90", {9, 10}},
      {"cups in front of the bowl seen from 0", {2, 3}},
      {"balls on the floor", {15}},
      {"objects next to the wall", {12, 14}},
      {"book on the table next to cup 2", {}},
      {"laptops", {}},
  };
  EXPECT_GE(sentences.size(), 40U);
  for (const auto& [question, ids] : sentences) {
    EXPECT_THAT(Ask(question), UnorderedElementsAreArray(ids)) << question;
  }
}

TEST_F(Query, TakesSurfacesForTableThatIsNoObject) {
  map_.objects.erase(map_.objects.begin());
  for (int i = 0; i < 2000; ++i) {
    map_.points.push_back({Eigen::Vector3f(-0.8F + 1.6F * static_cast<float>(i % 50) / 50.0F,
                                           -0.5F + 1.0F * static_cast<float>(i / 50) / 40.0F, 0.74F)});
  }
  graph_ = MakeSceneGraph(map_, classes_);
  EXPECT_THAT(Ask("cups on the table"), UnorderedElementsAreArray({2, 3}));
}

TEST_F(Query, NamesNearestWordForUnknownOne) {
  EXPECT_THAT(ErrorOf("bottel on the table"), HasSubstr("'bottel' is not known; did you mean 'bottle'?"));
  EXPECT_THAT(ErrorOf("cups onn the table"), HasSubstr("'onn' is not known"));
}

TEST_F(Query, RefusesIncompleteSentences) {
  EXPECT_THAT(ErrorOf(""), HasSubstr("expected a class of objects"));
  EXPECT_THAT(ErrorOf("cups on"), HasSubstr("expected a class of objects, such as 'cups' at the end"));
  EXPECT_THAT(ErrorOf("cups left of the bowl"), HasSubstr("expected 'seen from' and the number of a frame"));
  EXPECT_THAT(ErrorOf("cups within 3 of the bowl"), HasSubstr("expected a length"));
  EXPECT_THAT(ErrorOf("cups table"), HasSubstr("is not known"));
}

TEST_F(Query, AsksForScaleWhenLengthsAreInMetres) {
  map_.metric = false;
  EXPECT_THAT(ErrorOf("cups within 0.5 m of the bowl"), HasSubstr("the map has no scale"));
  EXPECT_THAT(Ask("cups within 0.5 units of the bowl"), UnorderedElementsAreArray({3}));
}

}  // namespace
}  // namespace sqslam
