#pragma once

#include <vtkActor.h>
#include <vtkPlaneCollection.h>
#include <vtkSmartPointer.h>

#include <cstdint>

#include "render/surface/surface_mesh.h"

namespace sqslam {

// Makes an actor for a mesh with colours from photographs, which already contain the room's light: a lamp
// over the viewer's shoulder adds just enough shading to distinguish surfaces. Back faces are culled, such as
// a wall between the viewer and the room. For the sources of render/ only.
vtkSmartPointer<vtkActor> MakeMeshActor(const SurfaceMesh& mesh, vtkPlaneCollection* clip);

// Shows only the triangles of that mesh whose corners have all been seen by this frame.
void ShowUntil(std::int64_t frame, const SurfaceMesh& mesh, vtkActor& actor);

}  // namespace sqslam
