#pragma once

#include <vtkActor.h>
#include <vtkPlaneCollection.h>
#include <vtkSmartPointer.h>

#include <cstdint>

#include "render/surface/surface_mesh.h"

namespace sqslam {

// Actor of a mesh whose colours come from photographs. They hold the room's light already: a lamp over the
// viewer's shoulder adds as much as sides need to be told apart. What is seen from behind is left out, such
// as a wall between the viewer and the room. For the sources of render/ only.
vtkSmartPointer<vtkActor> MakeMeshActor(const SurfaceMesh& mesh, vtkPlaneCollection* clip);

// Leaves of that mesh the triangles whose corners are all seen until this frame.
void ShowUntil(std::int64_t frame, const SurfaceMesh& mesh, vtkActor& actor);

}  // namespace sqslam
