#include "render/gl/offscreen_context.h"

#include <gtest/gtest.h>
#include <vtkNew.h>
#include <vtkRenderer.h>

#include <cstdlib>

#include "render/gl/offscreen_window.h"
#include "slam/util/error.h"

namespace sqslam {
namespace {

class OffscreenContextTest : public testing::TestWithParam<RenderBackend> {};

TEST_P(OffscreenContextTest, DrawsBackgroundWithoutDisplay) {
  unsetenv("DISPLAY");
  OffscreenWindow window({.width = 40, .height = 30, .backend = GetParam()});
  EXPECT_EQ(window.Context().Backend(), GetParam());
  EXPECT_NE(window.Context().Description().find("OpenGL"), std::string::npos);
  vtkNew<vtkRenderer> renderer;
  renderer->SetBackground(1.0, 0.0, 0.0);
  window.AddRenderer(renderer);
  const cv::Mat image = window.Render();
  ASSERT_EQ(image.size(), cv::Size(40, 30));
  EXPECT_EQ(image.at<cv::Vec3b>(15, 20), cv::Vec3b(0, 0, 255));
}

TEST_P(OffscreenContextTest, AlternatesBetweenTwoWindows) {
  OffscreenWindow red({.width = 8, .height = 8, .backend = GetParam()});
  OffscreenWindow green({.width = 8, .height = 8, .backend = GetParam()});
  vtkNew<vtkRenderer> red_renderer;
  red_renderer->SetBackground(1.0, 0.0, 0.0);
  red.AddRenderer(red_renderer);
  vtkNew<vtkRenderer> green_renderer;
  green_renderer->SetBackground(0.0, 1.0, 0.0);
  green.AddRenderer(green_renderer);
  for (int turn = 0; turn < 2; ++turn) {
    EXPECT_EQ(red.Render().at<cv::Vec3b>(4, 4), cv::Vec3b(0, 0, 255));
    EXPECT_EQ(green.Render().at<cv::Vec3b>(4, 4), cv::Vec3b(0, 255, 0));
  }
}

INSTANTIATE_TEST_SUITE_P(Backends, OffscreenContextTest,
                         testing::Values(RenderBackend::kOsmesa, RenderBackend::kEgl),
                         [](const auto& info) { return std::string(NameOf(info.param)); });

}  // namespace
}  // namespace sqslam
