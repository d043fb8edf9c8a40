#include "render/synthetic/scene_renderer.h"

#include <vtkActor.h>
#include <vtkCallbackCommand.h>
#include <vtkCamera.h>
#include <vtkImageData.h>
#include <vtkOpenGLRenderWindow.h>
#include <vtkOpenGLState.h>
#include <vtkPointData.h>
#include <vtkPolyDataMapper.h>
#include <vtkProperty.h>
#include <vtkTexture.h>
#include <vtkUnsignedCharArray.h>
#include <vtk_glew.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/core/utility.hpp>
#include <opencv2/imgproc.hpp>

#include "render/solids/poly_data.h"
#include "render/solids/tessellation.h"
#include "slam/util/throw_if.h"

namespace sqslam {
namespace {

constexpr double kNearPlane = 0.05;  // metres
constexpr double kFarPlane = 30.0;

vtkNew<vtkTexture> MakeTexture(const cv::Mat& bgr) {
  vtkNew<vtkImageData> image;
  image->SetDimensions(bgr.cols, bgr.rows, 1);
  image->AllocateScalars(VTK_UNSIGNED_CHAR, 3);
  cv::Mat bottom_up(bgr.rows, bgr.cols, CV_8UC3, image->GetScalarPointer());
  cv::cvtColor(bgr, bottom_up, cv::COLOR_BGR2RGB);
  cv::flip(bottom_up, bottom_up, 0);
  vtkNew<vtkTexture> texture;
  texture->SetInputData(image);
  texture->InterpolateOn();
  texture->MipmapOn();
  texture->RepeatOff();
  texture->EdgeClampOn();
  return texture;
}

void DisableBlending(vtkObject* renderer, unsigned long, void*, void*) {
  vtkRenderWindow* window = vtkRenderer::SafeDownCast(renderer)->GetRenderWindow();
  vtkOpenGLRenderWindow::SafeDownCast(window)->GetState()->vtkglDisable(GL_BLEND);
}

// Returns a pinhole camera that sees what a lens with distortion sees, with the same scale in the middle.
Camera PinholeOf(const Camera& lens, int supersampling) {
  constexpr float kMaxSide = 16384.0F;  // pixels, of a side of a picture that OpenGL draws
  if (!lens.HasDistortion()) {
    return lens;
  }
  std::vector<cv::Point2f> border;
  for (const double x : {0.0, lens.cx, lens.width - 1.0}) {
    for (const double y : {0.0, lens.cy, lens.height - 1.0}) {
      const Eigen::Vector2f pixel = lens.Undistort({x, y}).cast<float>();
      border.emplace_back(pixel.x(), pixel.y());
    }
  }
  const cv::Rect2f shown = cv::boundingRect(border);
  ThrowIf<InputError>(std::max(shown.width, shown.height) * static_cast<float>(supersampling) > kMaxSide,
                      "'camera': the lens is too wide to be drawn; expected a larger fx or fewer pixels");
  Camera pinhole = lens.WithoutDistortion();
  pinhole.cx -= shown.x;
  pinhole.cy -= shown.y;
  pinhole.width = static_cast<int>(shown.width);
  pinhole.height = static_cast<int>(shown.height);
  return pinhole;
}

// Returns where the pinhole camera shows each pixel of the lens (32FC2), both pictures drawn larger.
cv::Mat BendOf(const Camera& lens, const Camera& pinhole, double supersampling) {
  if (!lens.HasDistortion()) {
    return {};
  }
  const auto middle = [supersampling](int drawn) { return (drawn + 0.5) / supersampling - 0.5; };
  cv::Mat bend(cv::Size(lens.width, lens.height) * static_cast<int>(supersampling), CV_32FC2);
  cv::parallel_for_(cv::Range(0, bend.rows), [&](const cv::Range& rows) {
    for (int row = rows.start; row < rows.end; ++row) {
      for (int column = 0; column < bend.cols; ++column) {
        const Eigen::Vector3d ray = lens.Unproject(lens.Undistort({middle(column), middle(row)}));
        const Eigen::Vector2d pixel = supersampling * (pinhole.Project(ray).array() + 0.5) - 0.5;
        bend.at<cv::Vec2f>(row, column) = {static_cast<float>(pixel.x()), static_cast<float>(pixel.y())};
      }
    }
  });
  return bend;
}

}  // namespace

SceneRenderer::SceneRenderer(const SceneDescription& scene, int supersampling, RenderBackend backend)
    : camera_(scene.camera),
      pinhole_(PinholeOf(camera_, supersampling)),
      supersampling_(supersampling),
      bend_(BendOf(camera_, pinhole_, supersampling)),
      window_({.width = pinhole_.width * supersampling_,
               .height = pinhole_.height * supersampling_,
               .alpha = true,
               .backend = backend}) {
  window_.AddRenderer(renderer_);
  renderer_->SetBackgroundAlpha(1.0);
  const vtkNew<vtkCallbackCommand> no_blending;
  no_blending->SetCallback(DisableBlending);
  renderer_->AddObserver(vtkCommand::StartEvent, no_blending);
  const SceneLighting lighting(scene);
  const std::size_t panels = scene.panels.size();
  std::vector<std::vector<TexturedMesh>> meshes(panels + scene.bodies.size());
  cv::parallel_for_(cv::Range(0, static_cast<int>(meshes.size())), [&](const cv::Range& range) {
    for (auto i = static_cast<std::size_t>(range.start); i < static_cast<std::size_t>(range.end); ++i) {
      meshes[i] = i < panels ? std::vector{BuildPanel(scene.panels[i], lighting)}
                             : BuildBody(scene.bodies[i - panels], lighting);
    }
  });
  for (const std::vector<TexturedMesh>& group : meshes) {
    for (const TexturedMesh& mesh : group) {
      Add(mesh);
    }
  }
}

void SceneRenderer::Add(const TexturedMesh& mesh) {
  const auto data = PolyDataOf(mesh.vertices, mesh.triangles);
  data->GetPointData()->SetTCoords(TuplesOf<vtkFloatArray>(mesh.texture_coordinates));
  data->GetPointData()->SetScalars(TuplesOf<vtkUnsignedCharArray>(mesh.light));
  const vtkNew<vtkPolyDataMapper> mapper;
  mapper->SetInputData(data);
  const vtkNew<vtkActor> actor;
  actor->SetMapper(mapper);
  actor->SetTexture(MakeTexture(mesh.texture));
  actor->GetProperty()->LightingOff();
  actor->GetProperty()->BackfaceCullingOn();
  actor->GetProperty()->SetOpacity(1.0 - mesh.id / 255.0);  // to be read back: nothing is blended
  actor->ForceOpaqueOn();
  renderer_->AddActor(actor);
}

cv::Mat SceneRenderer::ThroughLens(const cv::Mat& drawn, int interpolation) const {
  if (bend_.empty()) {
    return drawn;
  }
  cv::Mat bent;
  cv::remap(drawn, bent, bend_, cv::noArray(), interpolation, cv::BORDER_REPLICATE);
  return bent;
}

SceneImage SceneRenderer::Render(const Rigid3d& T_world_camera) {
  SetPinholeCamera(pinhole_, T_world_camera, kNearPlane, kFarPlane, renderer_->GetActiveCamera());
  const cv::Mat drawn = window_.Render();
  cv::Mat color(drawn.size(), CV_8UC3);
  cv::Mat ids(drawn.size(), CV_8UC1);
  std::array<cv::Mat, 2> parts{color, ids};
  cv::mixChannels(&drawn, 1, parts.data(), parts.size(), std::array{0, 0, 1, 1, 2, 2, 3, 3}.data(), 4);
  ids = 255 - ids;
  color = ThroughLens(color, cv::INTER_LINEAR);
  if (supersampling_ > 1) {
    cv::resize(color, color, {camera_.width, camera_.height}, 0.0, 0.0, cv::INTER_AREA);
  }
  return {color, ThroughLens(ids, cv::INTER_NEAREST)};
}

namespace {

// Clips to the range of pixel centres, [0, width - 1] x [0, height - 1].
Box2d ClippedBox(double left, double top, double right, double bottom, const Camera& camera) {
  const Eigen::Array2d last(camera.width - 1.0, camera.height - 1.0);
  const Eigen::Array2d low = Eigen::Array2d(left, top).max(0.0).min(last);
  const Eigen::Array2d high = Eigen::Array2d(right, bottom).max(0.0).min(last);
  return {low.x(), low.y(), high.x() - low.x(), high.y() - low.y()};
}

// Returns the area of an object's whole silhouette in square pixels; 0 if a part of it is behind the camera.
// Superquadrics with exponents up to 2 are convex, so the silhouette is the convex hull of the projected
// surface; through a fisheye lens this is an approximation.
double SilhouetteArea(const PosedSuperquadric& superquadric, const Camera& camera,
                      const Rigid3d& T_world_camera) {
  const Rigid3d T_camera_object = T_world_camera.Inverse() * superquadric.T_map_object;
  std::vector<cv::Point2f> pixels;
  for (const Eigen::Vector3f& vertex : Tessellate(superquadric.shape).vertices) {
    const Eigen::Vector3d p_camera = T_camera_object * vertex.cast<double>();
    if (p_camera.z() < 0.01) {
      return 0.0;
    }
    const Eigen::Vector2d pixel = camera.ProjectDistorted(p_camera);
    pixels.emplace_back(static_cast<float>(pixel.x()), static_cast<float>(pixel.y()));
  }
  std::vector<cv::Point2f> hull;
  cv::convexHull(pixels, hull);
  return cv::contourArea(hull);
}

}  // namespace

std::vector<ExactBox> FindExactBoxes(const SceneDescription& scene, const Rigid3d& T_world_camera,
                                     const cv::Mat& ids, int supersampling) {
  constexpr double kMinVisible = 0.3;    // of the object
  constexpr double kMinOfImage = 0.001;  // visible area, relative to the image
  const double s = supersampling;
  std::vector<ExactBox> boxes;
  for (const SceneBody& body : scene.bodies) {
    if (body.id <= 0) {
      continue;
    }
    const cv::Mat mask = ids == body.id;
    const double visible = cv::countNonZero(mask) / (s * s);
    if (visible < kMinOfImage * scene.camera.width * scene.camera.height) {
      continue;
    }
    const double whole = SilhouetteArea(body.superquadric, scene.camera, T_world_camera);
    const double fraction = whole > 0.0 ? std::min(1.0, visible / whole) : 0.0;
    if (fraction < kMinVisible) {
      continue;
    }
    const cv::Rect seen = cv::boundingRect(mask);
    const Box2d box = ClippedBox(seen.x / s - 0.5, seen.y / s - 0.5, seen.br().x / s - 0.5,
                                 seen.br().y / s - 0.5, scene.camera);
    boxes.push_back({{body.label, 1.0, box}, body.id, fraction});
  }
  return boxes;
}

DetectorNoise::DetectorNoise(std::uint64_t seed, std::vector<std::string> labels)
    : random_(seed + 1), labels_(std::move(labels)) {}

std::vector<Detection> DetectorNoise::Apply(const std::vector<ExactBox>& boxes, const Camera& camera) {
  constexpr double kEdgeError = 0.03;
  constexpr double kMissed = 0.1;
  constexpr double kWrongLabel = 0.03;
  std::vector<Detection> detections;
  for (const ExactBox& exact : boxes) {
    // All random numbers are drawn for every box, so that one decision does not affect the next.
    const Box2d& box = exact.detection.box;
    const double left = box.x + random_.gaussian(kEdgeError * box.width);
    const double right = box.x + box.width + random_.gaussian(kEdgeError * box.width);
    const double top = box.y + random_.gaussian(kEdgeError * box.height);
    const double bottom = box.y + box.height + random_.gaussian(kEdgeError * box.height);
    const double score = random_.uniform(0.4, 0.95);
    const bool wrong = random_.uniform(0.0, 1.0) < kWrongLabel;
    const auto other = static_cast<std::size_t>(random_.uniform(0, static_cast<int>(labels_.size())));
    if (random_.uniform(0.0, 1.0) < kMissed) {
      continue;
    }
    detections.push_back(
        {wrong ? labels_[other] : exact.detection.label, score,
         ClippedBox(left, top, std::max(left + 1.0, right), std::max(top + 1.0, bottom), camera)});
  }
  return detections;
}

}  // namespace sqslam
