#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "baseline.h"
#include "figure_reading.h"
#include "figure_samples.h"
#include "render/camera/scene_framing.h"
#include "render/figures/figure_input.h"
#include "render/page/chart.h"
#include "render/page/page.h"
#include "render/scene/color_scale.h"
#include "render/synthetic/scene_description.h"
#include "slam/util/data_path.h"
#include "slam/util/error.h"

namespace sqslam {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

// A chart is mostly empty: half a bar more changes little of its mean similarity.
constexpr double kFigureThreshold = 0.01;

TEST(FigureTest, DrawsShapesLikeBaseline) {
  FigureOptions options = SmallFigure();
  options.style.objects.opacity = 1.0;
  options.style.grid.show = false;
  ExpectBaseline(Pixels(DrawShapes(FewShapes(), options)), "figure_shapes", kFigureThreshold);
}

TEST(FigureTest, DrawsComparisonLikeBaseline) {
  FigureOptions options = SmallFigure();
  options.style.objects.opacity = 0.6;
  options.style.cameras.keyframes = options.style.cameras.trajectory = false;
  options.style.points.object_size = 12.0;
  ExpectBaseline(Pixels(DrawComparison(TwoCompared(), options)), "figure_compare", kFigureThreshold);
}

TEST(FigureTest, DrawsMapsLikeBaseline) {
  ExpectBaseline(Pixels(DrawMaps(TwoMaps(), SmallFigure())), "figure_maps", kFigureThreshold);
}

TEST(FigureTest, DrawsTrajectoriesLikeBaseline) {
  TrajectoryFigure figure = TwoPaths();
  figure.heights = true;
  ExpectBaseline(Pixels(DrawTrajectories(figure, SmallFigure())), "figure_trajectory", kFigureThreshold);
}

TEST(FigureTest, DrawsTimesLikeBaseline) {
  ExpectBaseline(Pixels(DrawTiming(TwoTimings(), SmallFigure())), "figure_timing", kFigureThreshold);
}

TEST(FigureTest, DrawsIouLikeBaseline) {
  FigureOptions options = SmallFigure();
  options.title = "Objects";
  options.style = LoadStyle(std::string(SQSLAM_SOURCE_DIR) + "/configs/styles/dark.yaml");
  ExpectBaseline(Pixels(DrawIou(TwoScored(), options)), "figure_iou", kFigureThreshold);
}

TEST(FigureTest, DrawsOutliersLikeBaseline) {
  FigureOptions options = SmallFigure();
  options.style.objects.opacity = 0.35;
  options.style.cameras.keyframes = options.style.cameras.trajectory = false;
  options.style.grid.show = false;
  options.style.light.shadow = 0.0;
  ExpectBaseline(Pixels(DrawOutliers(TwoJudged(), options)), "figure_outliers", kFigureThreshold);
}

TEST(FigureTest, DrawsYawLikeBaseline) {
  FigureOptions options = SmallFigure();
  options.pixels = {360, 210};
  ExpectBaseline(Pixels(DrawYaw(OneTurned(), options)), "figure_yaw", kFigureThreshold);
}

TEST(FigureTest, CountsOutliersByFate) {
  OutliersFigure figure = TwoJudged();
  const std::vector<std::string> texts =
      SvgTexts(EncodeFigure(DrawOutliers(figure, SmallFigure()), "figure.svg"));
  EXPECT_THAT(texts, AllOf(Contains("kept (48)"), Contains("isolated, removed (2)"),
                           Contains("removed without score (4)"), Contains("no image"),
                           Contains("anomaly score"), Contains("removed above 0.6")));
  EXPECT_THAT(texts, Contains("24 kept, 1 isolated, 2 without score"));
  EXPECT_THAT(texts, Contains(::testing::StartsWith("without score: taken away before")));
  figure.objects[0].points[24].p_map.z() += 40.0;
  EXPECT_THAT(SvgTexts(EncodeFigure(DrawOutliers(figure, SmallFigure()), "figure.svg")),
              Contains("24 kept, 1 isolated, 2 without score; 1 not in view"));
}

TEST(FigureTest, SharesOneColourScaleAmongObjects) {
  EXPECT_EQ(Viridis(-1.0), Viridis(0.0));
  EXPECT_EQ(Viridis(2.0), Viridis(1.0));
  const auto lightness = [](const Eigen::Vector3d& c) {
    return 0.2126 * c.x() + 0.7152 * c.y() + 0.0722 * c.z();
  };
  for (double value = 0.05; value <= 1.0; value += 0.05) {
    EXPECT_GT(lightness(Viridis(value)), lightness(Viridis(value - 0.05))) << value;
  }
  // The score of the cup's isolated point has the same colour as the book's.
  const FigurePage page = DrawOutliers(TwoJudged(), {});
  std::vector<Eigen::Vector3d> crosses;
  for (const FigureElement& element : page.elements) {
    const auto* path = std::get_if<FigurePath>(&element);
    if (path != nullptr && path->points.size() == 2 && path->stroke && lightness(path->stroke->color) > 0.5 &&
        path->stroke->width < 1.5 && path->stroke->color.x() < 0.999) {
      crosses.push_back(path->stroke->color);
    }
  }
  EXPECT_GE(std::count(crosses.begin(), crosses.end(), crosses.at(0)), 4) << "two strokes each";
}

TEST(FigureTest, WritesYawAnglesAndAxisLetters) {
  YawFigure figure = OneTurned();
  EXPECT_THAT(SvgTexts(EncodeFigure(DrawYaw(figure, {}), "figure.svg")),
              AllOf(Contains("mean angle 30.0°, 3 lines"), Contains("mean angle 0.2°, yaw 30.0°"),
                    Contains("x"), Contains("y"), Contains("z"), Contains("along x")));
  figure.objects[0].yaw_lines = 0;
  EXPECT_THAT(SvgTexts(EncodeFigure(DrawYaw(figure, {}), "figure.svg")), Contains("no line tells the yaw"));
}

TEST(FigureTest, KeepsMarksInPlaceWhenImageIsCutAndTurned) {
  cv::Mat image(60, 100, CV_8UC3, cv::Scalar(0, 0, 0));
  const Eigen::Vector2d mark(30.0, 20.0);
  image.at<cv::Vec3b>(20, 30) = {255, 255, 255};
  for (int turns = 0; turns < 4; ++turns) {
    const ImageCrop crop(image, {20.0, 10.0, 24.0, 20.0}, turns, {100.0, 200.0, 40.0, 30.0});
    EXPECT_TRUE((FigureRect{100.0, 200.0, 40.0, 30.0}.Contains(crop.Area())));
    FigurePage page;
    crop.Draw(page);
    const FigureImage& drawn = std::get<FigureImage>(page.elements.at(0));
    std::vector<cv::Point> bright;
    cv::Mat gray;
    cv::extractChannel(drawn.image, gray, 0);
    cv::findNonZero(gray, bright);
    ASSERT_EQ(bright.size(), 1u);
    const Eigen::Vector2d shown(drawn.area.x + (bright[0].x + 0.5) * drawn.area.width / drawn.image.cols,
                                drawn.area.y + (bright[0].y + 0.5) * drawn.area.height / drawn.image.rows);
    EXPECT_LT((crop.ToPage(mark) - shown).norm(), 1e-9) << turns << " turns";
  }
  const ImageCrop crop(image, {20.0, 10.0, 24.0, 20.0}, 0, {0.0, 0.0, 24.0, 20.0});
  FigurePage page;
  crop.DrawLine(page, {-100.0, 15.0}, {30.0, 15.0}, {});
  ASSERT_EQ(page.elements.size(), 1u);
  const std::vector<Eigen::Vector2d>& shown = std::get<FigurePath>(page.elements[0]).points;
  EXPECT_LT((shown.at(0) - Eigen::Vector2d(0.0, 5.5)).norm(), 1e-9);  // from the crop's edge
  EXPECT_LT((shown.at(1) - crop.ToPage({30.0, 15.0})).norm(), 1e-9);
  crop.DrawLine(page, {-100.0, 90.0}, {200.0, 90.0}, {});
  EXPECT_EQ(page.elements.size(), 1u);
}

TEST(FigureTest, BaselineDetectsChangedBar) {
  IouFigure changed = TwoScored();
  changed.series[0].values[0] = 0.6;
  EXPECT_GT(
      PictureDifference(Pixels(DrawIou(changed, SmallFigure())), Pixels(DrawIou(TwoScored(), SmallFigure()))),
      kFigureThreshold);
}

TEST(FigureTest, DrawsOpaqueBarsOnTransparentBackground) {
  FigureOptions options = SmallFigure();
  options.transparent = true;
  options.style.objects.opacity = 1.0;
  for (const FigurePage& page : {DrawIou(TwoScored(), options), DrawShapes(FewShapes(), options)}) {
    const cv::Mat image = Pixels(page);
    ASSERT_EQ(image.type(), CV_8UC4);
    EXPECT_EQ(image.at<cv::Vec4b>(0, 0)[3], 0);
    cv::Mat alpha;
    cv::extractChannel(image, alpha, 3);
    EXPECT_GT(cv::countNonZero(alpha == 255), 4000);
    EXPECT_GT(cv::countNonZero(alpha == 0), 20000);
  }
}

TEST(FigureTest, GivesClassOneColourInAllMapsAndLegend) {
  const FigurePage page = DrawMaps(TwoMaps(), SmallFigure());
  const std::vector<std::string> labels = {"book", "cup", "laptop", "sports_ball"};
  const LabelColors colors;
  int swatches = 0;
  for (const FigureElement& element : page.elements) {
    if (const auto* path = std::get_if<FigurePath>(&element); path != nullptr && path->fill) {
      for (const std::string& label : labels) {
        swatches += (*path->fill - colors(label)).norm() < 1e-9;
      }
    }
  }
  EXPECT_EQ(swatches, 4);
  EXPECT_THAT(SvgTexts(EncodeFigure(page, "figure.svg")), AllOf(Contains("laptop"), Contains("sports ball"),
                                                                Contains("(a) desk"), Contains("(b) table")));
}

TEST(FigureTest, LeavesPlaceForMissingImageOnlyBesideOtherImages) {
  MapsFigure figure = TwoMaps();
  figure.panels[1].image.release();
  const FigurePage one = DrawMaps(figure, {});
  EXPECT_THAT(SvgTexts(EncodeFigure(one, "figure.svg")), Contains("no image"));
  figure.panels[0].image.release();
  figure.panels[0].boxes.clear();
  const FigurePage none = DrawMaps(figure, {});
  EXPECT_THAT(SvgTexts(EncodeFigure(none, "figure.svg")), Not(Contains("no image")));
  EXPECT_LT(none.height, 0.7 * one.height);
}

TEST(FigureTest, UsesOneScaleForBothAxesOfPaths) {
  TrajectoryFigure figure;
  figure.paths = {{"square", {{{0.0, {0, 0, 0}}, {1.0, {3, 0, 0}}, {2.0, {3, 1, 0}}}}}};
  const FigurePage page = DrawTrajectories(figure, {});
  for (const FigureElement& element : page.elements) {
    const auto* path = std::get_if<FigurePath>(&element);
    if (path != nullptr && path->points.size() == 3 && !path->closed) {
      const double across = (path->points[1] - path->points[0]).norm();
      const double up = (path->points[2] - path->points[1]).norm();
      EXPECT_NEAR(across / up, 3.0, 1e-6);
      EXPECT_LT(path->points[2].y(), path->points[1].y()) << "y is up";
      return;
    }
  }
  FAIL() << "the path is not on the page";
}

TEST(PlanFigureTest, OutlinesMatchExactGeometry) {
  const auto outline = [](const Superquadric& shape, double yaw) {
    PosedSuperquadric solid{shape, {}};
    solid.T_map_object.rotation = Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ());
    solid.T_map_object.translation = {3.0, -2.0, 0.7};
    std::vector<Eigen::Vector3d> points =
        OutlineFromAbove(solid, Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitY());
    for (Eigen::Vector3d& p : points) {
      p = solid.T_map_object.rotation.conjugate() * (p - Eigen::Vector3d(3.0, -2.0, 0.0));
    }
    return points;
  };
  for (const double e2 : {0.1, 0.3, 1.0, 1.7}) {
    const Superquadric shape{{0.8, 0.3, 0.5}, 0.4, e2};
    double longest = 0.0, area = 0.0, exact = 0.0;
    const std::vector<Eigen::Vector3d> points = outline(shape, 0.6);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Eigen::Vector3d& p = points[i];
      const Eigen::Vector3d& next = points[(i + 1) % points.size()];
      EXPECT_NEAR(std::pow(std::abs(p.x() / 0.8), 2.0 / e2) + std::pow(std::abs(p.y() / 0.3), 2.0 / e2), 1.0,
                  1e-6);
      longest = std::max(longest, std::abs(p.x()));
      area += 0.5 * (p.x() * next.y() - p.y() * next.x());
    }
    EXPECT_NEAR(longest, 0.8, 1e-3);
    exact = 4.0 * 0.8 * 0.3 * std::pow(std::tgamma(1.0 + 0.5 * e2), 2) / std::tgamma(1.0 + e2);
    EXPECT_NEAR(area, exact, 1e-3 * exact) << "exponent " << e2;  // of a superellipse
  }
}

