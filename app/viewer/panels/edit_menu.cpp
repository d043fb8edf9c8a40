#include "app/viewer/panels/edit_menu.h"

#include <imgui.h>

#include <array>
#include <filesystem>
#include <string>

#include "app/viewer/state/edit_actions.h"

namespace sqslam::viewer {
namespace {

void DrawRepresentation(ViewerState& state) {
  if (!ImGui::BeginMenu("Show objects as")) {
    return;
  }
  constexpr std::array<const char*, 3> kNames = {"Superquadrics", "Ellipsoids", "Cuboids"};
  for (int i = 0; i < 3; ++i) {
    const auto representation = static_cast<Representation>(i);
    if (ImGui::MenuItem(kNames[static_cast<std::size_t>(i)], nullptr,
                        state.editing.representation == representation)) {
      state.editing.representation = representation;
    }
  }
  ImGui::EndMenu();
}

}  // namespace

void DrawEditMenu(ViewerState& state) {
  if (!ImGui::BeginMenu("Edit")) {
    return;
  }
  const ViewerDocument& document = state.editing.document;
  const auto& history = document.History();
  if (ImGui::MenuItem(("Undo " + history.UndoName()).c_str(), "Ctrl Z", false, history.CanUndo())) {
    Undo(state);
  }
  if (ImGui::MenuItem(("Redo " + history.RedoName()).c_str(), "Ctrl Y", false, history.CanRedo())) {
    Redo(state);
  }
  ImGui::Separator();
  if (ImGui::MenuItem("Save edits", "Ctrl S", false, document.Modified())) {
    SaveAll(state);
  }
  ImGui::Separator();
  if (ImGui::MenuItem("Delete object", "Delete", false, state.selected.has_value())) {
    DeleteSelected(state);
  }
  DrawRepresentation(state);
  ImGui::Separator();
  if (ImGui::MenuItem("Settings ...")) {
    state.editing.show_settings = true;
  }
  ImGui::EndMenu();
}

void DrawRecentFiles(ViewerState& state) {
  const std::vector<std::string>& files = state.editing.memory.recent_files;
  if (!ImGui::BeginMenu("Open recent", !files.empty())) {
    return;
  }
  for (const std::string& file : files) {
    const std::filesystem::path path(file);
    // A result is known by its folder.
    const std::string name = path.filename() == "map.sqmap" ? path.parent_path().string() : file;
    if (ImGui::MenuItem(name.c_str())) {
      state.Ask(OpenRequest{path});
    }
  }
  ImGui::EndMenu();
}

}  // namespace sqslam::viewer
