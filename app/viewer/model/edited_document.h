#pragma once

#include <cstddef>
#include <deque>
#include <filesystem>
#include <string>
#include <utility>

#include "app/viewer/model/annotation.h"
#include "slam/geometry/rigid3.h"
#include "slam/snapshot/object_edits.h"

namespace sqslam::viewer {

// objects_gt.json: {id, label, primitive, center, yaw, T_world_object (4x4, row-major), half_size, shape} for
// each solid; what else a file said, of an object or of itself, is written back as it was.
//
// The annotation may live in another frame than the file: drawn on a map, it is in map units and the map's
// frame, while the ground truth is in metres and the world's. S_file_annotation leads from one to the other.
// `yaw` of the file is about the file's z axis.

// Throws InputError that names file and object.
Annotation ReadAnnotation(const std::filesystem::path& path, const Sim3d& S_file_annotation = {});
void WriteAnnotation(const std::filesystem::path& path, const Annotation& annotation,
                     const Sim3d& S_file_annotation = {});

// S_world_map of a result against the ground truth's camera poses of its sequence, by the trajectories.
// Throws InputError where there is no ground truth, or the two do not determine it.
Sim3d AlignToGroundTruth(const std::filesystem::path& result, const std::filesystem::path& sequence);

// Undo and redo of a document that is a value: every step keeps the whole state, so that nothing has to be
// played backwards. Documents are small (some edits of some dozen objects), steps few hundred.
template <typename State>
class EditHistory {
 public:
  static constexpr std::size_t kMostSteps = 500;  // older ones are forgotten

  explicit EditHistory(State first = {}) : steps_{{std::move(first), "", ""}} {}

  const State& Current() const { return steps_[at_].state; }

  // Takes a new state; what had been undone is gone. `what` names the step in menus ("Delete cup 3"). Steps
  // of one `group` that follow one another are one to the user: those of a drag, of a number that is typed. A
  // state equal to the current one is no step.
  void Push(State state, std::string what, std::string group = "") {
    if (state == Current()) {
      return;
    }
    steps_.resize(at_ + 1);
    if (!group.empty() && group == steps_[at_].group && !sealed_) {
      steps_[at_].state = std::move(state);
      return;
    }
    sealed_ = false;
    steps_.push_back({std::move(state), std::move(what), std::move(group)});
    ++at_;
    if (steps_.size() > kMostSteps) {
      steps_.pop_front();
      --at_;
    }
  }

  // The next step is one of its own, whatever its group (the mouse button was released).
  void Seal() { sealed_ = true; }

  bool CanUndo() const { return at_ > 0; }
  bool CanRedo() const { return at_ + 1 < steps_.size(); }
  void Undo() {
    if (CanUndo()) {
      --at_;
      sealed_ = true;
    }
  }
  void Redo() {
    if (CanRedo()) {
      ++at_;
      sealed_ = true;
    }
  }

  // Names of the steps that Undo and Redo would take back or do again; empty where there is nothing.
  std::string UndoName() const { return CanUndo() ? steps_[at_].what : ""; }
  std::string RedoName() const { return CanRedo() ? steps_[at_ + 1].what : ""; }

 private:
  struct Step {
    State state;
    std::string what;
    std::string group;
  };

  std::deque<Step> steps_;  // never empty
  std::size_t at_ = 0;      // of the current state
  bool sealed_ = false;
};

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
  void Do(const std::string& what, auto change, const std::string& group = "") {
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