TEST(PlanFigureTest, ScaleBarAgreesWithFootprint) {
  const PlanFigure plan = MakePlan(HandMadeMap(), nullptr, {});
  ASSERT_EQ(plan.objects.size(), 3u);
  EXPECT_TRUE(plan.walls.empty());
  for (const double width_mm : {60.0, 89.0, 183.0}) {
    FigureOptions options;
    options.width_mm = width_mm;
    const FigurePage page = DrawPlan(plan, options);
    double ball = 0.0, bar = 0.0;
    for (const FigureElement& element : page.elements) {
      if (const auto* path = std::get_if<FigurePath>(&element)) {
        Eigen::AlignedBox2d box;
        for (const Eigen::Vector2d& p : path->points) {
          box.extend(p);
        }
        const double ratio = box.sizes().x() / std::max(box.sizes().y(), 1e-9);
        ball = path->closed && std::abs(ratio - 1.0) < 0.01 ? std::max(ball, box.sizes().x()) : ball;
        bar = !path->closed && path->points.size() == 2 && box.sizes().y() < 1e-9 ? box.sizes().x() : bar;
      } else if (const auto* text = std::get_if<FigureText>(&element)) {
        EXPECT_GE(text->size, 6.0) << text->text;
        EXPECT_GE(text->anchor.x() - 0.5 * TextWidth(text->text, text->size), -1.0) << text->text;
      }
    }
    EXPECT_NEAR(page.width, width_mm / 25.4 * 72.0, 1e-6);
    EXPECT_NEAR(bar / ball * 0.3, RoundLength(bar / ball * 0.3 * 1.001), 2e-3);  // the ball is 0.3 wide
  }
}

