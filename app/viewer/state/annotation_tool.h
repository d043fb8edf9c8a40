#pragma once

#include <Eigen/Core>
#include <optional>

#include "app/viewer/state/editing.h"

// Drawing a ground truth on a map: what the panel's buttons and the mouse in the scene do. Pixels are those
// of the scene, from its top-left corner. Errors become messages.
namespace sqslam::viewer {

// Points and ground of the map that is open, once for each; what is chosen belongs to them.
void PrepareAnnotation(const EditContext& context);

const AnnotatedSolid* SelectedSolid(const EditContext& context);  // null where there is none

// A new solid in the middle of the view, on the ground, selected. With chosen points it is fitted to them.
void AddSolid(const EditContext& context, SolidKind kind);
void RemoveSolid(const EditContext& context);  // the selected one
void ChangeSolid(const EditContext& context,
                 const AnnotatedSolid& solid);  // numbers that are typed or dragged
void StandOnGround(const EditContext& context);
// Fits the selected solid to the points in it and a little around it, or to the chosen ones.
void FitSolid(const EditContext& context);
// A solid in place of an object of the map.
void AddSolidOf(const EditContext& context, const SnapshotObject& object);

void FinishLasso(const EditContext& context, SelectMode mode);

// The handle of the selected solid within `reach` pixels of the mouse, or the solid that it is at.
std::optional<SolidHandle> HandleAt(const EditContext& context, const Eigen::Vector2d& pixel, double reach);
std::optional<int> SolidAt(const EditContext& context, const Eigen::Vector2d& pixel);

void BeginDrag(const EditContext& context, const SolidHandle& handle, const Eigen::Vector2d& pixel);
void DragTo(const EditContext& context, const Eigen::Vector2d& pixel);
void EndDrag(const EditContext& context);

// Files in the frame that the tool says.
void OpenAnnotationFile(const EditContext& context);
void SaveAnnotationFile(const EditContext& context);
void OpenCloudFile(const EditContext& context);  // an empty name: the map's points

// Finds the way from map to world by the true camera poses of the sequence, once; false where there is none.
bool AlignWithWorld(const EditContext& context);

}  // namespace sqslam::viewer
