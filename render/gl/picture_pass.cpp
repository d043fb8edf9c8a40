#include "render/gl/picture_pass.h"

#include <fmt/format.h>
#include <vtkActor.h>
#include <vtkLightsPass.h>
#include <vtkMatrix4x4.h>
#include <vtkNew.h>
#include <vtkObjectFactory.h>
#include <vtkOpenGLFramebufferObject.h>
#include <vtkOpenGLRenderWindow.h>
#include <vtkOpenGLRenderer.h>
#include <vtkOpenGLState.h>
#include <vtkPolyDataMapper.h>
#include <vtkRenderState.h>
#include <vtkShaderProgram.h>
#include <vtkTextureObject.h>
#include <vtk_glew.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "picture_shaders.h"
#include "render/gl/point_splats.h"
#include "render/gl/screen_program.h"
#include "render/gl/solid_areas.h"
#include "render/gl/splat_raster.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace {

constexpr int kOcclusionStep = 2;  // pixels of the picture per pixel of ambient occlusion

// Returns where the solids are seen, with a margin: the smoothed occlusion reaches up to one of its own
// pixels beyond a solid.
SolidAreas AreasOf(const std::vector<vtkActor*>& solids, const Lens& lens, cv::Size picture) {
  std::vector<ClipBox> boxes;
  for (vtkActor* solid : solids) {
    const double* b = solid->GetMapper()->GetBounds();
    const Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>> T_map_solid(
        solid->GetMatrix()->GetData());
    boxes.push_back({{Eigen::Vector3d(b[0], b[2], b[4]), Eigen::Vector3d(b[1], b[3], b[5])},
                     lens.T_device_map * T_map_solid});
  }
  return FindSolidAreas(boxes, picture, 2.0 * kOcclusionStep);
}

std::string ProjectionSwitch(const Lens& lens) {
  return fmt::format("#define PARALLEL {:d}\n", lens.parallel);
}

}  // namespace

struct PicturePass::Impl {
  // True if the finishing pass reads normals and numbers of the solids, not only colours.
  bool NeedsSurfaces() const {
    return effects.occlusion > 0.0 || !layers.lines.empty() || effects.eye_dome > 0.0;
  }
  // The alpha of what is drawn is its share of a pixel.
  std::array<float, 4> Background() const {
    return ToFloats({effects.background[0], effects.background[1], effects.background[2], 0.0});
  }
  // True if the processor draws the points.
  bool DrawsPointsOnCpu() const { return !layers.points.empty() && IsSoftwareRenderer(); }
  void DrawScene(vtkRenderer* renderer, int width, int height);
  void DrawPoints(vtkRenderer* renderer, int height);
  void DrawPointsOnCpu(vtkRenderer* renderer, int width, int height);
  void DrawOcclusion(vtkOpenGLRenderWindow* window, const Lens& lens,
                     const std::vector<cv::Rect>& near_solids, cv::Size picture);
  std::string FinishSwitches(bool near_solids) const;
  vtkTextureObject* LineColors(vtkOpenGLRenderWindow* window);
  void DrawFinish(vtkOpenGLRenderWindow* window, const Lens& lens, const SolidAreas& areas, cv::Size picture);
  void FinishAreas(vtkOpenGLRenderWindow* window, const Lens& lens, bool near_solids,
                   const std::vector<cv::Rect>& areas, cv::Size picture);
  void SmoothEdges(vtkOpenGLRenderWindow* window, cv::Size picture);

  PictureEffects effects;
  PictureLayers layers;
  vtkNew<vtkLightsPass> lights;
  vtkSmartPointer<vtkOpenGLFramebufferObject> scene;
  vtkSmartPointer<vtkOpenGLFramebufferObject> occlusion_buffer;
  Target color;
  Target surfaces;
  Target depth;
  Target occlusion;
  Target smooth_occlusion;
  Target finished;  // before edge smoothing
  vtkSmartPointer<vtkTextureObject> line_colors;
  SplatRaster raster;
  ScreenProgram occlusion_program;
  ScreenProgram smoothing_program;
  std::array<ScreenProgram, 2> finish_programs;  // elsewhere, near solids
  ScreenProgram edges_program;
};

