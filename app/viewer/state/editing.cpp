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

void RenameObject(const EditContext& context, int id, const std::string& name) {
  Edit(context, "Rename " + NameOf(context.document, id),
       [&](ObjectEdits& edits) { edits.Rename(id, name); });
}

void RelabelObject(const EditContext& context, int id, const std::string& label) {
  const SnapshotObject* recorded = context.document.RecordedObject(id);
  const bool same = recorded != nullptr && recorded->label == label;
  Edit(context, "Label of " + NameOf(context.document, id),
       [&](ObjectEdits& edits) { edits.SetLabel(id, same ? "" : label); });
}

void HideObject(const EditContext& context, int id, bool hidden) {
  Edit(context, (hidden ? "Hide " : "Show ") + NameOf(context.document, id),
       [&](ObjectEdits& edits) { edits.Hide(id, hidden); });
  if (hidden && context.selection.selected == id) {
    context.selection.selected.reset();
  }
}

void DeleteObject(const EditContext& context, int id) {
  const std::string name = NameOf(context.document, id);
  Edit(context, "Delete " + name, [&](ObjectEdits& edits) { edits.Delete(id); });
  if (context.selection.selected == id) {
    context.selection.selected.reset();
  }
  context.messages.Say(name + " deleted; Ctrl Z brings it back");
}

void MergeObjects(const EditContext& context, int kept, int absorbed) {
  Edit(context,
       fmt::format("Merge {} into {}", NameOf(context.document, absorbed), NameOf(context.document, kept)),
       [&](ObjectEdits& edits) { edits.Merge(kept, absorbed); });
  context.selection.selected = context.editing.Edits().KeptIdOf(kept);
}

void SeparateObject(const EditContext& context, int absorbed) {
  Edit(context, "Separate " + NameOf(context.document, absorbed),
       [&](ObjectEdits& edits) { edits.Separate(absorbed); });
}

void DeleteSelected(const EditContext& context) {
  if (context.editing.annotation.active) {
    RemoveSolid(context);
  } else if (context.selection.selected) {
    DeleteObject(context, *context.selection.selected);
  }
}

void SaveAll(const EditContext& context) {
  EditedDocument& document = context.editing.document;
  context.messages.Try([&] {
    if (document.EditsModified()) {
      document.SaveEdits();
      context.messages.Say("Edits saved beside the map");
    }
    if (document.AnnotationModified()) {
      SaveAnnotationFile(context);
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
  if (document.kind != Document::Kind::kNone && !document.loading && document.last) {
    if (document.file != file_) {
      file_ = document.file;
      recorded_ = false;
      Open(document, editing, messages);
    }
    finished = document.kind == Document::Kind::kRecording && !recorded_;  // recording opened, or run ended
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
  const bool fresh_last = document.last != given_last_;
  if (fresh_last) {
    recorded_last_ = document.last;
  }
  if (fresh_last || changed) {
    document.last = given_last_ = wanted.ApplyTo(recorded_last_);
  }
  const bool fresh = document.shown != given_;
  if (fresh) {
    document.recorded = document.shown;
  }
  if (!fresh && !changed) {
    return;
  }
  given_ = document.recorded;
  if (given_ && given_->map && !wanted.Empty()) {
    auto shown = std::make_shared<ShownFrame>(*given_);
    shown->map = wanted.ApplyTo(given_->map);
    for (SnapshotDetection& seen : shown->detections) {
      const int id = seen.object_id < 0 ? -1 : wanted.edits.KeptIdOf(seen.object_id);
      seen.object_id = id < 0 || wanted.edits.Of(id).deleted || wanted.edits.Of(id).hidden ? -1 : id;
    }
    given_ = std::move(shown);
  }
  document.shown = given_;
}

}  // namespace sqslam::viewer
