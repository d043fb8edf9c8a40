#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "app/viewer/model/annotation.h"
#include "render/camera/camera_path.h"
#include "render/camera/scene_framing.h"
#include "render/scene/clip_plane.h"
#include "render/scene/style.h"
#include "slam/geometry/camera.h"
#include "slam/snapshot/snapshot.h"

namespace sqslam::viewer {

// Motion of the camera.
enum class CameraMode {
  kFree,         // moved by the user
  kFollow,       // behind the input camera
  kFirstPerson,  // through the input camera
};

// Key frames of a camera path set by hand.
struct CameraKeys {
  struct Key {
    double time = 0.0;  // seconds of the video
    ViewCamera camera;
  };
  std::vector<Key> keys;
  double interval = 2.0;  // seconds from one key to the next
  bool loop = false;

  void Add(const ViewCamera& camera);
  void Remove(std::size_t index);  // shifts later keys to close the gap

  // Returns the path in the format of `sqslam render --camera-path`.
  std::string Yaml() const;
};

// The view of the map: camera, section, style, and its place in the window.
struct SceneView {
  ViewCamera camera;
  CameraMode mode = CameraMode::kFree;
  bool automatic = true;  // the camera frames the map until the user moves it
  std::string preset;     // name of the view (render/camera/scene_framing.h) while the camera is in it
  CameraKeys keys;

  std::string style_name;             // a style of configs/styles, or a file
  std::vector<std::string> settings;  // --set: values that override those of any style
  SceneStyle style;                   // all but `clip`
  LabelColors colors;                 // of classes, as the style has them
  SceneStyle::Clip clip;              // the section; cheap to move

  SceneFocus focus;  // of the map that the document frames
  cv::Size size;     // of the scene on the screen, pixels
  cv::Point corner;  // its top-left corner in the window

  // Places the camera as the user does: it no longer follows the map.
  void MoveTo(const ViewCamera& place);

  // Named() returns the named view of the present map, or the default one for an empty name. LookFrom() moves
  // the camera there; it follows a growing map until the user moves it.
  ViewCamera Named(const std::string& name) const;
  void LookFrom(const std::string& name);

  // Loads a style by name and applies the settings; layers and section stay. Throws UsageError.
  void UseStyle(const std::string& name);
  SceneStyle StyleWithClip() const;

  // Returns the plane that clips the scene; empty: none.
  std::optional<ClipPlane> Cut() const { return MakeClipPlane(clip, focus, camera); }
  // Switches clipping of the part nearer to the camera on or off.
  void SwitchCut() { clip.axis = clip.axis == ClipAxis::kNone ? ClipAxis::kView : ClipAxis::kNone; }
};

// Returns the view through the input camera, with its whole image in the middle of the window, as
// PlaceImage() has it; `depth`: of the focal point.
ViewCamera LookThrough(const Rigid3d& T_map_camera, const Camera& camera, cv::Size window, double depth);

// Returns the distance along the ray (map units) at which it meets the solid, or its inside if the near side
// is clipped; 0 from inside, empty if it misses.
std::optional<double> HitDistance(const Ray& ray, const PosedSuperquadric& solid,
                                  const std::optional<ClipPlane>& cut = {});

// Returns the id of the nearest object that the ray meets.
std::optional<int> PickObject(const Ray& ray, const std::vector<SnapshotObject>& objects,
                              const std::optional<ClipPlane>& cut = {});

// Returns a point to measure from, the nearest to the eye among the object surface under the mouse and the
// map and cloud points that project within `reach` pixels of it. Skips clipped parts.
std::optional<Eigen::Vector3d> PickPoint(const ViewCamera& camera, const Eigen::Vector2d& pixel,
                                         cv::Size window, const MapSnapshot& map,
                                         const std::optional<ClipPlane>& cut = {},
                                         const CloudLayer* cloud = nullptr, double reach = 6.0);

}  // namespace sqslam::viewer
