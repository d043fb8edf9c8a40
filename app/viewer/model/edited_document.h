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
// each solid. Other keys, of an object or of the file, are preserved.
//
// The annotation may be in another frame than the file: one drawn on a map is in map units and the map's
// frame, the ground truth in metres and the world frame. S_file_annotation transforms between them. `yaw` of
// the file is about the file's z axis.

// Throw InputError that names file and object.
Annotation ReadAnnotation(const std::filesystem::path& path, const Sim3d& S_file_annotation = {});
void WriteAnnotation(const std::filesystem::path& path, const Annotation& annotation,
                     const Sim3d& S_file_annotation = {});

// Returns S_world_map, which aligns the trajectory of a result to the ground truth of its sequence. Throws
// InputError if there is no ground truth, or the two do not determine the alignment.
Sim3d AlignToGroundTruth(const std::filesystem::path& result, const std::filesystem::path& sequence);

// Undo and redo of a document of value type: every step stores the whole state, so nothing has to be
// inverted. Documents are small (some edits of some dozen objects), steps few hundred.
template <typename State>
class EditHistory {
 public:
  static constexpr std::size_t kMaxSteps = 500;  // older ones are dropped

  explicit EditHistory(State first = {}) : steps_{{std::move(first), "", ""}} {}

  const State& Current() const { return steps_[at_].state; }

  // Adds a state as a step and drops the undone ones. `what` names the step in menus ("Delete cup 3").
  // Merges consecutive steps of one `group`, for example of a drag or of a number being typed. A state
  // equal to the current one is not added.
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
    if (steps_.size() > kMaxSteps) {
      steps_.pop_front();
      --at_;
    }
  }

  // Makes the next step a separate one, whatever its group (the mouse button was released).
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

  // Name the steps that Undo and Redo would apply; empty if there is none.
  std::string UndoName() const { return CanUndo() ? steps_[at_].what : ""; }
  std::string RedoName() const { return CanRedo() ? steps_[at_ + 1].what : ""; }

 private:
  struct Step {
    State state;
    std::string what;
    std::string group;
  };

  std::deque<Step> steps_;  // never empty
  std::size_t at_ = 0;      // index of the current state
  bool sealed_ = false;
};

// The user's changes: object edits and a ground truth, with one history for both.
struct EditedState {
  ObjectEdits edits;
  Annotation annotation;

  bool operator==(const EditedState&) const = default;
};

class EditedDocument {
 public:
  const EditedState& Current() const { return history_.Current(); }
  const EditHistory<EditedState>& History() const { return history_; }

  // Changes a copy of the state and adds it as a step (EditHistory::Push), unless `change` throws.
  void Do(const std::string& what, auto change, const std::string& group = "") {
    EditedState next = Current();
    change(next);
    history_.Push(std::move(next), what, group);
  }
  void EndGroup() { history_.Seal(); }
  void Undo() { history_.Undo(); }
  void Redo() { history_.Redo(); }

  // Starts over with the edits beside the recording, if any, and no annotation. Throws InputError on a broken
  // file; the document is then empty, and SaveEdits keeps that file as FILE.bak.
  void OpenRecording(const std::filesystem::path& recording);

  // Reads a ground truth as a step that can be undone.
  void OpenAnnotation(const std::filesystem::path& file, const Sim3d& S_file_annotation = {});

  bool EditsModified() const { return !(Current().edits == saved_.edits); }
  bool AnnotationModified() const { return !(Current().annotation == saved_.annotation); }
  bool Modified() const { return EditsModified() || AnnotationModified(); }

  // Throw InputError if the file cannot be written. Edits go beside the recording; if there are none (any
  // more), the file is removed. An annotation file that was not opened before is kept as FILE.bak.
  void SaveEdits();
  void SaveAnnotation(const std::filesystem::path& file, const Sim3d& S_file_annotation = {});

  const std::filesystem::path& EditsFile() const { return edits_file_; }

 private:
  EditHistory<EditedState> history_;
  EditedState saved_;
  std::filesystem::path edits_file_;
  bool edits_unread_ = false;              // the file exists but could not be read
  std::filesystem::path annotation_file_;  // last opened or saved
};

}  // namespace sqslam::viewer
