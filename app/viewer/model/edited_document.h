#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "app/viewer/model/annotation.h"
#include "app/viewer/model/edit_history.h"
#include "slam/geometry/rigid3.h"
#include "slam/snapshot/object_edits.h"

namespace sqslam::viewer {

// The user's changes: edits of the map's objects, and a ground truth. One history for both,
// so that undo takes back whatever came last.
struct EditedState {
  ObjectEdits edits;
  Annotation annotation;

  bool operator==(const EditedState&) const = default;
};

class EditedDocument {
 public:
  const EditedState& Current() const { return history_.Current(); }
  const EditHistory<EditedState>& History() const { return history_; }

  // Changes a copy of the state and takes it as a step (EditHistory::Push). What `change` throws leaves the
  // document as it was.
  template <typename Change>
  void Do(const std::string& what, Change change, const std::string& group = "") {
    EditedState next = Current();
    change(next);
    history_.Push(std::move(next), what, group);
  }
  void EndGroup() { history_.Seal(); }
  void Undo() { history_.Undo(); }
  void Redo() { history_.Redo(); }

  // Starts anew: edits beside the recording, where there are some, and no annotation. Throws InputError on a
  // broken file; the document is then empty, and SaveEdits keeps that file as FILE.bak.
  void OpenRecording(const std::filesystem::path& recording);

  // Reads a ground truth as a step that can be undone; it is saved to that file from then on.
  void OpenAnnotation(const std::filesystem::path& file, const Sim3d& S_file_annotation = {});

  bool EditsModified() const { return !(Current().edits == saved_.edits); }
  bool AnnotationModified() const { return !(Current().annotation == saved_.annotation); }
  bool Modified() const { return EditsModified() || AnnotationModified(); }

  // Throw InputError where the file cannot be written. Edits go beside the recording; where nothing is edited
  // (any more), a file of edits is removed. An annotation that is there and was not opened is kept as
  // FILE.bak.
  void SaveEdits();
  void SaveAnnotation(const std::filesystem::path& file, const Sim3d& S_file_annotation = {});

  const std::filesystem::path& EditsFile() const { return edits_file_; }
  const std::filesystem::path& AnnotationFile() const { return annotation_file_; }  // empty until known

 private:
  EditHistory<EditedState> history_;
  EditedState saved_;
  std::filesystem::path edits_file_;
  bool edits_unread_ = false;  // there are some, but they could not be read
  std::filesystem::path annotation_file_;
};

}  // namespace sqslam::viewer
