#include "slam/objects/yaw.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <random>

#include "slam/objects/box_lines.h"

namespace sqslam {
namespace {

constexpr double kDeg = std::numbers::pi / 180.0;
const Camera kCamera{640, 480, 525, 525, 320, 240, {}, 30};

// A camera 1.2 away that looks down on the origin.
Rigid3d LookAtOrigin(double azimuth, double elevation) {
  const Eigen::Vector3d centre =
      1.2 * Eigen::Vector3d(std::cos(azimuth) * std::cos(elevation), std::sin(azimuth) * std::cos(elevation),
                            std::sin(elevation));
  Eigen::Matrix3d R;
  R.col(2) = -centre.normalized();
  R.col(0) = R.col(2).cross(Eigen::Vector3d::UnitZ()).normalized();
  R.col(1) = R.col(2).cross(R.col(0));
  return {Eigen::Quaterniond(R), centre};
}

// The twelve edges of a box in the image, with noise on the ends.
std::vector<LineSegment> BoxEdges(const Rigid3d& T_map_camera, double yaw, double noise_px,
                                  std::mt19937& generator) {
  std::normal_distribution<double> noise(0.0, noise_px);
  const Eigen::Vector3d half(0.2, 0.12, 0.1);
  const Eigen::AngleAxisd R(yaw, Eigen::Vector3d::UnitZ());
  const auto pixel = [&](int corner) -> Eigen::Vector2d {
    const Eigen::Vector3d sign((corner & 1) * 2 - 1, (corner & 2) - 1, (corner & 4) / 2 - 1);
    const double dx = noise(generator);
    const double dy = noise(generator);
    return kCamera.Project(T_map_camera.Inverse() * (R * sign.cwiseProduct(half))) + Eigen::Vector2d(dx, dy);
  };
  std::vector<LineSegment> lines;
  for (int corner = 0; corner < 8; ++corner) {
    for (const int bit : {1, 2, 4}) {
      if (!(corner & bit)) {
        lines.push_back({pixel(corner), pixel(corner | bit)});
      }
    }
  }
  return lines;
}

double QuarterError(double a, double b) { return std::abs(WrapQuarter(a - b)); }

TEST(NearestAxis, PicksAxisOfTheEdge) {
  std::mt19937 generator(1);
  const double yaw = 25.0 * kDeg;
  const Rigid3d T = LookAtOrigin(-1.3, 0.6);
  const std::vector<LineSegment> edges = BoxEdges(T, yaw, 0.0, generator);
  const Eigen::Matrix3d R = Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  std::array<int, 3> count{};
  for (const LineSegment& edge : edges) {
    const AxisOfLine nearest = NearestAxis(edge, T, kCamera, R);
    EXPECT_LT(nearest.angle, 1e-6) << "an edge and its axis meet in the vanishing point";
    ++count[static_cast<std::size_t>(nearest.axis)];
  }
  EXPECT_EQ(count, (std::array<int, 3>{4, 4, 4}));
  EXPECT_EQ(NearestAxis(edges[0], T, kCamera, R).axis, 0) << "BoxEdges() begins with one along x";
  // Seen from straight above, turning the axes turns their images.
  const Rigid3d above{Eigen::Quaterniond(Eigen::AngleAxisd(std::numbers::pi, Eigen::Vector3d::UnitX())),
                      {0.0, 0.0, 2.0}};
  const LineSegment level{{100.0, 240.0}, {500.0, 240.0}};
  EXPECT_NEAR(AngleToDirection(level, above, kCamera, R.col(0)), yaw, 1e-9);
  EXPECT_NEAR(AngleToDirection(level, above, kCamera, R.col(1)), 90.0 * kDeg - yaw, 1e-9);
}

TEST(YawFromLines, FindsTheYawOfABoxFromItsEdges) {
  std::mt19937 generator(1);
  for (const double yaw_deg : {-44.0, -30.0, -7.0, 0.0, 12.5, 33.0, 44.5}) {
    const Rigid3d T = LookAtOrigin(-1.3, 0.6);
    const LineView view{T, BoxEdges(T, yaw_deg * kDeg, 0.5, generator)};
    const auto estimate = YawFromLines({&view, 1}, kCamera, YawOptions());
    ASSERT_TRUE(estimate) << yaw_deg;
    EXPECT_LT(QuarterError(estimate->yaw, yaw_deg * kDeg), 1.0 * kDeg) << yaw_deg;
    EXPECT_GE(estimate->yaw, -std::numbers::pi / 4.0);
    EXPECT_LT(estimate->yaw, std::numbers::pi / 4.0);
  }
}

TEST(YawFromLines, OutvotesClutterByManyViews) {
  std::mt19937 generator(2);
  std::uniform_real_distribution<double> uniform(150.0, 450.0);
  std::vector<LineView> views;
  for (int i = 0; i < 8; ++i) {
    const Rigid3d T = LookAtOrigin(-2.0 + 0.2 * i, 0.6);
    views.push_back({T, BoxEdges(T, 0.3, 1.0, generator)});
    for (int j = 0; j < 8; ++j) {
      views.back().lines.push_back({{uniform(generator), uniform(generator)}, {uniform(generator), 300.0}});
    }
  }
  const auto estimate = YawFromLines(views, kCamera, YawOptions());
  ASSERT_TRUE(estimate);
  EXPECT_LT(QuarterError(estimate->yaw, 0.3), 1.0 * kDeg);
}

TEST(YawFromLines, ReturnsNothingWithoutLines) {
  const LineView view{LookAtOrigin(0.0, 0.5), {}};
  EXPECT_FALSE(YawFromLines({&view, 1}, kCamera, YawOptions()));
}

// Every fourth line is one of the box, the others of a pattern on it at another angle but shorter, or of
// anything.
TEST(YawModesFromLines, WeighsLongEdgesMoreThanShortLines) {
  std::mt19937 generator(4);
  std::uniform_real_distribution<double> uniform(150.0, 450.0);
  std::vector<LineView> views;
  for (int i = 0; i < 20; ++i) {
    const Rigid3d T = LookAtOrigin(-2.0 + 0.05 * i, 0.6);
    views.push_back({T, BoxEdges(T, 0.3, 1.0, generator)});
    for (const LineSegment& line : BoxEdges(T, 0.75, 0.3, generator)) {
      for (const double part : {0.0, 0.4, 0.8}) {
        views.back().lines.push_back(
            {line.a + part * (line.b - line.a), line.a + (part + 0.15) * (line.b - line.a)});
      }
    }
    for (int j = 0; j < 8; ++j) {
      const Eigen::Vector2d a(uniform(generator), uniform(generator));
      views.back().lines.push_back({a, a + Eigen::Vector2d(0.05 * uniform(generator), 12.0)});
    }
  }
  const std::vector<YawMode> modes = YawModesFromLines(views, kCamera, YawOptions());
  ASSERT_FALSE(modes.empty());
  EXPECT_LT(QuarterError(modes[0].yaw, 0.3), 1.5 * kDeg);
  EXPECT_GT(modes[0].share, 0.5);
}

// Two ways a thing may stand, and edges of both: neither is thrown away.
TEST(YawModesFromLines, OffersBothAnglesWhenInDoubt) {
  std::mt19937 generator(5);
  const Rigid3d T = LookAtOrigin(-1.3, 0.6);
  LineView view{T, BoxEdges(T, 0.2, 0.5, generator)};
  const std::vector<LineSegment> others = BoxEdges(T, -0.4, 0.5, generator);
  view.lines.insert(view.lines.end(), others.begin(), others.end());
  const std::vector<YawMode> modes = YawModesFromLines({&view, 1}, kCamera, YawOptions());
  ASSERT_GE(modes.size(), 2U);
  double sum = 0.0;
  for (const YawMode& mode : modes) {
    sum += mode.share;
  }
  EXPECT_LE(sum, 1.0 + 1e-9);
  EXPECT_LT(std::min(QuarterError(modes[0].yaw, 0.2), QuarterError(modes[0].yaw, -0.4)), 1.0 * kDeg);
  EXPECT_GT(QuarterError(modes[0].yaw, modes[1].yaw), 0.4);
}

// Five stripes of a pattern against four edges: a few nats, at any resolution.
TEST(YawModesFromLines, DoesNotDependOnTheResolution) {
  std::mt19937 generator(7);
  const auto modes = [&](double scale) {
    const Camera camera{static_cast<int>(scale * 640),
                        static_cast<int>(scale * 480),
                        scale * 525,
                        scale * 525,
                        scale * 320,
                        scale * 240,
                        {},
                        30};
    const Rigid3d T = LookAtOrigin(-1.3, 0.6);
    LineView view{T, {}};
    const auto add = [&](double yaw, int count) {
      const Eigen::Vector2d along(0.2 * std::cos(yaw), 0.2 * std::sin(yaw));
      const Eigen::Vector2d across(-0.2 * along.y(), 0.2 * along.x());
      for (int i = 0; i < count; ++i) {
        const auto pixel = [&](double side) -> Eigen::Vector2d {
          const Eigen::Vector2d p = side * along + (i - 2) * across;
          return camera.Project(T.Inverse() * Eigen::Vector3d(p.x(), p.y(), 0.0));
        };
        view.lines.push_back({pixel(-1.0), pixel(1.0)});
      }
    };
    add(0.2, 4);
    add(-0.4, 5);
    return YawModesFromLines({&view, 1}, camera, YawOptions());
  };
  const std::vector<YawMode> coarse = modes(1.0);
  const std::vector<YawMode> fine = modes(2.0);
  ASSERT_EQ(coarse.size(), 2U);
  ASSERT_EQ(fine.size(), 2U);
  EXPECT_LT(QuarterError(coarse[1].yaw, 0.2), 1.0 * kDeg);
  EXPECT_NEAR(std::log(fine[0].share / fine[1].share), std::log(coarse[0].share / coarse[1].share), 1.0);
}

// The standard deviation is that of what comes out, within its floor, from one view to many; and a view seen
// often is no more than options.independent_views.
TEST(YawModesFromLines, EstimatesItsPrecision) {
  std::mt19937 generator(6);
  const auto estimate = [&](int count) {
    std::vector<LineView> views;
    for (int i = 0; i < count; ++i) {
      const Rigid3d T = LookAtOrigin(-1.3 + 0.02 * i, 0.6);
      views.push_back({T, BoxEdges(T, 0.1, 3.0, generator)});
    }
    const std::vector<YawMode> modes = YawModesFromLines(views, kCamera, YawOptions());
    return modes.empty() ? YawMode{0.0, 10.0, 0.0} : modes.front();
  };
  int within = 0;
  constexpr int kTries = 100;
  for (int i = 0; i < kTries; ++i) {
    const YawMode mode = estimate(1);
    within += QuarterError(mode.yaw, 0.1) < 2.0 * mode.sigma ? 1 : 0;
  }
  EXPECT_GE(within, 90);
  EXPECT_NEAR(estimate(40).sigma, estimate(4).sigma, 0.3 * kDeg);
  EXPECT_GE(estimate(40).sigma, 1.0 * kDeg);
  const LineView none{LookAtOrigin(0.0, 0.5), {}};
  EXPECT_TRUE(YawModesFromLines({&none, 1}, kCamera, YawOptions()).empty());
}

TEST(YawFromPoints, FollowsTheLongAxisAndRefusesARoundCloud) {
  std::mt19937 generator(3);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  std::vector<Eigen::Vector3d> bar;
  std::vector<Eigen::Vector3d> round;
  const Eigen::AngleAxisd R(0.4, Eigen::Vector3d::UnitZ());
  for (int i = 0; i < 4000; ++i) {
    const double x = uniform(generator);
    const double y = uniform(generator);
    bar.push_back(R * Eigen::Vector3d(0.3 * x, 0.1 * y, uniform(generator)));
    round.push_back({x, y, 0.0});
  }
  const auto estimate = YawFromPoints(bar, YawOptions());
  ASSERT_TRUE(estimate);
  EXPECT_LT(QuarterError(estimate->yaw, 0.4), 1.0 * kDeg);
  EXPECT_FALSE(YawFromPoints(round, YawOptions()));
}

TEST(YawMean, AveragesAcrossTheWrap) {
  YawMean mean;
  mean.Add({44.0 * kDeg, 1.0});
  mean.Add({-44.0 * kDeg, 1.0});
  EXPECT_LT(QuarterError(mean.Mean(), 45.0 * kDeg), 1e-9);
  mean.Add({40.0 * kDeg, 2.0});
  EXPECT_LT(QuarterError(mean.Mean(), 42.5 * kDeg), 0.1 * kDeg);
  mean.Rotate(10.0 * kDeg);
  EXPECT_LT(QuarterError(mean.Mean(), 52.5 * kDeg), 0.1 * kDeg);
  EXPECT_GT(mean.Concentration(), 0.9);
}

TEST(ExtractLines, FindsTheSidesOfADrawnRectangle) {
  cv::Mat image(480, 640, CV_8UC1, cv::Scalar(40));
  cv::rectangle(image, {200, 150}, {420, 300}, cv::Scalar(200), cv::FILLED);
  const std::vector<LineSegment> lines = ExtractLines(image, kCamera, {{0, 0, 640, 480}}, YawOptions());
  const std::vector<LineSegment> inside = LinesInBox(lines, {200, 150, 220, 150}, YawOptions());
  double total = 0.0;
  for (const LineSegment& line : inside) {
    total += line.Length();
  }
  EXPECT_GE(inside.size(), 4u);
  EXPECT_NEAR(total, 2 * (220 + 150), 80);
  EXPECT_TRUE(LinesInBox(lines, {10, 10, 50, 50}, YawOptions()).empty());
  EXPECT_TRUE(ExtractLines(cv::Mat(), kCamera, {{0, 0, 640, 480}}, YawOptions()).empty());
}

TEST(ExtractLines, SearchesOnlyBoxesAndDetectsLinesThatLeaveThem) {
  cv::Mat image(480, 640, CV_8UC1, cv::Scalar(40));
  cv::rectangle(image, {200, 150}, {420, 300}, cv::Scalar(200), cv::FILLED);
  const YawOptions options;
  const Box2d around{180, 130, 260, 190};
  const std::vector<LineSegment> lines = ExtractLines(image, kCamera, {around, {40, 30, 60, 60}}, options);
  EXPECT_GE(LinesInBox(lines, {200, 150, 220, 150}, options).size(), 4u);
  // Only the corner: its two sides go on beyond the box and its margin.
  const Box2d corner{190, 140, 60, 60};
  EXPECT_TRUE(LinesInBox(ExtractLines(image, kCamera, {corner}, options), corner, options).empty());
  EXPECT_TRUE(ExtractLines(image, kCamera, {{460, 330, 100, 100}}, options).empty());
  EXPECT_TRUE(ExtractLines(image, kCamera, {{-300, 20, 50, 50}}, options).empty());
}

}  // namespace
}  // namespace sqslam
