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

// Colours of the points of the selected object.
enum class PointColors { kNone, kResidual, kAnomaly };

// The tool that draws a ground truth (annotation_tool.cpp). Works in the frame of the finished map.
struct AnnotationTool {
  bool active = false;  // its panel is in front: the mouse in the scene is its
  bool drawn = false;   // the panel was drawn in this frame
  std::optional<int> selected;
  std::string label = "object";  // of solids to come
  bool standing = true;          // fits reach down to the ground
  bool round = true;             // cylinders have a circular section
  bool in_world = false;         // the file is in the world of the sequence's ground truth
  std::optional<Sim3d> S_world_map;
  std::string file;        // objects_gt.json
  std::string cloud_file;  // a dense cloud; empty: the map's points
  std::shared_ptr<const Points> cloud;
  std::optional<double> ground;  // z of the plane that things stand on, map frame
  MapSnapshotPtr prepared_for;   // the map that cloud and ground belong to

  bool lasso = false;                    // a drag draws one
  std::vector<Eigen::Vector2d> outline;  // of the lasso that is being drawn, pixels of the scene
  std::vector<int> chosen;               // points of the cloud

  std::optional<SolidHandle> hovered;
  struct Drag {
    SolidHandle handle;
    AnnotatedSolid start;
    Ray from;
  };
  std::optional<Drag> drag;
};

// Edits and shapes with which recorded maps are shown.
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
  std::optional<Request> postponed;  // until unsaved changes are saved or given up
  bool discard = false;              // what is unsaved was given up

  const ObjectEdits& Edits() const { return document.Current().edits; }
  const Annotation& Solids() const { return document.Current().annotation; }

  // Asks first where unsaved changes are in the way of quitting or opening: true, and the panel of the
  // question shows. Otherwise false.
  bool Postpone(const Request& request);
};

// The parts of the viewer on which editing works.
struct EditContext {
  const Document& document;
  const SceneView& view;
  Selection& selection;
  Editing& editing;
  Messages& messages;
};

// Actions on objects, of buttons, menus and keys. Errors become messages.
void RenameObject(const EditContext& context, int id, const std::string& name);
void RelabelObject(const EditContext& context, int id, const std::string& label);
void HideObject(const EditContext& context, int id, bool hidden);
void DeleteObject(const EditContext& context, int id);
void MergeObjects(const EditContext& context, int kept, int absorbed);
void SeparateObject(const EditContext& context, int absorbed);

// The Delete key: the selected solid while annotating, the selected object otherwise.
void DeleteSelected(const EditContext& context);

// Saves edits, and the annotation where it has a file.
void SaveAll(const EditContext& context);

// Keeps the maps on the screen up to what was edited: between what is read and what panels see.
class EditingSession {
 public:
  // Once a frame, after the document was brought up to date and before panels are drawn. True where another
  // recording is there that does not grow any more.
  bool Update(Document& document, Editing& editing, Messages& messages);

  // The next document is another one even where it lies in the same file: it is read anew.
  void Forget() { file_.clear(); }

 private:
  void Open(const Document& document, Editing& editing, Messages& messages);
  void Apply(Document& document, Editing& editing);

  std::filesystem::path file_;  // of the document that the edits belong to
  bool recorded_ = false;       // it is one that does not grow any more
  // The maps that were put into the document, so that new ones in it can be told apart.
  ShownFramePtr given_;
  MapSnapshotPtr given_last_;
  MapSnapshotPtr recorded_last_;
};

// Drawing a ground truth on a map: what the panel's buttons and the mouse in the scene do. Pixels are those
// of the scene, from its top-left corner. Errors become messages.

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
