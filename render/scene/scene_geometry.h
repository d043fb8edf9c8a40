#pragma once

#include <vtkPolyData.h>
#include <vtkSmartPointer.h>
#include <vtkTexture.h>

#include <Eigen/Core>
#include <span>
#include <vector>

#include "render/camera/scene_framing.h"
#include "render/gl/point_splats.h"
#include "render/scene/style.h"
#include "render/solids/ground_shadow.h"
#include "slam/snapshot/snapshot.h"

// Geometry of a map for VTK, colours as one RGBA value a vertex. For the sources of render/ only.
namespace sqslam {

// The map's points; colours kept apart from the background. `scale`: samples for a pixel of the style.
std::vector<PointSplats::Vertex> MapPoints(const MapSnapshot& map, const SceneStyle& style, double scale);

// A line through the keyframes, on to the current camera.
vtkSmartPointer<vtkPolyData> TrajectoryLine(const MapSnapshot& map, const SceneStyle& style);

// Sections and rims of the objects that are not reliable, in faint colours.
vtkSmartPointer<vtkPolyData> UncertainOutlines(const MapSnapshot& map, const LabelColors& colors,
                                               const SceneStyle& style);

// Frusta of the keyframes, thinned out where they crowd.
vtkSmartPointer<vtkPolyData> KeyframeFrusta(const MapSnapshot& map, double height, const SceneStyle& style);

// The current camera's frustum as lines (empty while tracking is lost).
vtkSmartPointer<vtkPolyData> CurrentFrustum(const MapSnapshot& map, double height, const SceneStyle& style);

// Lines between the centres of keyframes that share enough map points.
vtkSmartPointer<vtkPolyData> CovisibilityLines(const MapSnapshot& map, const SceneStyle& style);

// A line through each piece.
vtkSmartPointer<vtkPolyData> PathLines(const std::vector<std::vector<Eigen::Vector3d>>& pieces,
                                       const Eigen::Vector3d& color);

// A grid at the ground around the centre of the focus that fades outwards; cells of GridCell().
vtkSmartPointer<vtkPolyData> GroundGrid(const SceneFocus& focus, const SceneStyle& style);

// The place of a shadow, and the texture that darkens the ground there by at most `strength`. On a dark
// background, where nothing can be darker, it is a floor in faint light instead that the shadow leaves out.
vtkSmartPointer<vtkPolyData> ShadowQuad(const GroundShadow& shadow);
vtkSmartPointer<vtkTexture> ShadowTexture(const GroundShadow& shadow, double strength,
                                          const Eigen::Vector3d& background);

}  // namespace sqslam
