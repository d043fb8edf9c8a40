#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <string>

#include "render/camera/camera_path.h"
#include "render/camera/scene_framing.h"
#include "render/gl/offscreen_context.h"
#include "render/scene/style.h"
#include "slam/snapshot/snapshot.h"

namespace sqslam {

// Overrides of the automatic view; names and meaning follow f3d.
struct CameraOverrides {
  std::string view{};                            // preset (ViewPresetNames); empty: the automatic view
  std::optional<Eigen::Vector3d> position{};     // map frame
  std::optional<Eigen::Vector3d> focal_point{};  // map frame
  std::optional<Eigen::Vector3d> view_up{};
  std::optional<double> view_angle{};  // vertical, degrees
  double azimuth = 0.0;                // turns the camera around the focal point, degrees
  double elevation = 0.0;              // raises it, degrees
  double zoom = 1.0;                   // > 1 moves it nearer
  Projection projection = Projection::kPerspective;

  // Overrides `camera`: first the vectors and the view angle, then the rotations and the zoom.
  ViewCamera ApplyTo(ViewCamera camera) const;
};

// Throws UsageError that names the value if one is not finite or out of range, or if `view_up` is zero.
void CheckCamera(const CameraOverrides& camera);

inline constexpr int kMaxPictureSide = 8192;  // pixels

struct PictureOptions {
  int width = 1280;          // pixels
  int height = 720;          // pixels
  bool transparent = false;  // no background: 8UC4 instead of 8UC3
  RenderBackend backend = RenderBackend::kAuto;
  CameraOverrides camera;
  SceneStyle style;
  SceneLayers layers;  // drawn with every map, in the frame of SetMap's map
};

// Adds the dense cloud or mesh of the layers to the framed outline (IncludeCloud).
void IncludeLayers(const SceneLayers& layers, SceneFocus& focus);

// Draws pictures of maps in one off-screen context, for many frames or many views of one map. To be used on
// the thread that created it. The same map, options and back end give the same bytes.
class PictureRenderer {
 public:
  // Throws UsageError on sizes, cameras and styles out of range, std::runtime_error without OpenGL.
  explicit PictureRenderer(const PictureOptions& options);
  ~PictureRenderer();
  PictureRenderer(PictureRenderer&&) noexcept;

  // Shows a map and takes the framing from it.
  void SetMap(const MapSnapshot& map);

  // Shows a map with the framing of the last SetMap, for the frames of a video.
  void SetMapKeepingFrame(const MapSnapshot& map);

  // Returns the automatic view of SetMap's map with the overrides of the options.
  ViewCamera DefaultCamera() const;
  // The same with other overrides. Views that are only rotated are framed again. `beside_captions`: keeps the
  // framed outline clear of legend and axes; otherwise it is centred in the picture, as orbiting views need.
  ViewCamera ViewOf(const CameraOverrides& overrides, bool beside_captions = true) const;

  // Replaces the layers drawn with every map.
  void SetLayers(const SceneLayers& layers);

  // The focus of SetMap's map.
  const SceneFocus& Focus() const;
  const LabelColors& Colors() const;

  // Returns 8UC3 (BGR), or 8UC4 (BGRA, straight alpha) if the options ask for no background.
  cv::Mat Render(const ViewCamera& camera);
  cv::Mat Render() { return Render(DefaultCamera()); }

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

cv::Mat RenderPicture(const MapSnapshot& map, const PictureOptions& options);

// Writes a PNG of 300 pixels per inch. Throws InputError if the file cannot be written.
void WritePicture(const std::filesystem::path& path, const cv::Mat& picture);

// Returns the difference of two pictures: 1 - SSIM (Wang, Bovik, Sheikh and Simoncelli, "Image quality
// assessment: from error visibility to structural similarity", 2004), averaged over channels and pixels. A
// pixel's weight is the contrast to the background in its SSIM window in either picture: in a plain mean, the
// empty background and the faint grid would outweigh a missing object. The background is the reference's most
// frequent colour. 0 for equal pictures, 1 if size or type differ.
double PictureDifference(const cv::Mat& picture, const cv::Mat& reference);

}  // namespace sqslam