vtkStandardNewMacro(PicturePass);
PicturePass::PicturePass() : impl_(std::make_unique<Impl>()) {}
PicturePass::~PicturePass() = default;

void PicturePass::SetEffects(const PictureEffects& effects) { impl_->effects = effects; }
void PicturePass::SetLayers(PictureLayers layers) { impl_->layers = std::move(layers); }

// Clears the bound targets and draws the points.
void PicturePass::Impl::DrawPoints(vtkRenderer* renderer, int height) {
  const float farthest = 1.0F;
  glClearBufferfv(GL_COLOR, 0, Background().data());
  glClearBufferfv(GL_DEPTH, 0, &farthest);
  for (PointSplats* points : layers.points) {
    points->Draw(renderer, height);
  }
}

// Has the processor draw the points on the background.
void PicturePass::Impl::DrawPointsOnCpu(vtkRenderer* renderer, int width, int height) {
  std::array<std::uint8_t, 4> rgba{};
  std::ranges::transform(Background(), rgba.begin(), [](float share) {
    return static_cast<std::uint8_t>(std::lround(255.0F * std::clamp(share, 0.0F, 1.0F)));
  });
  raster.Clear({width, height}, rgba);
  for (const PointSplats* points : layers.points) {
    points->Draw(renderer, raster);
  }
  color.Fill(GL_RGBA, GL_UNSIGNED_BYTE, raster.Colors().data);
  depth.Fill(GL_DEPTH_COMPONENT, GL_FLOAT, raster.Depths().data);
}

void PicturePass::Impl::DrawScene(vtkRenderer* renderer, int width, int height) {
  auto* window = vtkOpenGLRenderWindow::SafeDownCast(renderer->GetRenderWindow());
  color.Ensure(window, width, height, GL_RGBA8, true);
  depth.Ensure(window, width, height, GL_DEPTH_COMPONENT);
  if (DrawsPointsOnCpu()) {  // first: OpenGL would have to wait for all that is drawn before
    DrawPointsOnCpu(renderer, width, height);
  }
  EnsureBound(scene, window);
  scene->AddColorAttachment(0, color.texture);
  if (NeedsSurfaces()) {
    surfaces.Ensure(window, width, height, GL_RGBA8, true);
    scene->AddColorAttachment(1, surfaces.texture);
  } else {
    scene->RemoveColorAttachment(1);
  }
  scene->AddDepthAttachment(depth.texture);
  vtkOpenGLState* state = window->GetState();
  StartDrawingTo(scene, NeedsSurfaces() ? 2 : 1, state, width, height);
  state->vtkglDepthMask(GL_TRUE);
  state->vtkglColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
  state->vtkglEnable(GL_DEPTH_TEST);
  if (NeedsSurfaces()) {
    const std::array<float, 4> nothing{};
    glClearBufferfv(GL_COLOR, 1, nothing.data());
  }
  constexpr std::array<GLenum, 2> kColorOnly = {GL_COLOR_ATTACHMENT0, GL_NONE};
  glDrawBuffers(2, kColorOnly.data());
  if (!DrawsPointsOnCpu()) {
    state->vtkglDisable(GL_BLEND);
    DrawPoints(renderer, height);
  }
  state->vtkglEnable(GL_BLEND);
  for (vtkActor* actor : layers.opaque) {
    actor->RenderOpaqueGeometry(renderer);
  }
  for (vtkActor* actor : layers.ground) {
    actor->RenderTranslucentPolygonalGeometry(renderer);
  }
  if (NeedsSurfaces()) {
    constexpr std::array<GLenum, 2> kBoth = {GL_COLOR_ATTACHMENT0, GL_COLOR_ATTACHMENT1};
    glDrawBuffers(2, kBoth.data());
  }
  glDisablei(GL_BLEND, 1);  // no blending: the last solid drawn at a pixel is the nearest
  for (vtkActor* solid : layers.solids) {
    if (effects.see_through) {  // writes no depth
      solid->RenderTranslucentPolygonalGeometry(renderer);
    } else {
      solid->RenderOpaqueGeometry(renderer);
    }
  }
  state->vtkglDepthMask(GL_TRUE);
  scene->ActivateDrawBuffers(1);
}

