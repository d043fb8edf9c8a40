#include "slam/snapshot/object_account.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace sqslam {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

ClassAccount Boxes(int boxes) {
  ClassAccount account;
  account.boxes = account.used = boxes;
  return account;
}

TEST(MissingObjectLines, NameReasonAndRemedyOfClassWithoutObject) {
  ClassAccount cups = Boxes(40);
  cups.merged = 1;
  cups[LeftOut::kNoDepth] = 2;
  cups[LeftOut::kFewViews] = 1;
  EXPECT_THAT(MissingObjectLines({{"cup", cups}}),
              ElementsAre("no cup in the map: 40 boxes, 4 landmarks, 1 merged into others, 1 seen in too few "
                          "views, 2 without a depth: move past it sideways, or around it"));
}

TEST(MissingObjectLines, TellIgnoredBoxesFromThoseThatBeganNothing) {
  ClassAccount people = Boxes(12);
  people.ignored = 12;
  EXPECT_THAT(MissingObjectLines({{"chair", Boxes(30)}, {"person", people}}),
              ElementsAre(AllOf(HasSubstr("no chair"), HasSubstr("began no landmark")),
                          AllOf(HasSubstr("no person"), HasSubstr("12 ignored"))));
}

TEST(MissingObjectLines, StaySilentWhereMostClassesHaveObjects) {
  ClassAccount mapped = Boxes(50);
  mapped.shown = 1;
  EXPECT_THAT(MissingObjectLines({{"cup", mapped}, {"toilet", Boxes(30)}}), IsEmpty());
  EXPECT_THAT(MissingObjectLines({{"toilet", Boxes(9)}}), IsEmpty()) << "as few as detectors see anywhere";
  EXPECT_THAT(MissingObjectLines({}), IsEmpty());
}

TEST(MissingObjectLines, ListMovingThingsInAnyCase) {
  ClassAccount cars = Boxes(50);
  cars.shown = 3;
  cars[LeftOut::kMoving] = 2;
  EXPECT_THAT(MissingObjectLines({{"car", cars}}), ElementsAre("moving, so not in the map: 2 car"));
}

TEST(MissingObjectLines, EndAfterFiveClasses) {
  ObjectAccount account;
  for (int i = 0; i < 8; ++i) {
    account["class " + std::to_string(i)] = Boxes(20 + i);
  }
  const std::vector<std::string> lines = MissingObjectLines(account);
  ASSERT_THAT(lines, SizeIs(6));
  EXPECT_THAT(lines.front(), HasSubstr("class 7"));
  EXPECT_THAT(lines.back(), HasSubstr("3 more classes"));
}

TEST(ObjectAccount, AddsUpByClass) {
  ObjectAccount account = {{"cup", Boxes(2)}};
  ClassAccount cups = Boxes(3);
  cups.shown = 1;
  cups[LeftOut::kUnreliable] = 2;
  Add({{"cup", cups}, {"bowl", Boxes(1)}}, account);
  EXPECT_EQ(account.at("cup").boxes, 5);
  EXPECT_EQ(account.at("cup").Landmarks(), 3);
  EXPECT_EQ(account.at("bowl").boxes, 1);
  EXPECT_EQ(CountLeftOut(account, LeftOut::kUnreliable), 2);
}

}  // namespace
}  // namespace sqslam
