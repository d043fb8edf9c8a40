#include "slam/objects/object_class.h"

#include <gtest/gtest.h>

#include <cmath>

#include "slam/objects/landmark_estimation.h"
#include "slam/objects/reliability.h"
#include "slam/util/data_path.h"
#include "slam/util/error.h"
#include "tests/io/temporary_folder.h"

namespace sqslam {
namespace {

ClassTable TableOf(const std::string& text) {
  const TemporaryFolder folder;
  return ClassTable::Named(folder.Write("classes.yaml", text));
}

TEST(ClassTable, KnowsBundledClasses) {
  const ClassTable classes = ClassTable::Named("default");
  const ObjectClass& bottle = classes.Of("bottle");
  EXPECT_GT(bottle.shapes[1], 0.9);
  EXPECT_GT(bottle.log_height_ratio, std::log(2.0));
  ASSERT_TRUE(bottle.log_metres);
  EXPECT_LT(*bottle.log_metres, *classes.Of("couch").log_metres);
  EXPECT_TRUE(classes.Of("chair").on_floor);
  EXPECT_FALSE(bottle.on_floor);
  EXPECT_FALSE(classes.Of("something nobody has named").log_metres);
  EXPECT_EQ(classes.Of("something nobody has named").width_sigma, ObjectClass().width_sigma);
}

TEST(ClassTable, AcceptsScreenWithItsFoot) {
  const ClassTable classes = ClassTable::Named("default");
  const double hung = 0.06;  // depths, metres
  const double on_foot = 0.23;
  for (const auto& [label, width] : {std::pair("tv", 0.95), std::pair("monitor", 0.55)}) {
    const ObjectClass& screen = classes.Of(label);
    for (const double depth : {hung, on_foot}) {
      const double error = std::log(width / depth) - screen.log_width_ratio;
      EXPECT_LT(std::abs(error), 1.5 * screen.width_sigma) << label << " " << depth;
    }
  }
}

TEST(BackOf, KeepsWidthAndHeightAtAFifthOfTheDepth) {
  const ObjectClass chair = TableOf("chair: {size: [0.5, 0.4, 0.9], back: true}\n").Of("chair");
  EXPECT_TRUE(chair.back);
  const ObjectClass back = BackOf(chair);
  EXPECT_NEAR(back.log_width_ratio, std::log(0.5 / 0.08), 1e-12);
  EXPECT_NEAR(back.log_height_ratio, std::log(0.9 / std::sqrt(0.5 * 0.08)), 1e-12);
  EXPECT_NEAR(*back.log_metres, std::log(0.5 * 0.08 * 0.9) / 3.0, 1e-12);
  EXPECT_GT(back.width_sigma, chair.width_sigma);
  EXPECT_FALSE(BackOf(ObjectClass()).log_metres);
}

TEST(ClassTable, ReportsLineOfUnreadableEntry) {
  const auto message = [](const std::string& text) -> std::string {
    try {
      TableOf(text);
    } catch (const std::exception& e) {
      return e.what();
    }
    return "";
  };
  EXPECT_NE(message("cup: {size: [0.1, 0.1, 0.1], sprad: 0.2}\n").find("spread"), std::string::npos);
  EXPECT_NE(message("mug: {size: [1, 1, 1]}\ncup: {spread: 0.2}\n").find(":2: cup has no size"),
            std::string::npos);
  EXPECT_NE(message("cup: [0.1, 0.1]\n").find(":1: '[0.1, 0.1]', expected lines"), std::string::npos);
  EXPECT_NE(message("- a list\n").find("expected labels"), std::string::npos);
  EXPECT_NE(message("cup: {size: [0.1,").find("classes.yaml"), std::string::npos);
}

TEST(MetricScale, FollowsTheOthersDespiteAWrongLabel) {
  std::vector<MetricScale> estimates = {{0.7, 0.3}, {0.8, 0.3}, {0.6, 0.3}, {0.7, 0.3}, {0.8, 0.3}};
  const auto scale = CombinedScale(estimates);
  ASSERT_TRUE(scale);
  EXPECT_NEAR(scale->log_scale, 0.72, 0.05);
  estimates.push_back({4.0, 0.3});  // a box taken for a phone
  EXPECT_NEAR(CombinedScale(estimates)->log_scale, scale->log_scale, 0.1);
}

TEST(MetricScale, NeedsThreeOtherObjects) {
  const ClassTable classes = ClassTable::Named("default");
  std::vector<Landmark> cups(4);
  std::vector<const Landmark*> pointers;
  for (Landmark& cup : cups) {
    cup.labels.Add("cup", 1.0);
    pointers.push_back(&cup);
  }
  EXPECT_TRUE(ScaleOfMap(pointers, classes, &cups[2]));
  pointers.pop_back();
  EXPECT_TRUE(ScaleOfMap(pointers, classes));
  EXPECT_FALSE(ScaleOfMap(pointers, classes, &cups[2]));
}

TEST(Reliability, FallsWithEveryReasonForDoubt) {
  const ReliabilityEvidence good{200, 0.95, 0.03, 1.0};
  EXPECT_GT(Reliability(good), 0.8);
  const auto with = [&](auto change) {
    ReliabilityEvidence evidence = good;
    change(evidence);
    return Reliability(evidence);
  };
  EXPECT_LT(with([](auto& e) { e.observations = 10; }), 0.55);
  EXPECT_LT(with([](auto& e) { e.held_out_agreement = 0.5; }), 0.4);
  EXPECT_LT(with([](auto& e) { e.log_size_sigma = 0.4; }), 0.4);
  EXPECT_LT(with([](auto& e) { e.class_surprise = 200.0; }), 0.55);
  EXPECT_EQ(with([](auto& e) { e.held_out_agreement = 0.2; }), 0.0);
}

TEST(ScaleFrom, DiscountsSizeThatCameFromTheClass) {
  const ClassTable classes = ClassTable::Named("default");
  const double size_sigma = classes.Of("cup").size_sigma;
  Landmark cup;
  cup.labels.Add("cup", 1.0);
  const Eigen::Vector3d half(0.2, 0.1, 0.3);
  cup.superquadric.shape.half_size = cup.visible.shape.half_size = half;
  const auto sigma = [&](double of_size) {
    cup.covariance.setZero();
    cup.covariance.block<3, 3>(3, 3) = of_size * of_size * half * half.transpose();
    return ScaleFrom(cup, classes)->sigma;
  };
  EXPECT_NEAR(sigma(0.02), size_sigma, 0.01) << "measured";
  EXPECT_NEAR(sigma(std::sqrt(0.5) * size_sigma), std::sqrt(2.0) * size_sigma, 1e-9) << "half of it measured";
  EXPECT_GT(sigma(size_sigma), 5.0 * size_sigma);
}

TEST(ClassSurprise, VanishesForATypicalObjectAtTheRightScale) {
  ObjectClass prior;
  prior.log_width_ratio = std::log(2.0);
  prior.log_height_ratio = 0.0;
  prior.width_sigma = prior.height_sigma = 0.3;
  prior.log_metres = std::log(0.2);
  prior.size_sigma = 0.2;
  const double root = std::sqrt(2.0);
  Superquadric typical{{0.05 / root, 0.05 * root, 0.05}, 0.1, 0.1};  // full sizes about 0.1 map units
  const MetricScale doubled{std::log(2.0), 0.0};
  EXPECT_NEAR(ClassSurprise(typical, prior, doubled), 0.0, 1e-9);
  EXPECT_NEAR(ClassSurprise(typical, prior, MetricScale{0.0, 0.0}), std::pow(std::log(2.0) / 0.2, 2), 1e-9);
  std::swap(typical.half_size.x(), typical.half_size.y());  // along which axis does not matter
  EXPECT_NEAR(ClassSurprise(typical, prior, std::nullopt), 0.0, 1e-9);
}

}  // namespace
}  // namespace sqslam