void PicturePass::Impl::DrawOcclusion(vtkOpenGLRenderWindow* window, const Lens& lens,
                                      const std::vector<cv::Rect>& near_solids, cv::Size picture) {
  const auto steps = [](int pixels) { return (pixels + kOcclusionStep - 1) / kOcclusionStep; };
  const int width = steps(picture.width);
  const int height = steps(picture.height);
  const std::vector<cv::Rect> areas = ToVector(near_solids, [&](const cv::Rect& area) {
    return cv::Rect(steps(area.x), steps(area.y), steps(area.width), steps(area.height));
  });
  const std::array<float, 4> nothing{};
  occlusion.Ensure(window, width, height, GL_RG16F);
  smooth_occlusion.Ensure(window, width, height, GL_RG16F);
  EnsureBound(occlusion_buffer, window);
  occlusion_buffer->AddColorAttachment(0, occlusion.texture);
  StartDrawingTo(occlusion_buffer, 1, window->GetState(), width, height);
  glClearBufferfv(GL_COLOR, 0, nothing.data());
  vtkShaderProgram* program = occlusion_program.Ready(
      window, ProjectionSwitch(lens) + shaders::kOcclusionDeclarations + shaders::kLens, shaders::kOcclusion);
  const auto radius = static_cast<float>(effects.occlusion_radius);
  surfaces.texture->Activate();
  depth.texture->Activate();
  program->SetUniformi("surfaces", surfaces.texture->GetTextureUnit());
  program->SetUniformi("depths", depth.texture->GetTextureUnit());
  program->SetUniform2f("depthRange", lens.depth_range.data());
  const std::array<int, 2> target = {width, height};
  program->SetUniform2i("target", target.data());
  program->SetUniformi("taps", effects.occlusion > 0.0 ? 11 : 0);
  program->SetUniformi("surfacesPerPixel", effects.samples * kOcclusionStep);
  program->SetUniformf("radius", radius);
  program->SetUniform4f("lens", lens.terms.data());
  program->SetUniform4f("ground", lens.ground.data());
  program->SetUniformi("hasGround", effects.has_ground ? 1 : 0);
  occlusion_program.Fill(areas, {width, height});
  depth.texture->Deactivate();
  surfaces.texture->Deactivate();

  occlusion_buffer->AddColorAttachment(0, smooth_occlusion.texture);
  glClearBufferfv(GL_COLOR, 0, nothing.data());
  program = smoothing_program.Ready(window, shaders::kSmoothingDeclarations, shaders::kSmoothing);
  occlusion.texture->Activate();
  program->SetUniformi("occlusion", occlusion.texture->GetTextureUnit());
  program->SetUniformf("radius", radius);
  smoothing_program.Fill(areas, {width, height});
  occlusion.texture->Deactivate();
}

std::string PicturePass::Impl::FinishSwitches(bool near_solids) const {
  return fmt::format(
      "#define SAMPLES {}\n#define NEAR_SOLIDS {:d}\n#define OCCLUSION {:d}\n#define OUTLINE {:d}\n"
      "#define EYE_DOME {:d}\n#define SEE_THROUGH {:d}\n",
      effects.samples, near_solids, near_solids && effects.occlusion > 0.0,
      near_solids && !layers.lines.empty(), effects.eye_dome > 0.0, effects.see_through);
}

