#include <imgui.h>

#include <string>
#include <vector>

#include "app/viewer/panels/panels.h"
#include "app/viewer/widgets/widgets.h"
#include "slam/util/data_path.h"

// Windows over all others: help, settings, the question about unsaved changes, messages.
namespace sqslam::viewer {
namespace {

bool EscapeIsPressed() { return ImGui::IsKeyPressed(ImGui::GetKeyIndex(ImGuiKey_Escape)); }

class HelpPanel : public Panel {
 public:
  explicit HelpPanel(ViewerState& s) : Panel(Place::kOver, "Keys and mouse", s) {}
  bool Wanted() const override { return window_.show_help; }

  void Draw() override {
    const float em = ImGui::GetFontSize();
    ImGui::PushStyleVar(ImGuiStyleVar_CellPadding, ImVec2(0.4F * em, 0.14F * em));
    const auto content = [&] {
      DrawColumns();
      ImGui::Dummy(ImVec2(0.0F, 0.3F * em));
      if (ImGui::Button("Close (H)")) {
        window_.show_help = false;
      }
    };
    Dialog("Keys and mouse", 58.0F, content, ImGuiWindowFlags_NoNav);
    ImGui::PopStyleVar();
  }

 private:
  using Line = std::pair<std::string, std::string>;  // keys, what they do

  static void DrawLines(const char* id, const std::vector<Line>& lines) {
    if (!ImGui::BeginTable(id, 2, ImGuiTableFlags_None)) {
      return;
    }
    ImGui::TableSetupColumn("keys", ImGuiTableColumnFlags_WidthFixed, 9.0F * ImGui::GetFontSize());
    ImGui::TableSetupColumn("what", ImGuiTableColumnFlags_WidthStretch);
    for (const auto& [keys, what] : lines) {
      ImGui::TableNextRow();
      ImGui::TableNextColumn();
      ImGui::TextColored(ImGui::GetStyleColorVec4(ImGuiCol_CheckMark), "%s", keys.c_str());
      ImGui::TableNextColumn();
      ImGui::TextUnformatted(what.c_str());
    }
    ImGui::EndTable();
  }

  void DrawColumns() const {
    if (!ImGui::BeginTable("columns", 2)) {
      return;
    }
    ImGui::TableNextColumn();
    Heading("Mouse in the map");
    DrawLines("mouse", {{"drag", "turn about the middle"},
                        {"Shift drag", "move (or middle button)"},
                        {"right drag", "look around"},
                        {"wheel", "nearer, farther, to the mouse"},
                        {"click", "select an object"},
                        {"double click", "bring it to the middle"},
                        {"W A S D  Q E", "fly; faster with Shift"}});
    // The keys fill both columns evenly.
    constexpr std::size_t kBesideMouse = 12;
    std::vector<Line> work, rest;
    const std::vector<Shortcut>& keys = Shortcuts();
    for (std::size_t i = 0; i < keys.size(); ++i) {
      (i + kBesideMouse < keys.size() ? rest : work).emplace_back(keys[i].keys, keys[i].what);
    }
    work.emplace_back("drop a file", "open a result, a .ply as dense cloud");
    Heading("Work and files");
    DrawLines("more keys", work);
    ImGui::TableNextColumn();
    Heading("Time, view, pictures");
    DrawLines("keys", rest);
    ImGui::EndTable();
  }
};

class SettingsPanel : public Panel {
 public:
  explicit SettingsPanel(ViewerState& s) : Panel(Place::kOver, "Settings", s) {}
  bool Wanted() const override { return window_.show_settings; }

  void Draw() override {
    preferences_.TakeSettings(window_, view_);  // keys and menus may have changed them
    Dialog("Settings", 26.0F, [&] { DrawContent(); });
  }

 private:
  void DrawContent() {
    ViewerSettings& settings = preferences_.settings;
    Heading("Settings");
    std::string theme = NameOf(settings.theme);
    bool changed = Word("theme", theme, AllNames<Theme>());
    settings.theme = FromName<Theme>(theme).value_or(settings.theme);
    changed |= Word("scene style", settings.style, styles_);
    changed |= ImGui::Checkbox("input image beside the map", &settings.show_image);
    changed |= Slide("letters", settings.font_size, 10.0, 28.0, "%.0f px", 12.0F);
    Tip("Height of the letters; from the next start on");
    if (changed) {
      preferences_.ApplySettings(window_, view_, messages_);
      preferences_.KeepSettings(messages_);
    }
    const float em = ImGui::GetFontSize();
    ImGui::Dummy(ImVec2(0.0F, 0.4F * em));
    DimWrapped(preferences_.settings_file.empty() ? "Not kept after this session."
                                                  : "Kept in " + preferences_.settings_file.string());
    ImGui::Dummy(ImVec2(0.0F, 0.3F * em));
    if (ImGui::Button("Close") || EscapeIsPressed()) {
      window_.show_settings = false;
    }
  }

