#pragma once

#include <optional>
#include <vector>

#include "app/viewer/state/camera_control.h"
#include "render/scene/clip_plane.h"
#include "render/scene/scene_layers.h"
#include "slam/snapshot/snapshot.h"

// Finds what of a map lies under the mouse.
namespace sqslam::viewer {

// Distance along the ray (map units) at which it enters the solid; empty where it passes by. 0 from inside.
std::optional<double> Meet(const Ray& ray, const PosedSuperquadric& solid);

// The same for a solid that is cut: its near side, or its inside where that is cut away.
std::optional<double> MeetCut(const Ray& ray, const PosedSuperquadric& solid,
                              const std::optional<ClipPlane>& cut);

// Id of the nearest object that the ray meets.
std::optional<int> PickObject(const Ray& ray, const std::vector<SnapshotObject>& objects,
                              const std::optional<ClipPlane>& cut = {});

// A point to measure from: on the surface of the nearest object, or the map point that is seen within
// `reach` pixels of the mouse and is the nearest to the eye there, or one of the dense cloud that is drawn.
// Nothing that is cut away.
std::optional<Eigen::Vector3d> PickPoint(const ViewCamera& camera, const Eigen::Vector2d& pixel,
                                         cv::Size window, const MapSnapshot& map,
                                         const std::optional<ClipPlane>& cut = {},
                                         const ColoredPoints* cloud = nullptr, double reach = 6.0);

}  // namespace sqslam::viewer
