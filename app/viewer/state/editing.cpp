#include "app/viewer/state/editing.h"

#include <fmt/format.h>

#include <utility>

namespace sqslam::viewer {
namespace {

std::string NameOf(const Document& document, int id) {
  const SnapshotObject* object = document.Object(id);
  object = object != nullptr ? object : document.RecordedObject(id);
  return object != nullptr ? ObjectName(*object) : fmt::format("object {}", id);
}

void Edit(const EditContext& context, const std::string& what, auto change) {
  context.messages.Try(
      [&] { context.editing.document.Do(what, [&](EditedState& state) { change(state.edits); }); });
}

}  // namespace

MapSnapshotPtr AppliedEdits::ApplyTo(const MapSnapshotPtr& map) const {
  return map ? Represented(edits.Empty() ? map : Apply(edits, *map), representation) : nullptr;
}

bool Editing::Postpone(const Request& request) {
  if (std::exchange(discard, false) || !document.Modified()) {
    return false;
  }
  postponed = request;
  return true;
}

void EditContext::RenameObject(int id, const std::string& name) const {
  Edit(*this, "Rename " + NameOf(document, id), [&](ObjectEdits& edits) { edits.Rename(id, name); });
}

void EditContext::RelabelObject(int id, const std::string& label) const {
  const SnapshotObject* recorded = document.RecordedObject(id);
  const bool same = recorded != nullptr && recorded->label == label;
  Edit(*this, "Label of " + NameOf(document, id),
       [&](ObjectEdits& edits) { edits.SetLabel(id, same ? "" : label); });
}

void EditContext::HideObject(int id, bool hidden) const {
  Edit(*this, (hidden ? "Hide " : "Show ") + NameOf(document, id),
       [&](ObjectEdits& edits) { edits.Hide(id, hidden); });
  if (hidden && selection.selected == id) {
    selection.selected.reset();
  }
}

void EditContext::DeleteObject(int id) const {
  const std::string name = NameOf(document, id);
  Edit(*this, "Delete " + name, [&](ObjectEdits& edits) { edits.Delete(id); });
  if (selection.selected == id) {
    selection.selected.reset();
  }
  messages.AddNotice(name + " deleted; Ctrl Z brings it back");
}

void EditContext::MergeObjects(int kept, int absorbed) const {
  Edit(*this, fmt::format("Merge {} into {}", NameOf(document, absorbed), NameOf(document, kept)),
       [&](ObjectEdits& edits) { edits.Merge(kept, absorbed); });
  selection.selected = editing.Edits().KeptIdOf(kept);
}

void EditContext::SeparateObject(int absorbed) const {
  Edit(*this, "Separate " + NameOf(document, absorbed),
       [&](ObjectEdits& edits) { edits.Separate(absorbed); });
}

void EditContext::DeleteSelected() const {
  if (tool.active) {
    RemoveSolid();
  } else if (selection.selected) {
    DeleteObject(*selection.selected);
  }
}

void EditContext::SaveAll() const {
  EditedDocument& edited = editing.document;
  messages.Try([&] {
    if (edited.EditsModified()) {
      edited.SaveEdits();
      messages.AddNotice("Edits saved beside the map");
    }
    if (edited.AnnotationModified()) {
      SaveAnnotationFile();
    }
  });
}

bool EditingSession::Update(Document& document, Editing& editing, Messages& messages) {
  AnnotationTool& tool = editing.annotation;
  tool.active = std::exchange(tool.drawn, false);
  if (!tool.active) {
    tool.drag.reset();
    tool.outline.clear();
  }
  bool finished = false;
  if (!document.loading && document.recorded_last) {
    if (document.file != file_) {
      file_ = document.file;
      recorded_ = false;
      Open(document, editing, messages);
    }
    finished = !document.run.active && !recorded_;  // a recording was opened, or a run ended
    recorded_ = recorded_ || finished;
  }
  Apply(document, editing);
  return finished;
}

// Resets the tools for another document and reads the edits beside it.
void EditingSession::Open(const Document& document, Editing& editing, Messages& messages) {
  editing.representation = SolidKind::kSuperquadric;
  AnnotationTool fresh;
  fresh.label = editing.annotation.label;
  editing.annotation = std::move(fresh);
  messages.Try([&] { editing.document.OpenRecording(document.file); });
}

void EditingSession::Apply(Document& document, Editing& editing) {
  const AppliedEdits wanted{editing.Edits(), editing.representation};
  const bool changed = !(wanted == std::exchange(editing.applied, wanted));
  if (std::exchange(last_, document.recorded_last) != document.recorded_last || changed) {
    document.last = wanted.ApplyTo(last_);
  }
  if (std::exchange(frame_, document.recorded) == document.recorded && !changed) {
    return;
  }
  document.shown = frame_;
  if (frame_ && frame_->map && !wanted.Empty()) {
    auto shown = std::make_shared<ShownFrame>(*frame_);
    shown->map = wanted.ApplyTo(frame_->map);
    for (SnapshotDetection& seen : shown->detections) {
      const int id = seen.object_id < 0 ? -1 : wanted.edits.KeptIdOf(seen.object_id);
      seen.object_id = id < 0 || wanted.edits.Of(id).deleted || wanted.edits.Of(id).hidden ? -1 : id;
    }
    document.shown = std::move(shown);
  }
}

}  // namespace sqslam::viewer
