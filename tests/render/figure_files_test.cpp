#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zlib.h>

#include <algorithm>

#include "figure_reading.h"
#include "figure_samples.h"
#include "render/figures/figure_input.h"
#include "render/page/chart.h"
#include "render/page/page.h"
#include "slam/util/error.h"
#include "tests/io/temporary_folder.h"

namespace sqslam {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

// Returns the uncompressed contents of all streams.
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

// Returns the letters drawn in fonts with one byte per letter, in drawing order.
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

TEST(FigureFilesTest, HasRequestedSize) {
  FigureOptions options = SmallFigure();
  EXPECT_EQ(Pixels(DrawIou(TwoScored(), options)).size(), cv::Size(360, 270));
  options = {};
  options.width_mm = 101.6;
  options.height_mm = 50.8;
  options.dpi = 150.0;
  EXPECT_EQ(Pixels(DrawIou(TwoScored(), options)).size(), cv::Size(600, 300));
  options.dpi.reset();
  EXPECT_EQ(Pixels(DrawIou(TwoScored(), options)).size(), cv::Size(1200, 600)) << "300 dpi by default";
}

TEST(FigureFilesTest, StoresDensityInPng) {
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

TEST(FigureFilesTest, WritesTextsIntoSvg) {
  FigureOptions options = SmallFigure();
  options.title = "IoU < 1 & \"more\"";
  const std::string svg = EncodeFigure(DrawIou(TwoScored(), options), "figure.svg");
  EXPECT_THAT(SvgTexts(svg),
              AllOf(Contains("book"), Contains("sports ball"), Contains("mean of 3"), Contains("0.75"),
                    Contains("0.71"), Contains(HasSubstr("superquadrics: mean 0.71 of 3")),
                    Contains("not found"), Contains("IoU < 1 & \"more\"")));
  EXPECT_THAT(svg, Not(HasSubstr("<image"))) << "a chart is lines and texts only";
  const std::string shapes = EncodeFigure(DrawShapes(FewShapes(), SmallFigure()), "figure.svg");
  EXPECT_THAT(SvgTexts(shapes), AllOf(Contains("ε₁"), Contains("ε₂"), Contains("0.1"), Contains("2")));
  EXPECT_THAT(shapes, HasSubstr("data:image/png;base64,iVBOR"));
}

TEST(FigureFilesTest, DrawsHaloBelowTextForEveryViewer) {
  FigurePage page;
  page.width = page.height = 100.0;
  FigureText text{"cup", {50.0, 50.0}, 10.0, {0.0, 0.0, 0.0}};
  text.halo = Eigen::Vector3d(1.0, 1.0, 1.0);
  page.Text(text);
  const std::string svg = SvgElement(page);
  EXPECT_EQ(svg.find("paint-order"), svg.npos);
  const std::size_t halo = svg.find("stroke-width"), letters = svg.rfind("<text");
  EXPECT_LT(halo, letters);
  EXPECT_EQ(svg.find("stroke", letters), svg.npos);
  EXPECT_THAT(SvgTexts(svg), ::testing::ElementsAre("cup"));
}

TEST(FigureFilesTest, EmbedsFontOfChoice) {
  const TemporaryFolder folder;
  EXPECT_THROW(UseFont(folder.Write("none.ttf", "nothing")), InputError);
  FigurePage page;
  page.width = page.height = 100.0;
  page.Text({"cup", {50.0, 50.0}, 10.0, {0.0, 0.0, 0.0}});
  const double before = TextWidth("cup", 10.0);
  UseFont("/usr/share/fonts/truetype/dejavu/DejaVuSerif.ttf");
  const std::string svg = EncodeFigure(page, "page.svg"), pdf = EncodeFigure(page, "page.pdf");
  const double after = TextWidth("cup", 10.0);
  UseFont("/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf");
  EXPECT_NE(before, after);
  EXPECT_EQ(TextWidth("cup", 10.0), before);
  EXPECT_NE(svg.find("font-family=\"'DejaVu Serif'"), svg.npos);
  EXPECT_NE(svg.find("@font-face { font-family: 'DejaVu Serif'; src: url(data:font/ttf;base64,"), svg.npos);
  EXPECT_NE(pdf.find("DejaVuSerif"), pdf.npos);
}

TEST(FigureFilesTest, EmbedsFontsInPdf) {
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

TEST(FigureFilesTest, GivesSameBytesForSameFigure) {
  for (const char* name : {"figure.png", "figure.svg", "figure.pdf"}) {
    EXPECT_EQ(EncodeFigure(DrawMaps(TwoMaps(), SmallFigure()), name),
              EncodeFigure(DrawMaps(TwoMaps(), SmallFigure()), name));
  }
  EXPECT_THAT(EncodeFigure(DrawIou(TwoScored(), SmallFigure()), "figure.pdf"),
              Not(HasSubstr("CreationDate")));
}

TEST(FigureFilesTest, ShowsInvalidUtf8AsReplacementCharacters) {
  const auto encoded = [](const std::string& name, const std::string& file) {
    FigureOptions options = SmallFigure();
    options.title = name;
    TimingFigure figure = TwoTimings();
    figure.series[0].name = name;
    return EncodeFigure(DrawTiming(figure, options), file);
  };
  for (const char* file : {"figure.png", "figure.svg", "figure.pdf"}) {
    EXPECT_TRUE(encoded("caf\xe9", file) == encoded("caf\xef\xbf\xbd", file)) << file;
  }
}

TEST(FigureFilesTest, DrawsCalibrationErrorsFromCornerToModel) {
  Calibration calibration;
  calibration.camera = {320, 240, 300.0, 300.0, 159.5, 119.5};
  calibration.views = {{"view", {{100.0, 120.0}}, {{2.0, 0.0}}, Eigen::Vector3d::UnitZ(), 2.0}};
  calibration.rms = 2.0;
  const FigurePage page = DrawCalibration(calibration, SmallFigure());
  const Eigen::Vector3d blue = LookOfSeries(0).color;
  const auto line =
      std::find_if(page.elements.begin(), page.elements.end(), [&](const FigureElement& element) {
        const auto* path = std::get_if<FigurePath>(&element);
        return path != nullptr && path->points.size() == 2 && path->stroke && path->stroke->color == blue;
      });
  ASSERT_NE(line, page.elements.end());
  const std::vector<Eigen::Vector2d>& points = std::get<FigurePath>(*line).points;
  EXPECT_LT(points[1].x(), points[0].x() - 1.0) << "detected to the right of the model's corner";
  EXPECT_NEAR(points[1].y(), points[0].y(), 1e-9);
}

TEST(FigureFilesTest, RejectsInvalidSizes) {
  FigureOptions options = SmallFigure();
  options.width_mm = 80.0;
  EXPECT_THROW(DrawIou(TwoScored(), options), UsageError) << "pixels and millimetres";
  options = SmallFigure();
  options.pixels = {360, 16};
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