// Objects in a crowd, whose names do not fit beside them, get numbers with a key below the plan.
TEST(PlanFigureTest, NumbersObjectsWithoutRoomForTheirNames) {
  const auto texts_of = [](double distance) {
    PlanFigure plan;
    plan.path = {{0.0, 0.0}, {40.0, 20.0}};
    for (int i = 0; i < 25; ++i) {
      const double x = 20.0 + distance * (i % 5), y = 10.0 + distance * (i / 5);
      plan.objects.push_back({fmt::format("cereal box {}", static_cast<char>('a' + i)),
                              {0.2, 0.4, 0.6},
                              {{x, y, 0.0}, {x + 0.9, y, 0.0}, {x + 0.9, y + 0.9, 0.0}, {x, y + 0.9, 0.0}},
                              false});
    }
    return SvgTexts(EncodeFigure(DrawPlan(plan, {}), "plan.svg"));
  };
  const auto is_key = [](const std::string& text) { return text.starts_with("1 cereal box"); };
  EXPECT_EQ(std::ranges::count_if(texts_of(1.0), is_key), 1);
  EXPECT_EQ(std::ranges::count(texts_of(1.0), "2"), 1);
  EXPECT_EQ(std::ranges::count_if(texts_of(12.0), is_key), 0);
}

