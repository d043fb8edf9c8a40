#include "render/gl/splat_raster.h"

#include <gtest/gtest.h>
#include <vtkCamera.h>
#include <vtkNew.h>
#include <vtkObjectFactory.h>
#include <vtkOpenGLRenderWindow.h>
#include <vtkOpenGLState.h>
#include <vtkRenderPass.h>
#include <vtkRenderState.h>
#include <vtkRenderer.h>
#include <vtk_glew.h>

#include <opencv2/imgproc.hpp>
#include <random>

#include "render/gl/offscreen_window.h"

namespace sqslam {
namespace {

// Draws points by OpenGL, and a second time by the processor.
class BothWays : public vtkRenderPass {
 public:
  static BothWays* New();
  vtkTypeMacro(BothWays, vtkRenderPass);
  void Render(const vtkRenderState* state) override {
    vtkRenderer* renderer = state->GetRenderer();
    raster.Clear({renderer->GetSize()[0], renderer->GetSize()[1]}, {0, 0, 0, 0});
    by_processor->Draw(renderer, raster);
    vtkOpenGLState* gl = vtkOpenGLRenderWindow::SafeDownCast(renderer->GetRenderWindow())->GetState();
    gl->vtkglViewport(0, 0, renderer->GetSize()[0], renderer->GetSize()[1]);
    gl->vtkglScissor(0, 0, renderer->GetSize()[0], renderer->GetSize()[1]);
    gl->vtkglDepthMask(GL_TRUE);
    gl->vtkglEnable(GL_DEPTH_TEST);
    gl->vtkglDisable(GL_BLEND);
    gl->vtkglClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    by_opengl->Draw(renderer, renderer->GetSize()[1]);
  }
  void ReleaseGraphicsResources(vtkWindow*) override { by_opengl->ReleaseGraphicsResources(); }

  PointSplats* by_opengl = nullptr;
  const PointSplats* by_processor = nullptr;
  SplatRaster raster;
};
vtkStandardNewMacro(BothWays);

std::vector<PointSplats::Vertex> ManyPoints() {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> place(-1.3F, 1.3F);
  std::uniform_int_distribution<int> level(40, 255);
  std::vector<PointSplats::Vertex> points;
  for (int i = 0; i < 2000; ++i) {
    PointSplats::Vertex& point = points.emplace_back();
    point.p_map = {place(random), place(random), place(random)};
    point.size = 0.01F * static_cast<float>(1 + i % 9);
    point.frame = static_cast<float>(i % 4);
    point.rgba = {static_cast<std::uint8_t>(level(random)), static_cast<std::uint8_t>(level(random)), 90,
                  255};
  }
  return points;
}

TEST(SplatRasterTest, MatchesOpenGl) {
  for (const bool in_map_units : {false, true}) {
    const PointSplats::Look look{.in_map_units = in_map_units,
                                 .scale = in_map_units ? 1.0F : 120.0F,
                                 .newest = 2.0F,
                                 .cut = {0.0F, 0.0F, 1.0F, 0.8F}};
    PointSplats by_opengl;
    PointSplats by_processor;
    for (PointSplats* points : {&by_opengl, &by_processor}) {
      points->SetVertices(ManyPoints());
      points->SetRanges({{0, 700, 0.0F}, {900, 1100, 0.03F}});
      points->SetLook(look);
    }
    OffscreenWindow window({.width = 320, .height = 240});
    const vtkNew<BothWays> pass;
    pass->by_opengl = &by_opengl;
    pass->by_processor = &by_processor;
    const vtkNew<vtkRenderer> renderer;
    renderer->SetPass(pass);
    renderer->GetActiveCamera()->SetPosition(1.0, 2.0, 3.0);
    renderer->GetActiveCamera()->SetClippingRange(0.5, 20.0);
    window.AddRenderer(renderer);
    const cv::Mat drawn = window.Render();

    cv::Mat4b rgba(240, 320);
    std::copy_n(reinterpret_cast<const cv::Vec4b*>(pass->raster.Colors()[0]), rgba.total(), rgba.begin());
    cv::Mat expected;
    cv::cvtColor(rgba, expected, cv::COLOR_RGBA2BGR);
    cv::flip(expected, expected, 0);
    cv::Mat different = drawn != expected;
    cv::Mat any;
    cv::cvtColor(different, any, cv::COLOR_BGR2GRAY);
    cv::Mat grey;
    cv::cvtColor(expected, grey, cv::COLOR_BGR2GRAY);
    EXPECT_GT(cv::countNonZero(grey), 4000);
    // Edges of discs may fall on either side of a pixel's centre.
    EXPECT_LT(cv::countNonZero(any), 0.01 * cv::countNonZero(grey));
    renderer->SetPass(nullptr);
  }
}

TEST(SplatRasterTest, ShowsNearestPoint) {
  SplatRaster raster;
  raster.Clear({9, 9}, {1, 2, 3, 0});
  std::vector<PointSplats::Vertex> points(3);
  points[0] = {{0.0F, 0.0F, 0.2F}, 5.0F, 0.0F, {10, 0, 0, 255}};
  points[1] = {{0.0F, 0.0F, -0.2F}, 3.0F, 0.0F, {20, 0, 0, 255}};
  points[2] = {{0.0F, 0.0F, 0.4F}, 7.0F, 0.0F, {30, 0, 0, 255}};
  const PointSplats::Range all{0, 3, 0.0F};
  raster.Draw(points, {&all, 1}, {}, Eigen::Matrix4f::Identity(), 1.0F);
  const auto red = [&](int row, int column) { return raster.Colors()(row, column) & 0xFF; };
  EXPECT_EQ(red(4, 4), 20);
  EXPECT_EQ(red(4, 6), 10);
  EXPECT_EQ(red(4, 7), 30);
  EXPECT_EQ(red(7, 7), 1);
  EXPECT_FLOAT_EQ(raster.Depths()(4, 4), 0.4F);
  EXPECT_FLOAT_EQ(raster.Depths()(0, 0), 1.0F);
}

}  // namespace
}  // namespace sqslam
