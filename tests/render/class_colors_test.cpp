#include "render/scene/class_colors.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <fstream>
#include <opencv2/imgproc.hpp>
#include <set>

#include "render/scene/style.h"
#include "slam/util/data_path.h"
#include "slam/util/error.h"
#include "tests/io/temporary_folder.h"

namespace sqslam {
namespace {

using ::testing::HasSubstr;

const std::vector<std::string> kOnADesk = {"chair", "table", "tv",     "monitor", "laptop", "keyboard",
                                           "mouse", "cup",   "bottle", "vase",    "bowl",   "book"};

// Colours as dichromats see them (Machado, Oliveira and Fernandes 2009, severity 1), on linear RGB.
Eigen::Matrix3d SightOf(const std::string& vision) {
  Eigen::Matrix3d seen = Eigen::Matrix3d::Identity();
  if (vision == "protanopia") {
    seen << 0.152286, 1.052583, -0.204868, 0.114503, 0.786281, 0.099216, -0.003882, -0.048116, 1.051998;
  } else if (vision == "deuteranopia") {
    seen << 0.367322, 0.860646, -0.227968, 0.280085, 0.672501, 0.047413, -0.011820, 0.042940, 0.968881;
  } else if (vision == "tritanopia") {
    seen << 1.255528, -0.076749, -0.178779, -0.078411, 0.930809, 0.147602, 0.004733, 0.691367, 0.303900;
  }
  return seen;
}

// CIELAB of a colour as seen.
Eigen::Vector3d LabOf(const Eigen::Vector3d& rgb, const std::string& vision) {
  const auto linear = [](double c) { return c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4); };
  const auto gamma = [](double c) {
    const double x = std::clamp(c, 0.0, 1.0);
    return x <= 0.0031308 ? 12.92 * x : 1.055 * std::pow(x, 1.0 / 2.4) - 0.055;
  };
  const Eigen::Vector3d seen = (SightOf(vision) * rgb.unaryExpr(linear)).unaryExpr(gamma);
  const cv::Mat pixel(1, 1, CV_32FC3, cv::Scalar(seen.x(), seen.y(), seen.z()));
  cv::Mat lab;
  cv::cvtColor(pixel, lab, cv::COLOR_RGB2Lab);
  const auto& v = lab.at<cv::Vec3f>(0, 0);
  return {v[0], v[1], v[2]};
}

double LeastDistance(const std::string& vision, bool lightness_only = false) {
  const LabelColors colors;
  double least = 1e9;
  for (const std::string& a : kOnADesk) {
    for (const std::string& b : kOnADesk) {
      const Eigen::Vector3d apart = LabOf(colors(a), vision) - LabOf(colors(b), vision);
      least = a == b ? least : std::min(least, lightness_only ? std::abs(apart.x()) : apart.norm());
    }
  }
  return least;
}

TEST(ClassColorsTest, TellsClassesOfADeskApartForEveryReader) {
  EXPECT_GT(LeastDistance("normal"), 30.0);
  EXPECT_GT(LeastDistance("protanopia"), 13.0);
  EXPECT_GT(LeastDistance("deuteranopia"), 13.0);
  EXPECT_GT(LeastDistance("tritanopia"), 13.0);
  EXPECT_GT(LeastDistance("normal", true), 3.0) << "in grey";
}

TEST(ClassColorsTest, GivesEveryKnownClassItsOwnColour) {
  std::ifstream file(DataPath("configs/classes.yaml"));
  std::set<std::string> colors;
  std::size_t classes = 0;
  for (std::string line; std::getline(file, line);) {
    if (const std::size_t colon = line.find(": {size"); colon != std::string::npos) {
      colors.insert(FormatColor(LabelColors()(line.substr(0, colon))));
      ++classes;
    }
  }
  EXPECT_GT(classes, 100u);
  EXPECT_EQ(colors.size(), classes);
}

TEST(ClassColorsTest, DependsOnLettersAlone) {
  const LabelColors colors;
  EXPECT_EQ(colors("Sports Ball"), colors("sports_ball"));
  // Pinned: another value would change the colours of all maps with labels of one's own.
  EXPECT_EQ(FormatColor(colors("theodolite")), "#c30f78");
  EXPECT_EQ(FormatColor(colors("cup")), "#e10f69");
}

TEST(ClassColorsTest, ReadsOwnColoursFromStyleAndSettings) {
  const TemporaryFolder folder;
  const std::string file = (folder.Path() / "mine.yaml").string();
  std::ofstream(file) << "objects:\n  opacity: 0.5\n  colors: {cup: \"#0072B2\", sports ball: \"#112233\"}\n";
  SceneStyle style = LoadStyle(file);
  SetStyle({"objects.colors.gizmo=#445566", "objects.colors.cup=\"#010203\"", "background=#fefefe"}, style);
  CheckStyle(style);
  const LabelColors colors(style.objects.colors);
  EXPECT_EQ(FormatColor(colors("cup")), "#010203") << "the last word";
  EXPECT_EQ(FormatColor(colors("sports_ball")), "#112233");
  EXPECT_EQ(FormatColor(colors("gizmo")), "#445566");
  EXPECT_EQ(colors("book"), LabelColors()("book"));
  EXPECT_EQ(style.objects.opacity, 0.5);
  EXPECT_EQ(style.background, "#fefefe");
}

std::string ErrorOf(const std::function<void()>& action) {
  try {
    action();
  } catch (const UsageError& error) {
    return error.what();
  }
  return "";
}

TEST(ClassColorsTest, NamesClassOfInvalidColour) {
  const TemporaryFolder folder;
  const std::string file = (folder.Path() / "mine.yaml").string();
  std::ofstream(file) << "objects:\n  colors: {cup: blue}\n";
  EXPECT_THAT(ErrorOf([&] { LoadStyle(file); }), HasSubstr("objects.colors.cup: colour \"blue\""));
  std::ofstream(file) << "objects:\n  colors: blue\n";
  EXPECT_THAT(ErrorOf([&] { LoadStyle(file); }), HasSubstr("mine.yaml:2: objects.colors: expected a colour"));
  SceneStyle style;
  EXPECT_THAT(ErrorOf([&] { SetStyle({"objects.colors.=#112233"}, style); }), HasSubstr("unknown option"));
  EXPECT_THAT(ErrorOf([&] { SetStyle({"objects.colours.cup=#112233"}, style); }),
              HasSubstr("unknown option"));
}

}  // namespace
}  // namespace sqslam
