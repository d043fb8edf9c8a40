#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/viewer/model/annotation_points.h"
#include "app/viewer/model/edited_document.h"
#include "app/viewer/model/map_objects.h"
#include "app/viewer/state/document.h"
#include "app/viewer/state/scene_view.h"

namespace sqslam::viewer {

// Values that colour the points of the selected object.
enum class PointColors { kNone, kResidual, kAnomaly };

// State of the tool to annotate a ground truth (annotation_tool.cpp), in the frame of the finished map.
struct AnnotationTool {
  bool active = false;  // its panel is in front: it takes the mouse in the scene
  bool drawn = false;   // its panel was drawn in this frame
  std::optional<int> selected;
  std::string label = "object";  // for new solids
  bool standing = true;          // fits extend down to the ground
  bool round = true;             // cylinders get a circular cross-section
  bool in_world = false;         // the file is in the world frame of the sequence's ground truth
  std::optional<Sim3d> S_world_map;
  std::string file;        // objects_gt.json
  std::string cloud_file;  // a dense cloud; empty: the map's points
  std::shared_ptr<const Points> cloud;
  std::optional<double> ground;  // z of the support plane, map frame
  MapSnapshotPtr prepared_for;   // the map that cloud and ground belong to

  bool lasso = false;                    // a drag draws a lasso
  std::vector<Eigen::Vector2d> outline;  // of the lasso being drawn, pixels of the scene
  std::vector<int> chosen;               // indices of points of the cloud

  std::optional<SolidHandle> hovered;
  struct Drag {
    SolidHandle handle;
    AnnotatedSolid start;
    Ray from;
  };
  std::optional<Drag> drag;
};

// Edits and kind of solids that are applied to recorded maps.
struct AppliedEdits {
  ObjectEdits edits;
  SolidKind representation = SolidKind::kSuperquadric;

  bool operator==(const AppliedEdits&) const = default;
  bool Empty() const { return edits.Empty() && representation == SolidKind::kSuperquadric; }
  MapSnapshotPtr ApplyTo(const MapSnapshotPtr& map) const;
};

// The user's changes to a map, and the tools for them.
struct Editing {
  EditedDocument document;
  SolidKind representation = SolidKind::kSuperquadric;
  AppliedEdits applied;  // to the map on the screen
  PointColors point_colors = PointColors::kNone;
  AnnotationTool annotation;
  std::optional<Request> postponed;  // until unsaved changes are saved or discarded
  bool discard = false;              // unsaved changes may be discarded

  const ObjectEdits& Edits() const { return document.Current().edits; }
  const Annotation& Solids() const { return document.Current().annotation; }

  // Returns true and asks the user first if unsaved changes are in the way of quitting or opening.
  bool Postpone(const Request& request);
};

// The parts of the viewer that editing works on, with the actions of buttons, menus, keys and mouse. Errors
// become messages.
struct EditContext {
  const Document& document;
  const SceneView& view;
  Selection& selection;
  Editing& editing;
  Messages& messages;
  AnnotationTool& tool = editing.annotation;

  void RenameObject(int id, const std::string& name) const;
  void RelabelObject(int id, const std::string& label) const;
  void HideObject(int id, bool hidden) const;
  void DeleteObject(int id) const;
  void MergeObjects(int kept, int absorbed) const;
  void SeparateObject(int absorbed) const;

  // Handles the Delete key: removes the selected solid while annotating, else the selected object.
  void DeleteSelected() const;

  // Saves modified edits and a modified annotation.
  void SaveAll() const;

  // Annotating a ground truth on a map, for the panel's buttons and the mouse in the scene. Pixels are
  // relative to the top-left corner of the scene.

  // Computes points and ground of the open map, once per map; the chosen points belong to them.
  void PrepareAnnotation() const;

  const AnnotatedSolid* SelectedSolid() const;  // null if there is none

  // Adds and selects a solid, fitted to the chosen points or, without any, on the ground in mid-view.
  void AddSolid(SolidKind kind) const;
  void RemoveSolid() const;                             // the selected one
  void ChangeSolid(const AnnotatedSolid& solid) const;  // typed or dragged numbers
  void StandOnGround() const;
  // Fits the selected solid to the chosen points or, without any, to those in and close around it.
  void FitSolid() const;
  // Adds a solid with the shape of an object of the map.
  void AddSolidOf(const SnapshotObject& object) const;

  void FinishLasso(SelectMode mode) const;

  // Return the handle of the selected solid within `reach` pixels of the mouse, and the nearest solid under
  // it.
  std::optional<SolidHandle> HandleAt(const Eigen::Vector2d& pixel, double reach) const;
  std::optional<int> SolidAt(const Eigen::Vector2d& pixel) const;

  void BeginDrag(const SolidHandle& handle, const Eigen::Vector2d& pixel) const;
  void DragTo(const Eigen::Vector2d& pixel) const;
  void EndDrag() const;

  // Files are in the world frame if the tool says so, else in the map frame.
  void OpenAnnotationFile() const;
  void SaveAnnotationFile() const;
  void OpenCloudFile() const;  // no file name: the map's points

  // Computes S_world_map from the ground-truth camera poses of the sequence, once; false if that fails.
  bool AlignWithWorld() const;
};

// Applies the edits to the maps of the document, after they are read and before panels see them.
class EditingSession {
 public:
  // Must be called once a frame, after the document was updated and before panels are drawn. Returns true if
  // another complete recording was opened.
  bool Update(Document& document, Editing& editing, Messages& messages);

  // Treats the next document as a new one even if it is the same file.
  void Forget() { file_.clear(); }

 private:
  void Open(const Document& document, Editing& editing, Messages& messages);
  void Apply(Document& document, Editing& editing);

  std::filesystem::path file_;  // the document that the edits belong to
  bool recorded_ = false;       // it is complete, not a run in progress
  MapSnapshotPtr last_;         // the recorded maps that the edits were applied to
  ShownFramePtr frame_;
};

}  // namespace sqslam::viewer
