#include "app/viewer/state/editing_session.h"

#include <utility>

#include "app/viewer/state/annotation_tool.h"
#include "app/viewer/state/edit_actions.h"
#include "slam/util/error.h"

namespace sqslam::viewer {

void EditingSession::Update(ViewerState& state) {
  AnnotationTool& tool = state.editing.annotation;
  tool.active = std::exchange(tool.drawn, false);
  if (!tool.active) {
    tool.drag.reset();
    tool.outline.clear();
  }
  TakeDocument(state);
  TakeFrame(state);
  TakeHistory(state);
}

// Another document was opened: its edits are those beside it.
void EditingSession::TakeDocument(ViewerState& state) {
  Editing& editing = state.editing;
  const Document& document = state.document;
  if (document.kind == Document::Kind::kNone || document.loading || !document.last) {
    return;
  }
  if (document.file != file_) {
    file_ = document.file;
    recorded_ = false;
    reader_.reset();
    editing.history.reset();
    editing.history_progress = 0.0;
    editing.representation = Representation::kSuperquadric;
    const AnnotationTool before = std::exchange(editing.annotation, {});
    editing.annotation.label = before.label;
    try {
      editing.document.OpenRecording(file_);
    } catch (const InputError& error) {
      state.Complain(error.what());
    }
  }
  if (!recorded_ && document.kind == Document::Kind::kRecording) {  // from the start, or a run that ended
    recorded_ = true;
    reader_ = std::make_unique<HistoryReader>(file_);
    editing.memory.Remember(file_);
    KeepMemory(state);
  }
}

void EditingSession::TakeFrame(ViewerState& state) {
  Editing& editing = state.editing;
  const ObjectEdits& edits = editing.document.Current().edits;
  const bool changed = !(edits == edits_) || editing.representation != representation_;
  const auto edited = [&](const MapSnapshotPtr& map) {
    return Represented(edits.Empty() ? map : Apply(edits, *map), editing.representation);
  };
  if (state.document.last != given_last_) {
    raw_last_ = state.document.last;
    state.document.last = given_last_ = raw_last_ ? edited(raw_last_) : nullptr;
  } else if (changed && raw_last_) {
    state.document.last = given_last_ = edited(raw_last_);
  }
  const bool fresh = state.shown != given_;
  if (fresh) {
    editing.raw = state.shown;
  }
  if (fresh || changed) {
    given_ = editing.raw;
    if (given_ && given_->map &&
        (!edits.Empty() || editing.representation != Representation::kSuperquadric)) {
      auto shown = std::make_shared<ShownFrame>(*given_);
      shown->map = edited(given_->map);
      for (SnapshotDetection& seen : shown->detections) {
        const int id = seen.object_id < 0 ? -1 : edits.KeptIdOf(seen.object_id);
        seen.object_id = id < 0 || edits.Of(id).deleted || edits.Of(id).hidden ? -1 : id;
      }
      given_ = std::move(shown);
    }
    state.shown = given_;
  }
  edits_ = edits;
  representation_ = editing.representation;
}

void EditingSession::TakeHistory(ViewerState& state) {
  if (reader_ && !state.editing.history) {
    state.editing.history = reader_->Result();
    state.editing.history_progress = reader_->Progress();
  }
}

bool Postpone(ViewerState& state, const Postponed& what) {
  Editing& editing = state.editing;
  if (editing.discard || !editing.document.Modified()) {
    editing.discard = false;
    return false;
  }
  editing.postponed = what;
  return true;
}

}  // namespace sqslam::viewer