TEST(PlanFigureTest, FindsWallsOfRoomAndItsSize) {
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < 200; ++i) {  // 4 by 3 map units, 2.5 high, one side open, with a floor and a table
    for (int k = 0; k < 50; ++k) {
      const double noise = 0.01 * std::sin(7.0 * i + 3.0 * k), z = 0.05 * k;
      points.emplace_back(0.02 * i, 3.0 + noise, z);
      points.emplace_back(noise, 0.015 * i, z);
      points.emplace_back(4.0 + noise, 0.015 * i, z);
      points.emplace_back(0.02 * i, 0.06 * k, 0.0);
      points.emplace_back(1.0 + 0.005 * i, 1.0 + 0.02 * k, 0.8);
    }
  }
  const std::vector<WallLine> walls = FindWallLines(points);
  ASSERT_EQ(walls.size(), 3u);
  EXPECT_NEAR(walls[0].Length(), 4.0, 0.15);
  EXPECT_NEAR(walls[0].from.y(), 3.0, 0.04);
  EXPECT_NEAR(walls[1].Length(), 3.0, 0.15);
  EXPECT_NEAR(walls[2].Length(), 3.0, 0.15);
  FigureOptions options;
  PlanFigure plan{{}, {{1.0, 1.0}, {2.0, 1.0}}, {{{0, 3}, {4, 3}}, {{0, 0}, {0, 3}}, {{4, 0}, {4, 3}}}, true};
  const std::vector<std::string> texts = SvgTexts(EncodeFigure(DrawPlan(plan, options), "plan.svg"));
  EXPECT_THAT(texts, testing::IsSupersetOf({"4.00 m", "3.00 m", "1 m"}));
}

