#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zlib.h>

#include <boost/property_tree/ptree.hpp>
#include <boost/property_tree/xml_parser.hpp>
#include <cmath>
#include <cstring>
#include <sstream>

#include "baseline.h"
#include "figure_samples.h"
#include "render/figure/chart.h"
#include "render/figure/color_ramp.h"
#include "render/figure/image_crop.h"
#include "render/figure/panels.h"
#include "render/figure/write_figure.h"
#include "slam/util/error.h"

namespace sqslam {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

// A chart is mostly empty: half a bar more changes little of its mean similarity.
constexpr double kFigureThreshold = 0.01;

cv::Mat Pixels(const FigurePage& page) {
  const std::string png = EncodeFigure(page, "figure.png");
  return cv::imdecode(cv::Mat(1, static_cast<int>(png.size()), CV_8UC1, const_cast<char*>(png.data())),
                      cv::IMREAD_UNCHANGED);
}

void CollectTexts(const boost::property_tree::ptree& node, std::vector<std::string>& texts) {
  for (const auto& [name, child] : node) {
    if (name == "text") {
      texts.push_back(child.data());
    }
    CollectTexts(child, texts);
  }
}

// Texts of an SVG; throws where it is no XML.
std::vector<std::string> SvgTexts(const std::string& svg) {
  std::istringstream stream(svg);
  boost::property_tree::ptree tree;
  boost::property_tree::read_xml(stream, tree);
  std::vector<std::string> texts;
  CollectTexts(tree, texts);
  return texts;
}

// Everything that stands compressed between "stream" and "endstream", unpacked.
std::string PdfStreams(const std::string& pdf) {
  std::string all;
  const std::string_view begin = "stream\n";
  for (std::size_t at = pdf.find(begin); at != std::string::npos; at = pdf.find(begin, at + 1)) {
    const std::size_t from = at + begin.size();
    std::string unpacked(8u << 20u, '\0');
    uLongf size = unpacked.size();
    if (uncompress(reinterpret_cast<Bytef*>(unpacked.data()), &size,
                   reinterpret_cast<const Bytef*>(pdf.data() + from), pdf.size() - from) == Z_OK) {
      all.append(unpacked, 0, size);
    }
  }
  return all;
}

// Letters that a PDF shows from fonts with one byte a letter, in drawing order.
std::string PdfLetters(const std::string& streams) {
  std::string letters;
  bool inside = false;
  for (std::size_t i = 0; i < streams.size(); ++i) {
    if (inside && streams[i] == '\\') {
      letters += streams[++i];
    } else if (streams[i] == '(' || streams[i] == ')') {
      inside = streams[i] == '(';
    } else if (inside) {
      letters += streams[i];
    }
  }
  return letters;
}

std::uint32_t BigEndian(const std::string& bytes, std::size_t at) {
  std::uint32_t value = 0;
  for (std::size_t i = at; i < at + 4; ++i) {
    value = (value << 8u) | static_cast<unsigned char>(bytes[i]);
  }
  return value;
}

TEST(FigureTest, ShapesLookLikeTheirBaseline) {
  FigureOptions options = SmallFigure();
  options.style.objects.opacity = 1.0;
  options.style.grid.show = false;
  ExpectBaseline(Pixels(DrawShapes(FewShapes(), options)), "figure_shapes", kFigureThreshold);
}

TEST(FigureTest, ComparisonLooksLikeItsBaseline) {
  FigureOptions options = SmallFigure();
  options.style.objects.opacity = 0.6;
  options.style.cameras.keyframes = options.style.cameras.trajectory = false;
  options.style.points.object_size = 12.0;
  ExpectBaseline(Pixels(DrawComparison(TwoCompared(), options)), "figure_compare", kFigureThreshold);
}

TEST(FigureTest, MapsLookLikeTheirBaseline) {
  ExpectBaseline(Pixels(DrawMaps(TwoMaps(), SmallFigure())), "figure_maps", kFigureThreshold);
}

TEST(FigureTest, TrajectoriesLookLikeTheirBaseline) {
  TrajectoryFigure figure = TwoPaths();
  figure.heights = true;
  ExpectBaseline(Pixels(DrawTrajectories(figure, SmallFigure())), "figure_trajectory", kFigureThreshold);
}

TEST(FigureTest, TimesLookLikeTheirBaseline) {
  ExpectBaseline(Pixels(DrawTiming(TwoTimings(), SmallFigure())), "figure_timing", kFigureThreshold);
}

TEST(FigureTest, IouLooksLikeItsBaseline) {
  FigureOptions options = SmallFigure();
  options.title = "Objects";
  options.style = LoadStyle(std::string(SQSLAM_SOURCE_DIR) + "/configs/styles/dark.yaml");
  ExpectBaseline(Pixels(DrawIou(TwoScored(), options)), "figure_iou", kFigureThreshold);
}

TEST(FigureTest, OutliersLookLikeTheirBaseline) {
  FigureOptions options = SmallFigure();
  options.style.objects.opacity = 0.35;
  options.style.cameras.keyframes = options.style.cameras.trajectory = false;
  options.style.grid.show = false;
  options.style.light.shadow = 0.0;
  ExpectBaseline(Pixels(DrawOutliers(TwoJudged(), options)), "figure_outliers", kFigureThreshold);
}

TEST(FigureTest, YawLooksLikeItsBaseline) {
  FigureOptions options = SmallFigure();
  options.height_px = 210;
  ExpectBaseline(Pixels(DrawYaw(OneTurned(), options)), "figure_yaw", kFigureThreshold);
}

TEST(FigureTest, OutliersAreCountedByTheirFate) {
  OutliersFigure figure = TwoJudged();
  const std::vector<std::string> texts =
      SvgTexts(EncodeFigure(DrawOutliers(figure, SmallFigure()), "figure.svg"));
  EXPECT_THAT(texts, AllOf(Contains("kept (48)"), Contains("isolated, removed (2)"),
                           Contains("removed without score (4)"), Contains("no image"),
                           Contains("anomaly score"), Contains("removed above 0.6")));
  EXPECT_THAT(texts, Contains("24 kept, 1 isolated, 2 without score"));
  figure.objects[0].points[24].p_map.z() += 40.0;
  EXPECT_THAT(SvgTexts(EncodeFigure(DrawOutliers(figure, SmallFigure()), "figure.svg")),
              Contains("24 kept, 1 isolated, 2 without score; 1 not in view"));
}

TEST(FigureTest, TheScoresOfAllObjectsShareOneRamp) {
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

TEST(FigureTest, YawIsToldInNumbersAndAxesHaveLetters) {
  YawFigure figure = OneTurned();
  EXPECT_THAT(SvgTexts(EncodeFigure(DrawYaw(figure, {}), "figure.svg")),
              AllOf(Contains("mean angle 30.0°, 3 lines"), Contains("mean angle 0.2°, yaw 30.0°"),
                    Contains("x"), Contains("y"), Contains("z"), Contains("along x")));
  figure.objects[0].yaw_lines = 0;
  EXPECT_THAT(SvgTexts(EncodeFigure(DrawYaw(figure, {}), "figure.svg")), Contains("no line tells the yaw"));
}

TEST(FigureTest, WhatLiesOnAnImageStaysThereWhenItIsCutAndTurned) {
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
  Eigen::Vector2d from(-100.0, 15.0);
  Eigen::Vector2d to(30.0, 15.0);
  ASSERT_TRUE(crop.Clip(from, to));
  EXPECT_TRUE(crop.Contains(from));
  EXPECT_NEAR(from.x(), 19.5, 1.0);
  EXPECT_EQ(to.x(), 30.0);
  from = {-100.0, 90.0};
  EXPECT_FALSE(crop.Clip(from, to = {200.0, 90.0}));
}

TEST(FigureTest, BaselineTellsAChangedBarFromTheSame) {
  IouFigure changed = TwoScored();
  changed.series[0].values[0] = 0.6;
  EXPECT_GT(
      OneMinusSsim(Pixels(DrawIou(changed, SmallFigure())), Pixels(DrawIou(TwoScored(), SmallFigure()))),
      kFigureThreshold);
}

TEST(FigureTest, SizesAreThoseAskedFor) {
  FigureOptions options = SmallFigure();
  EXPECT_EQ(Pixels(DrawIou(TwoScored(), options)).size(), cv::Size(360, 270));
  options = {};
  options.width_mm = 101.6;
  options.height_mm = 50.8;
  options.dpi = 150.0;
  EXPECT_EQ(Pixels(DrawIou(TwoScored(), options)).size(), cv::Size(600, 300));
  options.dpi.reset();
  EXPECT_EQ(Pixels(DrawIou(TwoScored(), options)).size(), cv::Size(1200, 600)) << "300 dpi unless told";
}

TEST(FigureTest, PngCarriesItsDensity) {
  FigureOptions options;
  options.dpi = 254.0;  // 10000 pixels a metre
  const std::string png = EncodeFigure(DrawIou(TwoScored(), options), "figure.png");
  const std::size_t at = png.find("pHYs");
  ASSERT_NE(at, std::string::npos);
  EXPECT_LT(at, png.find("IDAT"));
  EXPECT_EQ(BigEndian(png, at - 4), 9u);
  EXPECT_EQ(BigEndian(png, at + 4), 10000u);
  EXPECT_EQ(BigEndian(png, at + 8), 10000u);
  EXPECT_EQ(png[at + 12], 1);
  EXPECT_EQ(BigEndian(png, at + 13), crc32(0, reinterpret_cast<const Bytef*>(png.data() + at), 13));
}

TEST(FigureTest, SvgIsXmlThatHoldsTheTexts) {
  FigureOptions options = SmallFigure();
  options.title = "IoU < 1 & \"more\"";
  const std::string svg = EncodeFigure(DrawIou(TwoScored(), options), "figure.svg");
  EXPECT_THAT(SvgTexts(svg), AllOf(Contains("book"), Contains("sports ball"), Contains("mean of 3"),
                                   Contains("0.75"), Contains("0.71"), Contains("superquadrics"),
                                   Contains("not found"), Contains("IoU < 1 & \"more\"")));
  EXPECT_THAT(svg, Not(HasSubstr("<image"))) << "a chart is lines and texts only";
  const std::string shapes = EncodeFigure(DrawShapes(FewShapes(), SmallFigure()), "figure.svg");
  EXPECT_THAT(SvgTexts(shapes), AllOf(Contains("ε₁"), Contains("ε₂"), Contains("0.1"), Contains("2")));
  EXPECT_THAT(shapes, HasSubstr("data:image/png;base64,iVBOR"));
}

TEST(FigureTest, PdfHoldsTheTextsInEmbeddedFonts) {
  const std::string pdf = EncodeFigure(DrawIou(TwoScored(), SmallFigure()), "figure.pdf");
  EXPECT_TRUE(pdf.starts_with("%PDF-"));
  EXPECT_THAT(pdf.substr(pdf.size() - 8), HasSubstr("%%EOF"));
  EXPECT_THAT(pdf,
              AllOf(HasSubstr("DejaVuSans"), HasSubstr("/FontFile2"), Not(HasSubstr("/Subtype /Image"))));
  EXPECT_THAT(PdfLetters(PdfStreams(pdf)),
              AllOf(HasSubstr("sports ball"), HasSubstr("mean of 3"), HasSubstr("3D IoU")));
  const std::string shapes = EncodeFigure(DrawShapes(FewShapes(), SmallFigure()), "figure.pdf");
  EXPECT_THAT(shapes, HasSubstr("/Subtype /Image"));
  EXPECT_THAT(PdfStreams(shapes), AllOf(HasSubstr("<03b5>"), HasSubstr("<2081>")))
      << "epsilon, subscript one";
}

TEST(FigureTest, SameFigureGivesTheSameBytes) {
  for (const char* name : {"figure.png", "figure.svg", "figure.pdf"}) {
    EXPECT_EQ(EncodeFigure(DrawMaps(TwoMaps(), SmallFigure()), name),
              EncodeFigure(DrawMaps(TwoMaps(), SmallFigure()), name));
  }
  EXPECT_THAT(EncodeFigure(DrawIou(TwoScored(), SmallFigure()), "figure.pdf"),
              Not(HasSubstr("CreationDate")));
}

TEST(FigureTest, WithoutBackgroundCornersAreTransparentAndBarsAreNot) {
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

TEST(FigureTest, AClassHasOneColourInAllMapsAndTheLegendShowsAll) {
  const FigurePage page = DrawMaps(TwoMaps(), SmallFigure());
  const std::vector<std::string> labels = {"book", "cup", "laptop", "sports_ball"};
  const LabelColors colors(labels);
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

TEST(FigureTest, MapsWithoutImagesGetAnEmptyPlaceOnlyBesideOthers) {
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

TEST(FigureTest, PathsHaveOneScaleForBothAxes) {
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

TEST(FigureTest, BarsReachToTheirValues) {
  const FigurePage page = DrawIou({{"cup"}, {{"run", {0.5}}}}, {});
  std::vector<double> heights;
  for (const FigureElement& element : page.elements) {
    const auto* path = std::get_if<FigurePath>(&element);
    if (path != nullptr && path->fill && path->points.size() == 4) {
      heights.push_back(path->points[2].y() - path->points[0].y());
    }
  }
  ASSERT_EQ(heights.size(), 2u) << "the object's bar and the mean";
  EXPECT_NEAR(heights[0], 60.0, 1e-9) << "half of a plot of 120 points";
  EXPECT_NEAR(heights[1], 60.0, 1e-9);
}

TEST(FigureTest, AxesHaveRoundNumbers) {
  const ChartAxis axis = RoundAxis(0.13, 0.87, 4, true);
  EXPECT_DOUBLE_EQ(axis.step, 0.2);
  EXPECT_NEAR(axis.low, 0.0, 1e-12);
  EXPECT_NEAR(axis.high, 1.0, 1e-12);
  EXPECT_EQ(axis.Ticks().size(), 6u);
  EXPECT_EQ(axis.TickText(-0.4), "\u22120.4");
  EXPECT_EQ(RoundAxis(-30.0, 270.0, 3, false).TickText(100.0), "100");
  EXPECT_GT(RoundAxis(2.0, 2.0, 4, true).high, 2.0) << "a single value still makes an axis";
}

TEST(FigureTest, HatchesStayInsideTheirBars) {
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

TEST(FigureTest, LongTextsAreCutBetweenLetters) {
  const std::string text = "Größenverhältnisse";
  EXPECT_EQ(FittingText(text, 8.0, 1000.0), text);
  const std::string cut = FittingText(text, 8.0, 30.0);
  EXPECT_LE(TextWidth(cut, 8.0), 30.0);
  EXPECT_TRUE(cut.ends_with("…"));
  EXPECT_TRUE(text.starts_with(cut.substr(0, cut.size() - std::strlen("…"))));
}

TEST(FigureTest, NamesGetSmallerBeforeTheyAreCut) {
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

TEST(FigureTest, SizesWithoutSenseAreRefused) {
  FigureOptions options = SmallFigure();
  options.width_mm = 80.0;
  EXPECT_THROW(DrawIou(TwoScored(), options), UsageError) << "pixels and millimetres";
  options = SmallFigure();
  options.height_px = 16;
  EXPECT_THROW(DrawTiming(TwoTimings(), options), UsageError) << "no room";
  options = SmallFigure();
  options.font_size = 0.0;
  EXPECT_THROW(DrawShapes(FewShapes(), options), UsageError);
  ShapesFigure shapes = FewShapes();
  shapes.e1 = {2.5};
  EXPECT_THROW(DrawShapes(shapes, SmallFigure()), UsageError);
  EXPECT_THROW(CheckFigurePath("figure.jpg"), UsageError);
  EXPECT_THROW(DrawMaps({}, SmallFigure()), UsageError);
  EXPECT_THROW(DrawOutliers({}, SmallFigure()), UsageError);
  EXPECT_THROW(DrawYaw({}, SmallFigure()), UsageError);
}

}  // namespace
}  // namespace sqslam
