#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "app/viewer/model/folder_list.h"
#include "app/viewer/panels/panels.h"
#include "app/viewer/widgets/widgets.h"
#include "slam/util/data_path.h"

namespace sqslam::viewer {
namespace fs = std::filesystem;
namespace {

// Windows over all others: help, settings, opening, unsaved changes, messages.
class Dialogs : public Panel {
 public:
  explicit Dialogs(ViewerState& s) : Panel(Place::kOver, "", s) {}

  bool Busy() const override {
    return !std::ranges::all_of(messages_.notices, &Notice::error);  // errors stay until they are closed
  }

  void Draw() override {
    if (window_.show_help) {
      DrawHelp();
    }
    if (window_.show_settings) {
      Dialog("Settings", 26.0F, [&] { DrawSettings(); });
    }
    if (window_.show_open && !was_open_) {
      Enter(FirstFolder());
    }
    was_open_ = window_.show_open;
    if (window_.show_open) {
      Dialog("Open", 40.0F, [&] { DrawOpen(); });
    }
    if (editing_.postponed) {
      Dialog("Unsaved changes", 28.0F, [&] { DrawUnsaved(); });
    }
    DrawMessages();
  }

 private:
  void DrawHelp() {
    const float em = ImGui::GetFontSize();
    ImGui::PushStyleVar(ImGuiStyleVar_CellPadding, ImVec2(0.4F * em, 0.14F * em));
    const auto content = [&] {
      DrawKeys();
      ImGui::Dummy(ImVec2(0.0F, 0.3F * em));
      if (Button("Close (H)")) {
        window_.show_help = false;
      }
    };
    Dialog("Keys and mouse", 58.0F, content, ImGuiWindowFlags_NoNav);
    ImGui::PopStyleVar();
  }

  using Line = std::pair<std::string, std::string>;  // keys, their action

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

  void DrawKeys() const {
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
    constexpr std::size_t kKeysBesideMouse = 12;
    std::vector<Line> work, rest;
    const std::vector<Shortcut>& keys = Shortcuts();
    for (std::size_t i = 0; i < keys.size(); ++i) {
      (i + kKeysBesideMouse < keys.size() ? rest : work).emplace_back(keys[i].keys, keys[i].help);
    }
    work.emplace_back("drop a file", "open a result, a .ply as dense cloud");
    Heading("Work and files");
    DrawLines("more keys", work);
    ImGui::TableNextColumn();
    Heading("Time, view, pictures");
    DrawLines("keys", rest);
    ImGui::EndTable();
  }

  void DrawSettings() {
    window_.settings.style = view_.style_name;  // keys and the view panel may have changed it
    ViewerSettings& settings = window_.settings;
    Heading("Settings");
    std::string theme = NameOf(settings.theme);
    bool changed = Choice("theme", theme, AllNames<Theme>(), 12.0F);
    settings.theme = FromName<Theme>(theme).value_or(settings.theme);
    changed |= Choice("scene style", settings.style, styles_, 12.0F);
    changed |= Checkbox("input image beside the map", settings.show_image);
    changed |= Slide("letters", settings.font_size, 10.0, 28.0, "%.0f px", 12.0F);
    Tip("Height of the letters; from the next start on");
    if (changed) {
      messages_.Try([&] {
        if (settings.style != view_.style_name) {
          view_.UseStyle(settings.style);
        }
        Save(settings);
      });
    }
    const float em = ImGui::GetFontSize();
    ImGui::Dummy(ImVec2(0.0F, 0.4F * em));
    DimWrapped(settings.kept_in.empty() ? "Not kept after this session."
                                        : "Kept in " + settings.kept_in.string());
    ImGui::Dummy(ImVec2(0.0F, 0.3F * em));
    if (Button("Close")) {
      window_.show_settings = false;
    }
  }

  void DrawUnsaved() {
    const EditedDocument& document = editing_.document;
    Heading("There are unsaved changes");
    DimWrapped((document.EditsModified() ? "Edits of the map's objects. " : "") +
               (document.AnnotationModified() ? "The annotation, to " + editing_.annotation.file + "." : ""));
    ImGui::Dummy(ImVec2(0.0F, 0.4F * ImGui::GetFontSize()));
    if (Button("Save")) {
      context_.SaveAll();
      if (!document.Modified()) {
        Proceed();
      }
    }
    ImGui::SameLine();
    if (Button("Discard")) {
      editing_.discard = true;
      Proceed();
    }
    ImGui::SameLine();
    if (Button("Cancel")) {
      editing_.postponed.reset();
    }
  }

  void Proceed() {
    if (const auto postponed = std::exchange(editing_.postponed, std::nullopt)) {
      requests_.push_back(*postponed);
    }
  }

