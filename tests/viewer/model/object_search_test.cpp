#include "app/viewer/model/object_search.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/render/hand_made_map.h"

namespace sqslam::viewer {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class ObjectSearchTest : public ::testing::Test {
 protected:
  std::vector<int> Find(const std::string& text) {
    search_.Update(text, rows_, map_, "");
    std::vector<int> ids;
    for (const ObjectRow& row : rows_) {
      if (search_.Shows(row)) {
        ids.push_back(row.object.id);
      }
    }
    return ids;
  }

  MapSnapshotPtr map_ = std::make_shared<MapSnapshot>(HandMadeMap());  // book, cup, sports ball
  std::vector<ObjectRow> rows_ = ObjectRows(*map_);
  ObjectSearch search_;
};

TEST_F(ObjectSearchTest, TakesWordsOfRowsLiterally) {
  EXPECT_THAT(Find("ball"), ElementsAre(2));
  EXPECT_FALSE(search_.Answers().has_value());
  EXPECT_EQ(search_.Message(), "");
  EXPECT_THAT(Find("e1 < 0.3"), ElementsAre(0, 1));
  EXPECT_FALSE(search_.Answers().has_value());
}

TEST_F(ObjectSearchTest, AnswersOtherTextsAsQuestions) {
  EXPECT_THAT(Find("mugs and balls"), ElementsAre(1, 2));
  EXPECT_THAT(*search_.Answers(), ElementsAre(1, 2));
  EXPECT_THAT(search_.Message(), "cup 1 and sports ball 2");
  EXPECT_THAT(Find("largest object"), ElementsAre(0));
  EXPECT_THAT(Find("balls on the book"), IsEmpty());
  EXPECT_TRUE(search_.Answers().has_value());
  EXPECT_EQ(search_.Message(), "no object of the map is an answer");
  EXPECT_FALSE(search_.Failed());
}

TEST_F(ObjectSearchTest, NamesNearestKnownWord) {
  EXPECT_THAT(Find("cupz"), IsEmpty());
  EXPECT_FALSE(search_.Answers().has_value());
  EXPECT_EQ(search_.Message(), "'cupz' is not known; did you mean 'cup'?");
  EXPECT_TRUE(search_.Failed());
  Find("cup");
  EXPECT_FALSE(search_.Failed());
}

TEST_F(ObjectSearchTest, LeavesProblemsOfComparisonsToTheFilter) {
  EXPECT_THAT(Find("size > 3"), IsEmpty());
  EXPECT_THAT(search_.Message(), HasSubstr("no column 'size'"));
  EXPECT_THAT(Find("seen > 1000000"), IsEmpty());
  EXPECT_EQ(search_.Message(), "");
}

}  // namespace
}  // namespace sqslam::viewer
