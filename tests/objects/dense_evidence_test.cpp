#include "slam/objects/dense_evidence.h"

#include <gtest/gtest.h>

#include <random>

#include "dense_box_scene.h"

namespace sqslam {
namespace {

using testing::DenseBoxScene;

class DenseEvidence : public ::testing::Test {
 protected:
  DenseEvidence() {
    landmark_.id = 1;
    landmark_.labels.Add("box", 1.0);
    landmark_.observations = static_cast<int>(scene_.poses.size());
    for (std::size_t i = 0; i < scene_.poses.size(); ++i) {
      const auto frame = static_cast<std::int64_t>(i);
      landmark_.views.push_back({frame, scene_.poses[i], scene_.Box(i), {true, true, true, true}});
    }
    landmark_.estimated = landmark_.refined = true;
    landmark_.superquadric = landmark_.visible = scene_.Plate();
    landmark_.support = 0.0;
    context_.options = &options_;
    context_.camera = scene_.camera;
    context_.upright = true;
    context_.supports = &supports_;
    context_.classes = &classes_;
  }

  const DenseBoxScene scene_;
  const ObjectOptions options_;
  const SupportSurfaces supports_ = SupportSurfaces::Everywhere(0.0);
  const ClassPriors classes_;
  Landmark landmark_;
  EstimationContext context_;
};

TEST_F(DenseEvidence, LeavesOutWhatGoesOnBeyondTheBoxes) {
  const std::vector<SurfacePoint> surface = SurfaceOf(landmark_, scene_.Cloud(), context_);
  EXPECT_GT(surface.size(), scene_.faces.size() / 2);
  for (const SurfacePoint& point : surface) {
    EXPECT_GT(point.p_map.x(), -0.19) << "the wall";
    EXPECT_GT(point.p_map.z(), 0.0) << "the table";
  }
}

TEST_F(DenseEvidence, GivesTheDepthThatBoxesLeaveOpen) {
  std::map<int, Landmark> landmarks = {{1, landmark_}};
  EXPECT_EQ(EstimateWithCloud(landmarks, scene_.Cloud(), context_), std::vector<int>{1});
  const PosedSuperquadric& found = landmarks.at(1).superquadric;
  Eigen::Vector2d half = found.shape.half_size.head<2>();
  std::sort(half.begin(), half.end());  // either axis may be x
  EXPECT_NEAR(half.x(), 0.12, 0.01);
  EXPECT_NEAR(half.y(), 0.20, 0.01);
  EXPECT_NEAR(found.shape.half_size.z(), 0.16, 0.01);
  EXPECT_GT(landmarks.at(1).reliability, 0.0);
}

TEST_F(DenseEvidence, IsNotBelievedWhereItIsNoSurface) {
  std::mt19937 generator(1);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  std::vector<SurfacePoint> cloud;
  for (int i = 0; i < 2000; ++i) {
    cloud.push_back({{0.2 * unit(generator), 0.2 * unit(generator), 0.2 + 0.15 * unit(generator)},
                     Eigen::Vector3d(unit(generator), unit(generator), unit(generator)).normalized()});
  }
  EXPECT_FALSE(EstimateWithSurface(landmark_, cloud, context_));
  EXPECT_EQ(landmark_.superquadric.shape.half_size, scene_.Plate().shape.half_size);
}

TEST_F(DenseEvidence, ChangesNothingThatItAgreesWith) {
  landmark_.superquadric = landmark_.visible = scene_.truth;
  std::map<int, Landmark> landmarks = {{1, landmark_}};
  EXPECT_TRUE(EstimateWithCloud(landmarks, scene_.Cloud(), context_).empty());
}

}  // namespace
}  // namespace sqslam