  static bool Word(const char* name, std::string& value, const std::vector<std::string>& words) {
    const std::optional<std::size_t> chosen = Choice(name, value, words, 12.0F);
    value = chosen ? words[*chosen] : value;
    return chosen.has_value();
  }

  const std::vector<std::string> styles_ = ConfigNames("configs/styles");
};

// Asks what to do with unsaved changes before they would be lost.
class UnsavedPanel : public Panel {
 public:
  explicit UnsavedPanel(ViewerState& s) : Panel(Place::kOver, "Unsaved changes", s) {}
  bool Wanted() const override { return editing_.postponed.has_value(); }

  void Draw() override {
    Dialog("Unsaved changes", 28.0F, [&] { DrawContent(); });
  }

 private:
  void DrawContent() {
    const EditedDocument& document = editing_.document;
    Heading("There are unsaved changes");
    DimWrapped((document.EditsModified() ? "Edits of the map's objects. " : "") +
               (document.AnnotationModified() ? "The annotation, to " + editing_.annotation.file + "." : ""));
    ImGui::Dummy(ImVec2(0.0F, 0.4F * ImGui::GetFontSize()));
    if (ImGui::Button("Save")) {
      context_.SaveAll();
      if (!document.Modified()) {
        GoOn();
      }
    }
    ImGui::SameLine();
    if (ImGui::Button("Discard")) {
      editing_.discard = true;
      GoOn();
    }
    ImGui::SameLine();
    if (ImGui::Button("Cancel") || EscapeIsPressed()) {
      editing_.postponed.reset();
    }
  }

  void GoOn() {
    if (const auto postponed = std::exchange(editing_.postponed, std::nullopt)) {
      requests_.push_back(*postponed);
    }
  }
};

// Messages in the upper left corner of the scene, where nothing else is; the newest on top.
class MessagesPanel : public Panel {
 public:
  explicit MessagesPanel(ViewerState& s) : Panel(Place::kOver, "Messages", s) {}
  bool Wanted() const override { return !messages_.notices.empty(); }
  bool Busy() const override { return !messages_.notices.empty(); }

  void Draw() override {
    const float em = ImGui::GetFontSize();
    float top = static_cast<float>(view_.corner.y) + 0.8F * em;
    ImGui::PushStyleColor(ImGuiCol_WindowBg, ImGui::GetStyleColorVec4(ImGuiCol_PopupBg));
    ImGui::PushStyleVar(ImGuiStyleVar_WindowBorderSize, 1.0F);
    std::vector<Notice>& notices = messages_.notices;
    for (std::size_t i = 0; i < notices.size(); ++i) {
      DrawNotice(notices[notices.size() - 1 - i], "##notice" + std::to_string(i), top);
    }
    ImGui::PopStyleVar();
    ImGui::PopStyleColor();
    std::erase_if(notices, [&](Notice& notice) { return (notice.seconds_left -= window_.seconds) <= 0.0; });
  }

 private:
  void DrawNotice(Notice& notice, const std::string& id, float& top) const {
    const float em = ImGui::GetFontSize();
    ImGui::SetNextWindowPos(ImVec2(static_cast<float>(view_.corner.x) + 0.8F * em, top));
    ImGui::SetNextWindowSizeConstraints(ImVec2(0.0F, 0.0F), ImVec2(40.0F * em, 30.0F * em));
    if (ImGui::Begin(id.c_str(), nullptr,
                     ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove |
                         ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoSavedSettings |
                         ImGuiWindowFlags_NoFocusOnAppearing | ImGuiWindowFlags_NoNav)) {
      const Palette& palette = PaletteOf(window_.theme);
      ImGui::PushTextWrapPos(38.0F * em);
      ImGui::PushStyleColor(ImGuiCol_Text, notice.error ? palette.bad : palette.text);
      ImGui::TextUnformatted(((notice.error ? "Error: " : "") + notice.text).c_str());
      ImGui::PopStyleColor();
      ImGui::PopTextWrapPos();
      if (ImGui::IsWindowHovered() && ImGui::IsMouseClicked(ImGuiMouseButton_Left)) {
        notice.seconds_left = 0.0;
      }
      top += ImGui::GetWindowSize().y + 0.4F * em;
    }
    ImGui::End();
  }
};

}  // namespace

PanelPtr MakeHelpPanel(ViewerState& s) { return std::make_unique<HelpPanel>(s); }
PanelPtr MakeSettingsPanel(ViewerState& s) { return std::make_unique<SettingsPanel>(s); }
PanelPtr MakeUnsavedPanel(ViewerState& s) { return std::make_unique<UnsavedPanel>(s); }
PanelPtr MakeMessagesPanel(ViewerState& s) { return std::make_unique<MessagesPanel>(s); }

}  // namespace sqslam::viewer