TEST(FigureTest, DashesUncertainObjectsFromAbove) {
  TrajectoryFigure figure;
  figure.objects = {{"cup", {1, 0, 0}, {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}}, false},
                    {"oven", {0, 0, 1}, {{2, 0, 0}, {3, 0, 0}, {3, 1, 0}}, true}};
  int filled = 0;
  int dashed = 0;
  for (const FigureElement& element : DrawTrajectories(figure, {}).elements) {
    const auto* path = std::get_if<FigurePath>(&element);
    if (path != nullptr && path->closed && path->points.size() == 3 && path->stroke) {
      filled += path->fill && path->stroke->dash.empty() ? 1 : 0;
      dashed += !path->fill && !path->stroke->dash.empty() ? 1 : 0;
    }
  }
  EXPECT_EQ(filled, 1);
  EXPECT_EQ(dashed, 1);
}

TEST(FigureTest, DrawsBarsUpToTheirValues) {
  const FigurePage page = DrawIou({{"cup"}, {{"run", {0.5}}}}, {});
  std::vector<double> heights;
  for (const FigureElement& element : page.elements) {
    const auto* path = std::get_if<FigurePath>(&element);
    if (path != nullptr && path->fill && path->points.size() == 4) {
      heights.push_back(path->points[2].y() - path->points[0].y());
    }
  }
  std::erase_if(heights, [](double height) { return height < 10.0; });  // of the legend
  ASSERT_EQ(heights.size(), 2u) << "the object's bar and the mean";
  EXPECT_NEAR(heights[0], 60.0, 1e-9) << "half of a plot of 120 points";
  EXPECT_NEAR(heights[1], 60.0, 1e-9);
}