// Returns a texture of one row with a colour for each number that solids write.
vtkTextureObject* PicturePass::Impl::LineColors(vtkOpenGLRenderWindow* window) {
  std::array<unsigned char, 256 * 4> row{};
  for (std::size_t i = 0; i < layers.lines.size(); ++i) {
    for (int c = 0; c < 4; ++c) {
      row[4 * (i % 250 + 2) + static_cast<std::size_t>(c)] =
          static_cast<unsigned char>(std::lround(255.0 * std::clamp(layers.lines[i][c], 0.0, 1.0)));
    }
  }
  line_colors = vtkSmartPointer<vtkTextureObject>::New();
  line_colors->SetContext(window);
  line_colors->Create2DFromRaw(256, 1, 4, VTK_UNSIGNED_CHAR, row.data());
  return line_colors;
}

void PicturePass::Impl::DrawFinish(vtkOpenGLRenderWindow* window, const Lens& lens, const SolidAreas& areas,
                                   cv::Size picture) {
  std::vector<vtkTextureObject*> textures = {color.texture, surfaces.texture, depth.texture,
                                             smooth_occlusion.texture};
  if (!layers.lines.empty()) {
    textures.push_back(LineColors(window));
  }
  std::erase(textures, nullptr);
  for (vtkTextureObject* texture : textures) {
    texture->Activate();
  }
  FinishAreas(window, lens, false, areas.elsewhere, picture);
  FinishAreas(window, lens, true, areas.near_solids, picture);
  for (vtkTextureObject* texture : textures) {
    texture->Deactivate();
  }
}

void PicturePass::Impl::FinishAreas(vtkOpenGLRenderWindow* window, const Lens& lens, bool near_solids,
                                    const std::vector<cv::Rect>& areas, cv::Size picture) {
  if (areas.empty()) {
    return;
  }
  ScreenProgram& finish = finish_programs[near_solids ? 1 : 0];
  vtkShaderProgram* program = finish.Ready(
      window,
      FinishSwitches(near_solids) + ProjectionSwitch(lens) + shaders::kLens + shaders::kFinishDeclarations,
      shaders::kFinish);
  vtkTextureObject* open = smooth_occlusion.texture ? smooth_occlusion.texture : color.texture;
  program->SetUniformi("colors", color.texture->GetTextureUnit());
  if (NeedsSurfaces()) {
    program->SetUniformi("surfaces", surfaces.texture->GetTextureUnit());
  }
  if (!layers.lines.empty()) {
    program->SetUniformi("lineColors", line_colors->GetTextureUnit());
  }
  if (effects.see_through) {
    program->SetUniform3f("surfaceRange", effects.surface_range.data());
  }
  program->SetUniformi("depths", depth.texture->GetTextureUnit());
  program->SetUniformi("occlusion", open->GetTextureUnit());
  program->SetUniformi("occlusionStep", effects.samples * kOcclusionStep);
  program->SetUniformf("occlusionStrength", static_cast<float>(effects.occlusion));
  program->SetUniformf("radius", static_cast<float>(std::max(effects.occlusion_radius, 1e-9)));
  const Eigen::Vector2f widths = effects.line_widths.cast<float>();
  program->SetUniform2f("outlineWidths", widths.data());
  program->SetUniform4f("background", ToFloats(effects.background).data());
  program->SetUniformf("eyeDome", static_cast<float>(effects.eye_dome));
  program->SetUniform2f("depthRange", lens.depth_range.data());
  finish.Fill(areas, picture);
}

// VTK's own filter for this took 1.4 times as long a frame with software OpenGL.
void PicturePass::Impl::SmoothEdges(vtkOpenGLRenderWindow* window, cv::Size picture) {
  vtkShaderProgram* program =
      edges_program.Ready(window, shaders::kSmoothEdgesDeclarations, shaders::kSmoothEdges);
  finished.texture->Activate();
  program->SetUniformi("finished", finished.texture->GetTextureUnit());
  edges_program.Fill({{0, 0, picture.width, picture.height}}, picture);
  finished.texture->Deactivate();
}

