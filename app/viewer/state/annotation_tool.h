#pragma once

#include <Eigen/Core>
#include <optional>

#include "app/viewer/state/viewer_state.h"

// Drawing a ground truth on a map: what the panel's buttons and the mouse in the scene do. Pixels are those
// of the scene, from its top-left corner. Nothing here throws: what goes wrong is said in the window.
namespace sqslam::viewer {

// Points and ground of the map that is open, once for each; what is chosen belongs to them.
void PrepareAnnotation(ViewerState& state);

const AnnotatedSolid* SelectedSolid(const ViewerState& state);  // null where there is none

// A new solid in the middle of the view, on the ground, selected. With chosen points it is fitted to them.
void AddSolid(ViewerState& state, SolidKind kind);
void RemoveSolid(ViewerState& state);                               // the selected one
void ChangeSolid(ViewerState& state, const AnnotatedSolid& solid);  // numbers that are typed or dragged
void StandOnGround(ViewerState& state);
// Fits the selected solid to the points in it and a little around it, or to the chosen ones.
void FitSolid(ViewerState& state);
// A solid in place of an object of the map.
void AddSolidOf(ViewerState& state, const SnapshotObject& object);

void FinishLasso(ViewerState& state, SelectMode mode);

// The handle of the selected solid, or the solid, that the mouse is at.
std::optional<SolidHandle> HandleAt(const ViewerState& state, const Eigen::Vector2d& pixel);
std::optional<int> SolidAt(const ViewerState& state, const Eigen::Vector2d& pixel);

void BeginDrag(ViewerState& state, const SolidHandle& handle, const Eigen::Vector2d& pixel);
void DragTo(ViewerState& state, const Eigen::Vector2d& pixel);
void EndDrag(ViewerState& state);

// Files in the frame that the tool says.
void OpenAnnotationFile(ViewerState& state);
void SaveAnnotationFile(ViewerState& state);
void OpenCloudFile(ViewerState& state);  // an empty name: the map's points

// Whether the sequence of the map has true camera poses that lead from map to world; finds out once.
bool AlignWithWorld(ViewerState& state);

}  // namespace sqslam::viewer