TEST(FigureTest, WritesNumberOfObjectsBesideMeanIou) {
  IouFigure figure = TwoScored();
  figure.not_shown = 3;
  EXPECT_THAT(SvgTexts(EncodeFigure(DrawIou(figure, {}), "figure.svg")),
              AllOf(Contains("superquadrics: mean 0.35 of 6, 3 found: 0.71"),
                    Contains("quadrics: mean 0.23 of 6, 2 found: 0.69"), Contains("mean of 6"),
                    Contains("0.35"), Contains("0.23")));
  figure.series[1].values = {std::nullopt, std::nullopt, std::nullopt};
  EXPECT_THAT(SvgTexts(EncodeFigure(DrawIou(figure, {}), "figure.svg")),
              Contains("quadrics: mean 0.00 of 6, none found"));
}

TEST(FigureTest, KeepsUprightNumbersOutOfLegend) {
  IouFigure figure = TwoScored();
  while (figure.series.size() < 12) {
    figure.series.push_back({"more", {0.99, 0.98, 0.97}});
  }
  FigureOptions options;
  options.width_mm = 90.0;
  double legend = 0.0, numbers = 1e9;
  for (const FigureElement& element : DrawIou(figure, options).elements) {
    if (const auto* text = std::get_if<FigureText>(&element)) {
      legend = text->text.starts_with("more") ? std::max(legend, text->anchor.y()) : legend;
      numbers = text->text == "0.99" ? std::min(numbers, text->anchor.y() - TextWidth(text->text, text->size))
                                     : numbers;
    }
  }
  EXPECT_GT(numbers, legend);
}

TEST(FigureTest, WritesNamesIntoMapsWhenClassesOutnumberColours) {
  MapsFigure figure;
  figure.panels.push_back({"desk", HandMadeMap(), cv::Mat(120, 160, CV_8UC3, cv::Scalar(150, 160, 170)), {}});
  std::vector<SnapshotObject>& objects = figure.panels[0].map.objects;
  const auto times = [&](const std::string& name) {
    const auto texts = SvgTexts(EncodeFigure(DrawMaps(figure, {}), "figure.svg"));
    return std::count(texts.begin(), texts.end(), name);
  };
  for (int i = 0; i < 9; ++i) {
    objects.push_back(objects[2]);
    objects.back().label = "thing " + std::to_string(i);
    objects.back().superquadric.T_map_object.translation.x() -= 0.12 * i;
  }
  EXPECT_EQ(times("book"), 1) << "in the legend";
  figure.panels[0].boxes = {{"lamp", 1.0, {40.0, 50.0, 60.0, 40.0}}};  // a thirteenth class
  EXPECT_EQ(times("book"), 2) << "and over the object";
  EXPECT_EQ(times("lamp"), 2) << "and in the box";
}

