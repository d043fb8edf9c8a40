#include <gtest/gtest.h>

#include <functional>

#include "slam/dense/depth_fusion.h"
#include "tests/dense/panel_world.h"

namespace sqslam::testing {
namespace {

DepthMap TrueMap(const TexturedWorld& world, const Eigen::Vector3d& place) {
  DepthMap map;
  map.camera = world.GetCamera();
  map.T_map_camera = {Eigen::Quaterniond::Identity(), place};
  map.depth = TrueDepths(world, map.camera, map.T_map_camera);
  return map;
}

class Consistency : public ::testing::Test {
 protected:
  const TexturedWorld world_;
  const DepthMap map_ = TrueMap(world_, {0.0, 0.0, 0.0});
  const std::vector<DepthMap> neighbours_ = {
      TrueMap(world_, {0.2, 0.0, 0.0}), TrueMap(world_, {-0.2, 0.0, 0.0}), TrueMap(world_, {0.0, 0.1, 0.1})};
};

TEST_F(Consistency, KeepsTrueDepths) {
  const DepthMap kept = KeepConsistent(map_, neighbours_, {2});
  const double pixels = static_cast<double>(map_.depth.total());
  EXPECT_GT(cv::countNonZero(kept.depth > 0.0), 0.9 * pixels);
  cv::Mat difference;
  cv::absdiff(kept.depth, map_.depth, difference);
  EXPECT_GT(cv::countNonZero(difference < 0.002 * map_.depth), 0.9 * pixels);
  EXPECT_EQ(kept.views.at<std::uint8_t>(60, 160), 3);
}

TEST_F(Consistency, RemovesOutlierFromCopy) {
  DepthMap map = map_;
  map.depth = map_.depth.clone();
  const float truth = map.depth.at<float>(60, 160);
  map.depth.at<float>(60, 160) = 0.9F * truth;
  const DepthMap kept = KeepConsistent(map, neighbours_, {2});
  EXPECT_EQ(kept.depth.at<float>(60, 160), 0.0F);
  EXPECT_EQ(kept.views.at<std::uint8_t>(60, 160), 0);
  EXPECT_GT(kept.depth.at<float>(60, 161), 0.0F);
  EXPECT_EQ(map.depth.at<float>(60, 160), 0.9F * truth);
}

TEST_F(Consistency, RemovesPixelConfirmedByOneNeighbour) {
  std::vector<DepthMap> neighbours = neighbours_;
  for (const std::size_t wrong : {1U, 2U}) {
    neighbours[wrong].depth = neighbours[wrong].depth * 0.95;
  }
  EXPECT_EQ(cv::countNonZero(KeepConsistent(map_, neighbours, {2}).depth > 0.0), 0);
  const DepthMap kept = KeepConsistent(map_, neighbours, {1, 1.0});
  EXPECT_GT(cv::countNonZero(kept.views == 1), 0.8 * static_cast<double>(map_.depth.total()));
}

TEST_F(Consistency, RemovesPixelThatMoreNeighboursSeeThrough) {
  std::vector<DepthMap> neighbours = neighbours_;
  neighbours.push_back(TrueMap(world_, {-0.1, 0.0, 0.0}));
  neighbours.push_back(TrueMap(world_, {0.1, 0.0, 0.0}));
  const auto kept_against = [&](std::size_t against, double seen) {
    std::vector<DepthMap> others = neighbours;
    for (std::size_t i = 0; i < against; ++i) {
      others[i].depth = others[i].depth * seen;
    }
    return KeepConsistent(map_, others, {2}).depth.at<float>(60, 160) > 0.0F;
  };
  EXPECT_TRUE(kept_against(2, 1.1));
  EXPECT_FALSE(kept_against(3, 1.1));
  EXPECT_TRUE(kept_against(3, 0.9));   // something before it may hide it
  EXPECT_TRUE(kept_against(3, 1.02));  // not clearly behind it
}

TEST_F(Consistency, AveragesAgreeingDepths) {
  std::vector<DepthMap> neighbours = neighbours_;
  for (DepthMap& neighbour : neighbours) {
    neighbour.depth = neighbour.depth * 1.004;
  }
  const DepthMap kept = KeepConsistent(map_, neighbours, {2});
  EXPECT_NEAR(kept.depth.at<float>(60, 160) / map_.depth.at<float>(60, 160), 1.003, 2e-4);
}

TEST_F(Consistency, WeightsDepthsByInverseVariance) {
  DepthMap map = map_;
  map.sigma = cv::Mat(map.depth.size(), CV_32F, cv::Scalar(0.001));
  DepthMap neighbour = neighbours_[0];
  neighbour.depth = neighbour.depth * 1.005;
  neighbour.sigma = cv::Mat(map.depth.size(), CV_32F, cv::Scalar(0.002));
  const DepthMap kept = KeepConsistent(map, {neighbour}, {1});
  EXPECT_NEAR(kept.depth.at<float>(60, 160) / map_.depth.at<float>(60, 160), 1.001, 2e-4);
}

TEST_F(Consistency, PredictsLargerSigmaOfFewerAndDisagreeingDepths) {
  const auto sigma = [](const DepthMap& map) { return map.SigmaAt(160, 60); };
  std::vector<DepthMap> disagreeing = neighbours_;
  for (DepthMap& map : disagreeing) {
    map.sigma = cv::Mat(map.depth.size(), CV_32F, cv::Scalar(0.001));
  }
  const double agree = sigma(KeepConsistent(disagreeing[0], {disagreeing[1], disagreeing[2]}, {1}));
  EXPECT_GT(sigma(KeepConsistent(disagreeing[0], {disagreeing[1]}, {1})), 1.15 * agree);
  disagreeing[1].depth = disagreeing[1].depth * 1.01;
  EXPECT_GT(sigma(KeepConsistent(disagreeing[0], {disagreeing[1], disagreeing[2]}, {1})), 2.0 * agree);
}

TEST_F(Consistency, PredictsLargerSigmaOfAllDepthsOfDisagreeingMap) {
  std::vector<DepthMap> maps = neighbours_;
  for (DepthMap& map : maps) {
    map.sigma = cv::Mat(map.depth.size(), CV_32F, cv::Scalar(0.001));
  }
  const auto sigma = [&] { return KeepConsistent(maps[0], {maps[1], maps[2]}, {1, 1.0}).SigmaAt(160, 60); };
  const double agree = sigma();
  for (DepthMap& map : {std::ref(maps[1]), std::ref(maps[2])}) {
    const cv::Mat truth = map.depth.clone();
    map.depth = map.depth * 1.01;
    const cv::Rect around(80, 30, 160, 60);  // the pixel, and where the others see its point
    truth(around).copyTo(map.depth(around));
  }
  EXPECT_GT(sigma(), 2.0 * agree);
}

TEST_F(Consistency, RemovesPixelWithLargeSigma) {
  DepthMap map = map_;
  map.sigma = cv::Mat(map.depth.size(), CV_32F, cv::Scalar(0.001));
  std::vector<DepthMap> neighbours = neighbours_;
  for (DepthMap& neighbour : neighbours) {
    neighbour.sigma = map.sigma;
  }
  EXPECT_GT(cv::countNonZero(KeepConsistent(map, neighbours, {2, 0.002}).depth > 0.0), 0);
  EXPECT_EQ(cv::countNonZero(KeepConsistent(map, neighbours, {2, 0.0005}).depth > 0.0), 0);
}

}  // namespace
}  // namespace sqslam::testing
