#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "app/viewer/model/annotation.h"
#include "render/camera/camera_control.h"
#include "render/camera/scene_framing.h"
#include "render/scene/clip_plane.h"
#include "render/scene/style.h"
#include "slam/geometry/camera.h"
#include "slam/snapshot/snapshot.h"

namespace sqslam::viewer {

// The ways in which the camera moves by itself.
enum class CameraMode {
  kFree,         // as the user puts it
  kFollow,       // behind the input camera
  kFirstPerson,  // through the input camera
};

// Key frames of a camera path that were set by hand.
struct CameraKeys {
  struct Key {
    double time = 0.0;  // seconds of the video
    ViewCamera camera;
  };
  std::vector<Key> keys;
  double interval = 2.0;  // seconds from one key to the next
  bool loop = false;

  void Add(const ViewCamera& camera);
  void Remove(std::size_t index);  // those after it move up

  // As `sqslam render --camera-path` reads it.
  std::string Yaml() const;
};

// The view of the map: camera, section, style, and its place in the window.
struct SceneView {
  ViewCamera camera;
  CameraMode mode = CameraMode::kFree;
  bool automatic = true;  // the camera frames the map by itself until somebody moves it
  std::string preset;  // name of the view (render/camera/scene_framing.h) that the camera still is, or empty
  CameraKeys keys;

  std::string style_name;  // of configs/styles
  SceneStyle style;        // all but its section
  SceneStyle::Clip clip;   // the section, which costs nothing to move

  SceneFocus focus;  // of the document's frame
  cv::Size size;     // of the scene on the screen, pixels
  cv::Point corner;  // its top-left corner in the window

  // Puts the camera there by hand.
  void MoveTo(const ViewCamera& place);

  // The named view of the present map, or the automatic one for an empty name; and the camera there, which
  // follows a growing map until somebody moves it.
  ViewCamera Named(const std::string& name) const;
  void LookFrom(const std::string& name);

  // Loads a style by its name; layers and section stay. Throws UsageError.
  void UseStyle(const std::string& name);
  SceneStyle StyleWithClip() const;

  // The plane that cuts the scene on the screen; empty: none.
  std::optional<ClipPlane> Cut() const { return MakeClipPlane(clip, focus, camera); }
  // Cuts the scene towards the camera, or no longer.
  void SwitchCut() { clip.axis = clip.axis == ClipAxis::kNone ? ClipAxis::kView : ClipAxis::kNone; }
};

// Looks through the input camera so that its whole image is in the window; `depth`: of the focal point.
ViewCamera LookThrough(const Rigid3d& T_map_camera, const Camera& camera, cv::Size window, double depth);

// The place of that camera's image, without distortion, in the window: pixels.
cv::Rect2d PhotoArea(const Camera& camera, const ViewCamera& view, cv::Size window);

// Picking: what of a map lies under the mouse. Returns the distance along the ray (map units) at which it
// meets the solid, or its inside where the near side is cut away; 0 from inside, empty where it passes by.
std::optional<double> Meet(const Ray& ray, const PosedSuperquadric& solid,
                           const std::optional<ClipPlane>& cut = {});

// Id of the nearest object that the ray meets.
std::optional<int> PickObject(const Ray& ray, const std::vector<SnapshotObject>& objects,
                              const std::optional<ClipPlane>& cut = {});

// A point to measure from: on the surface of the nearest object, or the map point that is seen within
// `reach` pixels of the mouse and is the nearest to the eye there, or one of the dense cloud that is drawn.
// Nothing that is cut away.
std::optional<Eigen::Vector3d> PickPoint(const ViewCamera& camera, const Eigen::Vector2d& pixel,
                                         cv::Size window, const MapSnapshot& map,
                                         const std::optional<ClipPlane>& cut = {},
                                         const CloudLayer* cloud = nullptr, double reach = 6.0);

}  // namespace sqslam::viewer