TEST(FigureTest, NamesEveryObjectAndBoxInNarrowMaps) {
  MapsFigure figure;
  figure.labels = true;
  MapSnapshot map = HandMadeMap();
  map.objects.clear();
  cv::Mat image(480, 640, CV_8UC3, cv::Scalar(150, 160, 170));
  figure.panels.push_back({"desk", map, image, {{"microwave oven", 1.0, {600.0, 200.0, 30.0, 30.0}}}});
  for (const SceneBody& body : ReadScene(DataPath("assets/scenes/desk.yaml")).bodies) {
    if (body.id > 0) {
      SnapshotObject object;
      object.id = body.id;
      object.label = body.label;
      object.superquadric = body.superquadric;
      figure.panels[0].map.objects.push_back(object);
    }
  }
  for (const double width : {60.0, 89.0}) {
    FigureOptions options;
    options.width_mm = width;
    options.camera.elevation = 20.0;  // nothing is hidden
    const auto texts = SvgTexts(EncodeFigure(DrawMaps(figure, options), "figure.svg"));
    const auto times = [&](const std::string& name) { return std::ranges::count(texts, name); };
    for (const SnapshotObject& object : figure.panels[0].map.objects) {
      EXPECT_EQ(times(ReadableLabel(object.label)), 2) << object.label << " at " << width << " mm";
    }
    EXPECT_EQ(times("microwave oven"), 2) << "whole, although its box is narrow";
  }
}

TEST(FigureTest, DistinguishesManySeries) {
  for (std::size_t i = 0; i < 30; ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      const SeriesLook a = LookOfSeries(i), b = LookOfSeries(k);
      EXPECT_TRUE(a.color != b.color || (a.hatch != b.hatch && a.dash != b.dash)) << i << ", " << k;
    }
  }
}

TEST(FigureTest, KeepsNumbersOfTimesClearOfMarks) {
  TimingFigure figure;
  figure.stages = {"tracking"};
  figure.series = {{"run", {{"tracking", {5.0, 20.0, 20.0}}}}};  // the median at the end of the whisker
  double number = 0.0, farthest = 0.0;
  for (const FigureElement& element : DrawTiming(figure, {}).elements) {
    if (const auto* text = std::get_if<FigureText>(&element); text != nullptr && text->text == "5.00") {
      number = text->anchor.x();
    }
    if (const auto* path = std::get_if<FigurePath>(&element); path != nullptr && path->closed) {
      for (const Eigen::Vector2d& p : path->points) {
        farthest = p.y() > 20.0 ? std::max(farthest, p.x()) : farthest;  // below the legend
      }
    }
  }
  EXPECT_GT(number, farthest + 1.0);
  EXPECT_GT(farthest, 100.0);
}

TEST(FigureTest, NumbersAxesEvenlyWithoutTouching) {
  for (const double width : {40.0, 55.0, 89.0, 182.0}) {
    TrajectoryFigure figure = TwoPaths();
    figure.heights = true;
    FigureOptions options;
    options.width_mm = width;
    std::map<double, std::vector<std::pair<double, double>>>
        rows;  // centre and half width of numbers, by line
    for (const FigureElement& element : DrawTrajectories(figure, options).elements) {
      const auto* text = std::get_if<FigureText>(&element);
      if (text != nullptr && text->align == TextAlign::kCenter &&
          text->text.find_first_not_of("0123456789.\u2212") == std::string::npos) {
        rows[text->anchor.y()].emplace_back(text->anchor.x(), 0.5 * TextWidth(text->text, text->size));
      }
    }
    EXPECT_EQ(rows.size(), 2u) << width << " mm";
    for (const auto& [y, numbers] : rows) {
      ASSERT_GE(numbers.size(), 2u) << width << " mm";
      for (std::size_t i = 1; i < numbers.size(); ++i) {
        const double apart = numbers[i].first - numbers[i - 1].first;
        EXPECT_GT(apart - numbers[i].second - numbers[i - 1].second, 2.5) << width << " mm";
        EXPECT_NEAR(apart, numbers[1].first - numbers[0].first, 1e-6) << "none left out in between";
      }
    }
  }
}

TEST(FigureTest, GivesEveryAxisTwoTicks) {
  for (double low = -1.0; low < 1.0; low += 0.037) {
    for (double size = 0.01; size < 20.0; size *= 1.13) {
      const ChartAxis axis = RoundAxis(low, low + size, 2, false);
      EXPECT_GE(axis.Ticks().size(), 2u) << low << " to " << low + size;
    }
  }
}