void PicturePass::Render(const vtkRenderState* state) {
  this->NumberOfRenderedProps = 0;
  Impl& s = *impl_;
  vtkRenderer* renderer = state->GetRenderer();
  auto* window = vtkOpenGLRenderWindow::SafeDownCast(renderer->GetRenderWindow());
  vtkOpenGLState* gl = window->GetState();
  int width = 0;
  int height = 0;
  int left = 0;
  int bottom = 0;
  renderer->GetTiledSizeAndOrigin(&width, &height, &left, &bottom);
  const Lens lens(renderer, s.effects.ground_plane);
  const cv::Size picture(width, height);
  const SolidAreas areas = AreasOf(s.layers.solids, lens, picture);
  s.lights->Render(state);

  gl->PushFramebufferBindings();
  {
    const vtkOpenGLState::ScopedglViewport viewport(gl);
    const vtkOpenGLState::ScopedglScissor scissor(gl);
    const vtkOpenGLState::ScopedglEnableDisable scissor_test(gl, GL_SCISSOR_TEST);
    const vtkOpenGLState::ScopedglEnableDisable depth_test(gl, GL_DEPTH_TEST);
    s.DrawScene(renderer, width * s.effects.samples, height * s.effects.samples);
    gl->vtkglDisable(GL_BLEND);
    gl->vtkglDisable(GL_DEPTH_TEST);
    if ((s.effects.occlusion > 0.0 || !s.layers.lines.empty()) && !areas.near_solids.empty()) {
      s.DrawOcclusion(window, lens, areas.near_solids, picture);
    }
    if (s.effects.fxaa) {
      s.finished.Ensure(window, width, height, GL_RGBA8, true);
      EnsureBound(s.occlusion_buffer, window);
      s.occlusion_buffer->AddColorAttachment(0, s.finished.texture);
      StartDrawingTo(s.occlusion_buffer, 1, gl, width, height);
      s.DrawFinish(window, lens, areas, picture);
    }
  }
  gl->PopFramebufferBindings();

  const vtkOpenGLState::ScopedglViewport viewport(gl);
  const vtkOpenGLState::ScopedglScissor scissor(gl);
  const vtkOpenGLState::ScopedglEnableDisable scissor_test(gl, GL_SCISSOR_TEST);
  const vtkOpenGLState::ScopedglEnableDisable depth_test(gl, GL_DEPTH_TEST);
  gl->vtkglEnable(GL_SCISSOR_TEST);
  gl->vtkglDisable(GL_DEPTH_TEST);
  gl->vtkglViewport(left, bottom, width, height);
  gl->vtkglScissor(left, bottom, width, height);
  if (s.effects.fxaa) {
    s.SmoothEdges(window, picture);
  } else {
    s.DrawFinish(window, lens, areas, picture);
  }
  gl->vtkglEnable(GL_BLEND);
}

void PicturePass::ReleaseGraphicsResources(vtkWindow* window) {
  Impl& s = *impl_;
  s.lights->ReleaseGraphicsResources(window);
  for (ScreenProgram* program : {&s.occlusion_program, &s.smoothing_program, &s.finish_programs[0],
                                 &s.finish_programs[1], &s.edges_program}) {
    program->ReleaseGraphicsResources();
  }
  for (Target* target : {&s.color, &s.surfaces, &s.depth, &s.occlusion, &s.smooth_occlusion, &s.finished}) {
    if (target->texture) {
      target->texture->ReleaseGraphicsResources(window);
      target->texture = nullptr;
    }
  }
  if (s.line_colors) {
    s.line_colors->ReleaseGraphicsResources(window);
    s.line_colors = nullptr;
  }
  for (PointSplats* points : s.layers.points) {
    points->ReleaseGraphicsResources();
  }
  for (auto* buffer : {&s.scene, &s.occlusion_buffer}) {
    if (*buffer) {
      (*buffer)->ReleaseGraphicsResources(window);
      *buffer = nullptr;
    }
  }
}

}  // namespace sqslam
