#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "slam/objects/landmark_estimation.h"

namespace sqslam {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

Landmark With(int observations, int estimated_at, double half_size = 0.0) {
  Landmark landmark;
  landmark.observations = observations;
  landmark.estimated_at = estimated_at;
  landmark.estimated = half_size > 0.0;
  landmark.superquadric.shape.half_size.setConstant(half_size);
  return landmark;
}

TEST(MostOutdated, PutsNeverEstimatedFirstThenTheLargestShareOfNewBoxes) {
  const std::map<int, Landmark> landmarks = {{1, With(110, 100)},  // hardly changed
                                             {2, With(150, 100)},
                                             {3, With(20, 10)},
                                             {4, With(3, 0)},
                                             {5, With(8, 0)}};
  EXPECT_THAT(MostOutdated(landmarks, 0), ElementsAre(5, 4, 3, 2));
  EXPECT_THAT(MostOutdated(landmarks, 2), ElementsAre(5, 4));
  EXPECT_THAT(MostOutdated({}, 3), IsEmpty());
}

TEST(MostOutdated, EstimatesEveryLandmarkEventually) {
  std::map<int, Landmark> landmarks;
  for (int id = 0; id < 12; ++id) {
    landmarks[id] = With(0, 0);
  }
  std::map<int, int> last;
  for (int round = 0; round < 200; ++round) {
    for (auto& [id, landmark] : landmarks) {
      landmark.observations += id < 6 ? 15 : 5;
    }
    for (const int id : MostOutdated(landmarks, 3)) {
      landmarks[id].estimated_at = landmarks[id].observations;
      last[id] = round;
    }
  }
  for (const auto& [id, round] : last) {
    EXPECT_GT(round, 150) << id;
  }
  EXPECT_EQ(last.size(), landmarks.size());
}

TEST(LargestFirst, OrdersByDiagonalAndPutsThoseWithoutEstimateLast) {
  std::map<int, Landmark> landmarks = {
      {1, With(9, 9, 0.1)}, {2, With(9, 0)}, {3, With(9, 9, 0.5)}, {4, With(9, 9, 0.2)}};
  landmarks.at(1).superquadric.shape.half_size = {0.8, 0.5, 0.001};  // the top of a table
  EXPECT_THAT(LargestFirst(landmarks, {1, 2, 3, 4}, {}, {}), ElementsAre(1, 3, 4, 2));
  EXPECT_THAT(LargestFirst(landmarks, {3, 4}, {}, {}), ElementsAre(3, 4));
}

TEST(LargestFirst, PutsTablesBeforeChairs) {
  std::map<int, Landmark> landmarks = {{1, With(9, 9, 0.9)}, {2, With(9, 9, 0.3)}, {3, With(9, 9, 0.4)}};
  landmarks.at(1).labels.Add("chair", 1.0);  // far too large so far
  landmarks.at(2).labels.Add("dining_table", 1.0);
  const ClassTable classes = ClassTable::Named("default");
  EXPECT_THAT(LargestFirst(landmarks, {1, 2, 3}, classes, MetricScale{0.0, 0.1}), ElementsAre(2, 3, 1));
  EXPECT_THAT(LargestFirst(landmarks, {1, 2, 3}, classes, {}), ElementsAre(1, 3, 2)) << "of no known scale";
}

}  // namespace
}  // namespace sqslam
