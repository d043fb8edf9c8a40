#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <map>
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

// Overrides of the automatic view; names and meaning as in f3d.
struct CameraOverrides {
  std::string view;  // one of render/camera/view_presets.h instead of the automatic view; empty: that
  std::optional<Eigen::Vector3d> position;     // map frame
  std::optional<Eigen::Vector3d> focal_point;  // map frame
  std::optional<Eigen::Vector3d> view_up;
  std::optional<double> view_angle;  // vertical, degrees
  double azimuth = 0.0;              // turns the camera around the focal point, degrees
  double elevation = 0.0;            // raises it, degrees
  double zoom = 1.0;                 // > 1 moves it nearer

  // Overrides `camera`, first the vectors, then the turns.
  ViewCamera ApplyTo(ViewCamera camera) const;
};

inline constexpr int kMaxPictureSide = 8192;  // pixels

struct PictureOptions {
  int width = 1280;          // pixels
  int height = 720;          // pixels
  bool transparent = false;  // no background: 8UC4 instead of 8UC3
  RenderBackend backend = RenderBackend::kAuto;
  CameraOverrides camera;
  SceneStyle style;
  std::map<std::string, Eigen::Vector3d>
      label_colors;    // fixed colours of labels (red, green, blue in [0, 1])
  SceneLayers layers;  // drawn with every map, in the frame of the one that is framed
};

// Takes the dense cloud or mesh of the layers into the outline of what is framed (IncludeCloud).
void IncludeLayers(const SceneLayers& layers, SceneFocus& focus);

// Draws pictures of maps on one off-screen context: for many frames, or many views of one map. Belongs to the
// thread that made it. The same map, options and back end give the same bytes.
class PictureRenderer {
 public:
  // Throws UsageError on sizes and styles that make no sense, std::runtime_error without OpenGL.
  explicit PictureRenderer(const PictureOptions& options);
  ~PictureRenderer();
  PictureRenderer(PictureRenderer&&) noexcept;

  // Shows a map, framed by itself, and keeps the classes' colours from this map on.
  void SetMap(const MapSnapshot& map);

  // Shows a map with the framing and the colours of an earlier SetMap: for the frames of a video.
  void SetMapKeepingFrame(const MapSnapshot& map);

  // The automatic view of the map of SetMap, with the overrides of the options.
  ViewCamera DefaultCamera() const;
  // The same with other overrides. A view that they only turn is framed anew. `beside_captions`: what is
  // framed keeps clear of legend and axes; otherwise it has the middle of the picture, as views that go round
  // it need.
  ViewCamera ViewOf(const CameraOverrides& overrides, bool beside_captions = true) const;

  // Draws these with every map from now on.
  void SetLayers(const SceneLayers& layers);

  // The focus of that map.
  const SceneFocus& Focus() const;
  const LabelColors& Colors() const;

  // 8UC3 (BGR), or 8UC4 (BGRA, straight alpha) where the options ask for no background.
  cv::Mat Render(const ViewCamera& camera);
  cv::Mat Render() { return Render(DefaultCamera()); }

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// One picture of one map.
cv::Mat RenderPicture(const MapSnapshot& map, const PictureOptions& options);

// As PNG. Throws InputError where the file cannot be written.
void WritePicture(const std::filesystem::path& path, const cv::Mat& picture);

}  // namespace sqslam