TEST(FigureTest, NamesStagesReadably) {
  EXPECT_EQ(StageName("mapping.bundle_adjustment"), "bundle adjustment");
  EXPECT_EQ(StageName("mapping.keep"), "recovery state");
  EXPECT_EQ(StageName("mapping.view"), "map for tracking");
  EXPECT_EQ(StageName("tracking"), "tracking");
}

TEST(FigureTest, GivesAxesRoundNumbers) {
  const ChartAxis axis = RoundAxis(0.13, 0.87, 4, true);
  EXPECT_DOUBLE_EQ(axis.step, 0.2);
  EXPECT_NEAR(axis.low, 0.0, 1e-12);
  EXPECT_NEAR(axis.high, 1.0, 1e-12);
  EXPECT_EQ(axis.Ticks().size(), 6u);
  EXPECT_EQ(axis.TickText(-0.4), "\u22120.4");
  EXPECT_EQ(RoundAxis(-30.0, 270.0, 3, false).TickText(100.0), "100");
  EXPECT_GT(RoundAxis(2.0, 2.0, 4, true).high, 2.0) << "a single value still makes an axis";
  EXPECT_TRUE((ChartAxis{1e9, 1e9 + 1e-6, 1e-8}.Ticks().empty())) << "numbers closer than doubles are";
  EXPECT_EQ((ChartAxis{0.0, 1.0, 1e-9}.Ticks().size()), 1000u);
}

TEST(FigureTest, KeepsHatchesInsideBars) {
  const FigureRect bar{10.0, 20.0, 7.0, 30.0};
  for (int hatch = 1; hatch <= 4; ++hatch) {
    const auto lines = HatchLines(bar, hatch, 3.0);
    EXPECT_GE(lines.size(), 5u);
    for (const auto& [from, to] : lines) {
      for (const Eigen::Vector2d& end : {from, to}) {
        EXPECT_TRUE(bar.Contains({end.x(), end.y(), 0.0, 0.0})) << hatch << ": " << end.transpose();
      }
    }
  }
  EXPECT_TRUE(HatchLines(bar, 0, 3.0).empty());
}

TEST(FigureTest, CutsLongTextsBetweenLetters) {
  const std::string text = "Größenverhältnisse";
  EXPECT_EQ(FittingText(text, 8.0, 1000.0), text);
  const std::string cut = FittingText(text, 8.0, 30.0);
  EXPECT_LE(TextWidth(cut, 8.0), 30.0);
  EXPECT_TRUE(cut.ends_with("…"));
  EXPECT_TRUE(text.starts_with(cut.substr(0, cut.size() - std::strlen("…"))));
}

TEST(FigureTest, BreaksLongTextsAtBlanks) {
  const std::string text = "points that nobody can tell apart";
  EXPECT_THAT(WrappedText(text, 8.0, 1000.0), ::testing::ElementsAre(text));
  std::string joined;
  for (const std::string& line : WrappedText(text, 8.0, 60.0)) {
    EXPECT_LE(TextWidth(line, 8.0), 60.0);
    joined += (joined.empty() ? "" : " ") + line;
  }
  EXPECT_EQ(joined, text);
  EXPECT_EQ(WrappedText(text, 8.0, 1.0).size(), 6U);
}

TEST(FigureTest, ShrinksNamesBeforeCuttingThem) {
  FigureText name;
  name.text = "Superquadric";
  name.size = 8.0;
  const double width = TextWidth(name.text, name.size);
  EXPECT_EQ(NarrowText(name, width + 1.0).size, 8.0);
  const FigureText smaller = NarrowText(name, 0.8 * width);
  EXPECT_EQ(smaller.text, name.text);
  EXPECT_LE(TextWidth(smaller.text, smaller.size), 0.8 * width);
  EXPECT_TRUE(NarrowText(name, 0.3 * width).text.ends_with("…"));
}

}  // namespace
}  // namespace sqslam
