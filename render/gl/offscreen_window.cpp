#include "render/gl/offscreen_window.h"

#include <vtkCallbackCommand.h>
#include <vtkCamera.h>
#include <vtkMatrix4x4.h>
#include <vtkNew.h>
#include <vtkOpenGLFramebufferObject.h>
#include <vtkRenderer.h>
#include <vtkTextureObject.h>

#include <opencv2/imgproc.hpp>

namespace sqslam {
namespace {

// Answers VTK's question whether the context is current, which only the context's owner can know.
void ConfirmCurrent(vtkObject*, unsigned long, void*, void* call_data) {
  *static_cast<bool*>(call_data) = true;
}

}  // namespace

OffscreenWindow::OffscreenWindow(const Options& options) : context_(options.backend), alpha_(options.alpha) {
  vtkNew<vtkCallbackCommand> confirm_current;
  confirm_current->SetCallback(ConfirmCurrent);
  window_->AddObserver(vtkCommand::WindowIsCurrentEvent, confirm_current);
  window_->SetOffScreenRendering(1);
  window_->SetFrameBlitModeToNoBlit();
  window_->SetSize(options.width, options.height);
  window_->SetMultiSamples(0);
  window_->SetAlphaBitPlanes(alpha_ ? 1 : 0);
  window_->SetReadyForRendering(true);
  window_->InitializeFromCurrentContext();
}

OffscreenWindow::~OffscreenWindow() {
  context_.MakeCurrent();
  window_->Finalize();
}

unsigned OffscreenWindow::Draw() {
  context_.MakeCurrent();
  window_->Render();
  return window_->GetDisplayFramebuffer()->GetColorAttachmentAsTextureObject(0)->GetHandle();
}

cv::Mat OffscreenWindow::Render() {
  context_.MakeCurrent();
  window_->Render();
  const int width = window_->GetSize()[0];
  const int height = window_->GetSize()[1];
  window_->GetRGBACharPixelData(0, 0, width - 1, height - 1, 0, pixels_, 0);  // as it is stored
  const cv::Mat raw(height, width, CV_8UC4, pixels_->GetPointer(0));
  cv::Mat image;
  cv::cvtColor(raw, image, alpha_ ? cv::COLOR_RGBA2BGRA : cv::COLOR_RGBA2BGR);
  cv::flip(image, image, 0);
  return image;
}

void SetPinholeCamera(const Camera& camera, const Rigid3d& T_map_camera, double near_plane, double far_plane,
                      vtkCamera* vtk_camera) {
  const Eigen::Vector3d position = T_map_camera.translation;
  const Eigen::Vector3d focal = T_map_camera * Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d up = T_map_camera.rotation * -Eigen::Vector3d::UnitY();
  vtk_camera->SetPosition(position.x(), position.y(), position.z());
  vtk_camera->SetFocalPoint(focal.x(), focal.y(), focal.z());
  vtk_camera->SetViewUp(up.x(), up.y(), up.z());
  vtk_camera->SetClippingRange(near_plane, far_plane);

  // Normalised device coordinates of pixel (u, v): x = 2 (u + 0.5) / width - 1, y = 1 - 2 (v + 0.5) / height,
  // with OpenGL's camera looking along -z and y up.
  vtkNew<vtkMatrix4x4> projection;
  projection->Zero();
  projection->SetElement(0, 0, 2.0 * camera.fx / camera.width);
  projection->SetElement(0, 2, 1.0 - 2.0 * (camera.cx + 0.5) / camera.width);
  projection->SetElement(1, 1, 2.0 * camera.fy / camera.height);
  projection->SetElement(1, 2, 2.0 * (camera.cy + 0.5) / camera.height - 1.0);
  projection->SetElement(2, 2, -(far_plane + near_plane) / (far_plane - near_plane));
  projection->SetElement(2, 3, -2.0 * far_plane * near_plane / (far_plane - near_plane));
  projection->SetElement(3, 2, -1.0);
  vtk_camera->SetExplicitProjectionTransformMatrix(projection);
  vtk_camera->UseExplicitProjectionTransformMatrixOn();
}

}  // namespace sqslam
