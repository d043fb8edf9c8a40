#pragma once

#include <string>

#include "app/viewer/state/viewer_state.h"

// What buttons, menus and keys do to the document. Nothing here throws: what goes wrong is said in the
// window.
namespace sqslam::viewer {

// "potted plant 3", or the name that somebody gave it.
std::string NameForPeople(const SnapshotObject& object);

void RenameObject(ViewerState& state, int id, const std::string& name);
void RelabelObject(ViewerState& state, int id, const std::string& label);
void HideObject(ViewerState& state, int id, bool hidden);
void DeleteObject(ViewerState& state, int id);
void MergeObjects(ViewerState& state, int kept, int absorbed);
void SeparateObject(ViewerState& state, int absorbed);

void Undo(ViewerState& state);
void Redo(ViewerState& state);
void SaveAll(ViewerState& state);  // edits, and the annotation where it has a file

// The Delete key: the selected solid while annotating, the selected object otherwise.
void DeleteSelected(ViewerState& state);

// Keeps settings and memory on the disk; failures are said once.
void KeepSettings(ViewerState& state);
void KeepMemory(ViewerState& state);

// Copies the settings into what they are about: theme and style.
void ApplySettings(ViewerState& state);

}  // namespace sqslam::viewer
