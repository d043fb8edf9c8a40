#include "slam/objects/edge_noise.h"

#include <gtest/gtest.h>

#include <functional>
#include <random>

#include "slam/objects/landmark_geometry.h"
#include "synthetic_desk.h"

namespace sqslam::testing {
namespace {

// The objects of a desk with boxes whose edges are off by `error`, in usual standard deviations, given the
// object, the frame and the edge.
std::vector<FittedViews> WithErrors(const SyntheticDesk& desk,
                                    const std::function<double(std::size_t, int, int)>& error) {
  std::vector<FittedViews> fitted;
  for (const SyntheticDesk::Object& object : desk.Objects()) {
    FittedViews& one = fitted.emplace_back(FittedViews{object.superquadric, {}});
    for (int frame = 0; frame < SyntheticDesk::kFrames; ++frame) {
      const Box2d exact = *ProjectToBox(object.superquadric, desk.Pose(frame), desk.Camera());
      const auto off = [&](int edge) {
        const double size = edge % 2 == 0 ? exact.width : exact.height;
        return error(fitted.size(), frame, edge) * EdgeSigma(size, RefinementOptions());
      };
      const double left = exact.x + off(0);
      const double top = exact.y + off(1);
      const Box2d box{left, top, exact.x + exact.width + off(2) - left,
                      exact.y + exact.height + off(3) - top};
      one.views.push_back({frame, desk.Pose(frame), box, {true, true, true, true}});
    }
  }
  return fitted;
}

class EdgeInformationTest : public ::testing::Test {
 protected:
  double Information(const std::function<double(std::size_t, int, int)>& error) const {
    return EdgeInformation(WithErrors(desk_, error), desk_.Camera(), RefinementOptions());
  }

  SyntheticDesk desk_{1};
  std::mt19937 generator_{5};
  std::normal_distribution<double> normal_;
};

TEST_F(EdgeInformationTest, FallsWithTheVarianceOfTheErrors) {
  EXPECT_NEAR(Information([&](auto&&...) { return 2.0 * normal_(generator_); }), 0.25, 0.03);
}

TEST_F(EdgeInformationTest, StaysAtOneForExactBoxes) {
  EXPECT_EQ(Information([](auto&&...) { return 0.0; }), 1.0);
  EXPECT_EQ(Information([&](auto&&...) { return 0.3 * normal_(generator_); }), 1.0);
}

TEST_F(EdgeInformationTest, LeavesOutTheBiasOfASide) {
  const double without = Information([&](auto&&...) { return 1.5 * normal_(generator_); });
  const double with = Information([&](std::size_t object, int, int edge) {
    return 1.5 * normal_(generator_) + (edge == 0 ? 1.5 : 0.0) - 0.2 * static_cast<double>(object);
  });
  EXPECT_NEAR(with, without, 0.05);
}

TEST_F(EdgeInformationTest, FallsWhereErrorsRepeat) {
  // An autoregressive process with the correlation 0.6: (1 - 0.6) / (1 + 0.6).
  std::array<double, 4> last{};
  EXPECT_NEAR(Information([&](std::size_t, int, int edge) {
                double& error = last[static_cast<std::size_t>(edge)];
                return error = 0.6 * error + 0.8 * normal_(generator_);
              }),
              0.25, 0.1);
}

TEST_F(EdgeInformationTest, TakesTheUsualNoiseWhereNothingIsFitted) {
  EXPECT_EQ(EdgeInformation({}, desk_.Camera(), RefinementOptions()), 1.0);
}

}  // namespace
}  // namespace sqslam::testing