  // Messages in the upper left corner of the scene, the newest on top.
  void DrawMessages() {
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
    std::erase_if(notices, [&](Notice& notice) {
      notice.seconds_left -= notice.error ? 0.0 : window_.seconds;
      return notice.seconds_left <= 0.0;
    });
  }

  void DrawNotice(Notice& notice, const std::string& id, float& top) const {
    const float em = ImGui::GetFontSize();
    ImGui::SetNextWindowPos(ImVec2(static_cast<float>(view_.corner.x) + 0.8F * em, top));
    ImGui::SetNextWindowSizeConstraints(ImVec2(0.0F, 0.0F), ImVec2(40.0F * em, 30.0F * em));
    if (ImGui::Begin(id.c_str(), nullptr,
                     ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove |
                         ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoSavedSettings |
                         ImGuiWindowFlags_NoFocusOnAppearing | ImGuiWindowFlags_NoNav)) {
      const Palette& palette = PaletteOf(window_.settings.theme);
      ImGui::PushTextWrapPos(38.0F * em);
      ImGui::PushStyleColor(ImGuiCol_Text, notice.error ? palette.bad : palette.text);
      ImGui::TextUnformatted(((notice.error ? "Error: " : "") + notice.text).c_str());
      ImGui::PopStyleColor();
      ImGui::PopTextWrapPos();
      if (notice.error) {
        Dim("a click or Escape closes this");
      }
      if (ImGui::IsWindowHovered() && ImGui::IsMouseClicked(ImGuiMouseButton_Left)) {
        notice.seconds_left = 0.0;
      }
      top += ImGui::GetWindowSize().y + 0.4F * em;
    }
    ImGui::End();
  }

  // Returns the folder that contains the open result or file, else the current folder.
  fs::path FirstFolder() const {
    std::error_code none;
    if (document_.file.empty()) {
      return fs::current_path(none);
    }
    const fs::path parent = document_.file.parent_path();
    const fs::path folder = document_.file.filename() == "map.sqmap" ? parent.parent_path() : parent;
    return fs::is_directory(folder, none) ? folder : fs::current_path(none);
  }

  void Enter(const fs::path& folder) {
    folder_ = folder;
    text_ = folder.string();
    entries_ = ListFolder(folder);
  }

  void Take(const fs::path& path) {
    requests_.push_back(OpenRequest{path});
    window_.show_open = false;
  }

  void DrawOpen() {
    const float em = ImGui::GetFontSize();
    Heading("Open a result");
    ImGui::SetNextItemWidth(-1.0F);
    if (ImGui::InputText("##folder", &text_, ImGuiInputTextFlags_EnterReturnsTrue) && !text_.empty()) {
      std::error_code none;
      const bool enters = KindOf(text_) == FolderEntry::Kind::kFolder;
      enters ? Enter(fs::absolute(text_, none)) : Take(text_);
    }
    Tip("A folder, a result or a file; Enter goes there or opens it");
    ImGui::BeginChild("entries", ImVec2(0.0F, 18.0F * em), true);
    DrawEntries();
    ImGui::EndChild();
    if (Button("Close")) {
      window_.show_open = false;
    }
  }

  void DrawEntries() {
    const fs::path folder = folder_;  // entering changes it
    if (folder.has_relative_path() && Selectable("..")) {
      Enter(folder.parent_path());
      return;
    }
    if (entries_.empty()) {
      ImGui::TextDisabled("Nothing here can be opened.");
    }
    for (const FolderEntry& entry : entries_) {
      const bool enters = entry.kind == FolderEntry::Kind::kFolder;
      ImGui::PushStyleColor(ImGuiCol_Text,
                            ImGui::GetStyleColorVec4(enters ? ImGuiCol_TextDisabled : ImGuiCol_Text));
      const bool chosen = Selectable(entry.name + (enters ? "/" : ""));
      ImGui::PopStyleColor();
      if (entry.kind == FolderEntry::Kind::kResult) {
        ImGui::SameLine(0.0F, 1.2F * ImGui::GetFontSize());
        Dim("result");
      }
      if (chosen) {
        const fs::path path = entry.path;
        enters ? Enter(path) : Take(path);
        return;
      }
    }
  }

  const std::vector<std::string> styles_ = ConfigNames("configs/styles");
  // The folder browser.
  bool was_open_ = false;
  fs::path folder_;
  std::string text_;
  std::vector<FolderEntry> entries_;
};

}  // namespace

PanelPtr MakeDialogs(ViewerState& s) { return std::make_unique<Dialogs>(s); }

}  // namespace sqslam::viewer
