#include "app/viewer/state/edit_actions.h"

#include <fmt/format.h>

#include <algorithm>

#include "app/viewer/state/annotation_tool.h"
#include "slam/util/error.h"

namespace sqslam::viewer {
namespace {

// The object as it was recorded, edited or not.
const SnapshotObject* RawObject(const ViewerState& state, int id) {
  const ShownFramePtr& raw = state.editing.raw;
  if (!raw || !raw->map) {
    return nullptr;
  }
  const auto found = std::find_if(raw->map->objects.begin(), raw->map->objects.end(),
                                  [id](const SnapshotObject& object) { return object.id == id; });
  return found == raw->map->objects.end() ? nullptr : &*found;
}

std::string NameOf(const ViewerState& state, int id) {
  if (const SnapshotObject* object = state.Object(id)) {
    return NameForPeople(*object);
  }
  const SnapshotObject* object = RawObject(state, id);
  return object != nullptr ? NameForPeople(*object) : fmt::format("object {}", id);
}

template <typename Change>
void Edit(ViewerState& state, const std::string& what, Change change, const std::string& group = "") {
  try {
    state.editing.document.Do(
        what, [&](DocumentState& document) { change(document.edits); }, group);
  } catch (const UsageError& error) {
    state.Complain(error.what());
  }
}

}  // namespace

std::string NameForPeople(const SnapshotObject& object) {
  return object.name.empty() ? ObjectName(object) : object.name;
}

void RenameObject(ViewerState& state, int id, const std::string& name) {
  Edit(state, "Rename " + NameOf(state, id), [&](ObjectEdits& edits) { edits.Rename(id, name); });
}

void RelabelObject(ViewerState& state, int id, const std::string& label) {
  const SnapshotObject* raw = RawObject(state, id);
  const bool same = raw != nullptr && raw->label == label;
  Edit(state, "Label of " + NameOf(state, id),
       [&](ObjectEdits& edits) { edits.SetLabel(id, same ? "" : label); });
}

void HideObject(ViewerState& state, int id, bool hidden) {
  Edit(state, (hidden ? "Hide " : "Show ") + NameOf(state, id),
       [&](ObjectEdits& edits) { edits.Hide(id, hidden); });
  if (hidden && state.selected == id) {
    state.selected.reset();
  }
}

void DeleteObject(ViewerState& state, int id) {
  const std::string name = NameOf(state, id);
  Edit(state, "Delete " + name, [&](ObjectEdits& edits) { edits.Delete(id); });
  if (state.selected == id) {
    state.selected.reset();
  }
  state.Say(name + " deleted; Ctrl Z brings it back");
}

void MergeObjects(ViewerState& state, int kept, int absorbed) {
  Edit(state, fmt::format("Merge {} into {}", NameOf(state, absorbed), NameOf(state, kept)),
       [&](ObjectEdits& edits) { edits.Merge(kept, absorbed); });
  state.selected = state.editing.document.Current().edits.KeptIdOf(kept);
}

void SeparateObject(ViewerState& state, int absorbed) {
  Edit(state, "Separate " + NameOf(state, absorbed), [&](ObjectEdits& edits) { edits.Separate(absorbed); });
}

void Undo(ViewerState& state) { state.editing.document.Undo(); }
void Redo(ViewerState& state) { state.editing.document.Redo(); }

void SaveAll(ViewerState& state) {
  ViewerDocument& document = state.editing.document;
  if (!document.Modified()) {
    return;
  }
  try {
    if (document.EditsModified()) {
      document.SaveEdits();
      state.Say("Edits saved beside the map");
    }
    if (document.AnnotationModified()) {
      SaveAnnotationFile(state);
    }
  } catch (const InputError& error) {
    state.Complain(error.what());
  }
}

void DeleteSelected(ViewerState& state) {
  AnnotationTool& tool = state.editing.annotation;
  if (tool.active) {
    RemoveSolid(state);
  } else if (state.selected) {
    DeleteObject(state, *state.selected);
  }
}

void KeepSettings(ViewerState& state) {
  try {
    SaveSettings(state.editing.settings_file, state.editing.settings);
  } catch (const InputError& error) {
    state.editing.settings_file.clear();
    state.Complain(error.what());
  }
}

void KeepMemory(ViewerState& state) {
  try {
    SaveMemory(state.editing.memory_file, state.editing.memory);
  } catch (const InputError& error) {
    state.editing.memory_file.clear();
    state.Complain(error.what());
  }
}

void ApplySettings(ViewerState& state) {
  const ViewerSettings& settings = state.editing.settings;
  state.theme = settings.theme == "light" ? Theme::kLight : Theme::kDark;
  state.show_image = settings.show_image;
  if (state.view.style_name != settings.style) {
    UseStyle(state, settings.style);
  }
}

}  // namespace sqslam::viewer
