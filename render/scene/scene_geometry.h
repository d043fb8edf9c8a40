#pragma once

#include <vtkPolyData.h>
#include <vtkSmartPointer.h>
#include <vtkTexture.h>

#include <Eigen/Core>
#include <span>
#include <vector>

#include "render/camera/scene_framing.h"
#include "render/gl/point_splats.h"
#include "render/scene/object_look.h"
#include "render/scene/style.h"
#include "render/solids/ground_shadow.h"
#include "slam/snapshot/snapshot.h"

// Geometry of a map for VTK, with one RGBA colour per vertex. For the sources of render/ only.
namespace sqslam {

// Returns the map's points, with colours that contrast with the background. `scale`: samples per style pixel.
std::vector<PointSplats::Vertex> MapPoints(const MapSnapshot& map, const SceneStyle& style, double scale);

// Returns a line through the keyframes to the current camera, coloured by their errors unless `truth` is
// null.
vtkSmartPointer<vtkPolyData> TrajectoryLine(const MapSnapshot& map, const MapTruth* truth,
                                            const SceneStyle& style);

// Returns cross-sections and rims of the uncertain objects, in faint colours.
vtkSmartPointer<vtkPolyData> UncertainOutlines(const MapSnapshot& map, const ObjectColor& color_of,
                                               const SceneStyle& style);

// Returns dashed cross-sections and rims of true objects.
vtkSmartPointer<vtkPolyData> TrueOutlines(const std::vector<PosedSuperquadric>& solids,
                                          const SceneStyle& style);

// Returns the frusta of the keyframes, without those close to the last one drawn.
vtkSmartPointer<vtkPolyData> KeyframeFrusta(const MapSnapshot& map, double height, const SceneStyle& style);

// Returns the current camera's frustum (empty while tracking is lost).
vtkSmartPointer<vtkPolyData> CurrentFrustum(const MapSnapshot& map, double height, const SceneStyle& style);

// Returns lines between keyframes that share enough map points.
vtkSmartPointer<vtkPolyData> CovisibilityLines(const MapSnapshot& map, const SceneStyle& style);

// Returns a line through each piece.
vtkSmartPointer<vtkPolyData> PathLines(const std::vector<std::vector<Eigen::Vector3d>>& pieces,
                                       const Eigen::Vector3d& color);

// Returns a ground grid around the centre of the focus that fades outwards; cells of GridCell().
vtkSmartPointer<vtkPolyData> GroundGrid(const SceneFocus& focus, const SceneStyle& style);

// Return the quad of a shadow, and the texture that darkens the ground there by at most `strength`. A dark
// background cannot be darkened: there the texture is a faintly lit floor outside the shadow.
vtkSmartPointer<vtkPolyData> ShadowQuad(const GroundShadow& shadow);
vtkSmartPointer<vtkTexture> ShadowTexture(const GroundShadow& shadow, double strength,
                                          const Eigen::Vector3d& background);

}  // namespace sqslam
