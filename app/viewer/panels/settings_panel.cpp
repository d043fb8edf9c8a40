#include <imgui.h>

#include <array>
#include <string>

#include "app/viewer/panels/panels.h"
#include "app/viewer/state/edit_actions.h"
#include "app/viewer/widgets/widgets.h"
#include "slam/util/data_path.h"

namespace sqslam::viewer {
namespace {

// A window in the middle, above all others.
bool BeginDialog(const char* title, float width) {
  const ImVec2 window = ImGui::GetIO().DisplaySize;
  const float em = ImGui::GetFontSize();
  ImGui::SetNextWindowPos(ImVec2(0.5F * window.x, 0.5F * window.y), ImGuiCond_Always, ImVec2(0.5F, 0.5F));
  ImGui::SetNextWindowSize(ImVec2(std::min(width * em, 0.96F * window.x), 0.0F));
  ImGui::PushStyleColor(ImGuiCol_WindowBg, ImGui::GetStyleColorVec4(ImGuiCol_PopupBg));
  ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, ImVec2(1.6F * em, 1.2F * em));
  ImGui::PushStyleVar(ImGuiStyleVar_WindowBorderSize, 1.0F);
  return ImGui::Begin(
      title, nullptr,
      ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoSavedSettings);
}

void EndDialog() {
  ImGui::End();
  ImGui::PopStyleVar(2);
  ImGui::PopStyleColor();
}

class SettingsPanel : public Panel {
 public:
  Place Where() const override { return Place::kOver; }
  std::string Title() const override { return "Settings"; }
  bool Wanted(const ViewerState& state) const override { return state.editing.show_settings; }

  void Draw(ViewerState& state) override {
    ViewerSettings& settings = state.editing.settings;
    settings.theme = state.theme == Theme::kLight ? "light" : "dark";  // keys and menus change them too
    settings.style = state.view.style_name;
    settings.show_image = state.show_image;
    if (BeginDialog("Settings", 26.0F)) {
      Heading("Settings");
      bool changed = Choice("theme", settings.theme, {"dark", "light"});
      changed |= Choice("scene style", settings.style, ConfigNames("configs/styles"));
      changed |= ImGui::Checkbox("input image beside the map", &settings.show_image);
      auto size = static_cast<float>(settings.font_size);
      ImGui::SetNextItemWidth(12.0F * ImGui::GetFontSize());
      if (ImGui::SliderFloat("letters", &size, 10.0F, 28.0F, "%.0f px")) {
        settings.font_size = static_cast<double>(size);
        changed = true;
      }
      Tip("Height of the letters; from the next start on");
      if (changed) {
        ApplySettings(state);
        KeepSettings(state);
      }
      ImGui::Dummy(ImVec2(0.0F, 0.4F * ImGui::GetFontSize()));
      ImGui::PushTextWrapPos(0.0F);
      ImGui::TextDisabled("%s", state.editing.settings_file.empty()
                                    ? "Not kept after this session."
                                    : ("Kept in " + state.editing.settings_file.string()).c_str());
      ImGui::PopTextWrapPos();
      ImGui::Dummy(ImVec2(0.0F, 0.3F * ImGui::GetFontSize()));
      if (ImGui::Button("Close") || ImGui::IsKeyPressed(ImGui::GetKeyIndex(ImGuiKey_Escape))) {
        state.editing.show_settings = false;
      }
    }
    EndDialog();
  }

 private:
  static bool Choice(const char* name, std::string& value, const std::vector<std::string>& words) {
    bool changed = false;
    ImGui::SetNextItemWidth(12.0F * ImGui::GetFontSize());
    if (ImGui::BeginCombo(name, value.c_str())) {
      for (const std::string& word : words) {
        if (ImGui::Selectable(word.c_str(), word == value)) {
          value = word;
          changed = true;
        }
      }
      ImGui::EndCombo();
    }
    return changed;
  }
};

// Asks what becomes of unsaved changes before they would be lost.
class UnsavedPanel : public Panel {
 public:
  Place Where() const override { return Place::kOver; }
  std::string Title() const override { return "Unsaved changes"; }
  bool Wanted(const ViewerState& state) const override { return state.editing.postponed.has_value(); }

  void Draw(ViewerState& state) override {
    if (BeginDialog("Unsaved changes", 28.0F)) {
      Heading("There are unsaved changes");
      ImGui::PushTextWrapPos(0.0F);
      ImGui::TextDisabled("%s", What(state).c_str());
      ImGui::PopTextWrapPos();
      ImGui::Dummy(ImVec2(0.0F, 0.4F * ImGui::GetFontSize()));
      if (ImGui::Button("Save")) {
        SaveAll(state);
        if (!state.editing.document.Modified()) {
          GoOn(state);
        }
      }
      ImGui::SameLine();
      if (ImGui::Button("Discard")) {
        state.editing.discard = true;
        GoOn(state);
      }
      ImGui::SameLine();
      if (ImGui::Button("Cancel") || ImGui::IsKeyPressed(ImGui::GetKeyIndex(ImGuiKey_Escape))) {
        state.editing.postponed.reset();
      }
    }
    EndDialog();
  }

 private:
  static std::string What(const ViewerState& state) {
    const ViewerDocument& document = state.editing.document;
    std::string what;
    if (document.EditsModified()) {
      what = "Edits of the map's objects. ";
    }
    if (document.AnnotationModified()) {
      what += "The annotation, to " + state.editing.annotation.file + ".";
    }
    return what;
  }

  static void GoOn(ViewerState& state) {
    if (!state.editing.postponed) {
      return;
    }
    const Postponed postponed = *state.editing.postponed;
    state.editing.postponed.reset();
    if (postponed.quit) {
      state.Ask(QuitRequest{});
    } else {
      state.Ask(OpenRequest{postponed.open});
    }
  }
};

}  // namespace

PanelPtr MakeSettingsPanel() { return std::make_unique<SettingsPanel>(); }
PanelPtr MakeUnsavedPanel() { return std::make_unique<UnsavedPanel>(); }

}  // namespace sqslam::viewer
