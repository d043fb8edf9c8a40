#include <imgui.h>

#include <algorithm>
#include <string>
#include <vector>

#include "app/viewer/panels/panels.h"
#include "app/viewer/state/shortcuts.h"
#include "app/viewer/widgets/widgets.h"

namespace sqslam::viewer {
namespace {

class HelpPanel : public Panel {
 public:
  Place Where() const override { return Place::kOver; }
  std::string Title() const override { return "Keys and mouse"; }
  bool Wanted(const ViewerState& state) const override { return state.show_help; }

  void Draw(ViewerState& state) override {
    const ImVec2 window = ImGui::GetIO().DisplaySize;
    const float em = ImGui::GetFontSize();
    ImGui::SetNextWindowPos(ImVec2(0.5F * window.x, 0.5F * window.y), ImGuiCond_Always, ImVec2(0.5F, 0.5F));
    ImGui::SetNextWindowSize(ImVec2(std::min(58.0F * em, 0.96F * window.x), 0.0F));
    ImGui::PushStyleColor(ImGuiCol_WindowBg, ImGui::GetStyleColorVec4(ImGuiCol_PopupBg));
    ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, ImVec2(1.6F * em, 1.2F * em));
    ImGui::PushStyleVar(ImGuiStyleVar_WindowBorderSize, 1.0F);
    ImGui::PushStyleVar(ImGuiStyleVar_CellPadding, ImVec2(0.4F * em, 0.14F * em));
    if (ImGui::Begin("Keys and mouse", nullptr,
                     ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove |
                         ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoNav)) {
      DrawColumns();
      ImGui::Dummy(ImVec2(0.0F, 0.3F * em));
      if (ImGui::Button("Close (H)")) {
        state.show_help = false;
      }
    }
    ImGui::End();
    ImGui::PopStyleVar(3);
    ImGui::PopStyleColor();
  }

 private:
  static void Line(const char* keys, const char* what) {
    ImGui::TableNextRow();
    ImGui::TableNextColumn();
    ImGui::PushStyleColor(ImGuiCol_Text, ImGui::GetStyleColorVec4(ImGuiCol_CheckMark));
    ImGui::TextUnformatted(keys);
    ImGui::PopStyleColor();
    ImGui::TableNextColumn();
    ImGui::TextUnformatted(what);
  }

  static bool BeginLines(const char* id) {
    const bool open = ImGui::BeginTable(id, 2, ImGuiTableFlags_None);
    if (open) {
      ImGui::TableSetupColumn("keys", ImGuiTableColumnFlags_WidthFixed, 9.0F * ImGui::GetFontSize());
      ImGui::TableSetupColumn("what", ImGuiTableColumnFlags_WidthStretch);
    }
    return open;
  }

  static void DrawColumns() {
    if (!ImGui::BeginTable("columns", 2)) {
      return;
    }
    ImGui::TableNextColumn();
    Heading("Mouse in the map");
    if (BeginLines("mouse")) {
      Line("drag", "turn about the middle");
      Line("Shift drag", "move (or middle button)");
      Line("right drag", "look around");
      Line("wheel", "nearer, farther, to the mouse");
      Line("click", "select an object");
      Line("double click", "bring it to the middle");
      Line("W A S D  Q E", "fly; faster with Shift");
      ImGui::EndTable();
    }
    // The keys fill both columns evenly.
    constexpr std::size_t kBesideMouse = 12;
    const std::vector<Shortcut>& all = Shortcuts();
    const std::size_t split = all.size() - std::min(kBesideMouse, all.size());
    Heading("Work and files");
    Keys("more keys", all, split, all.size());
    ImGui::TableNextColumn();
    Heading("Time, view, pictures");
    Keys("keys", all, 0, split);
    ImGui::EndTable();
  }

  static void Keys(const char* id, const std::vector<Shortcut>& all, std::size_t first, std::size_t end) {
    if (!BeginLines(id)) {
      return;
    }
    for (std::size_t i = first; i < end; ++i) {
      Line(all[i].keys.c_str(), all[i].what.c_str());
    }
    if (end == all.size()) {
      Line("drop a file", "open a result, a .ply as dense cloud");
    }
    ImGui::EndTable();
  }
};

// Messages in the upper left corner of the scene, where nothing else is; the newest on top.
class NoticesPanel : public Panel {
 public:
  Place Where() const override { return Place::kOver; }
  std::string Title() const override { return "Messages"; }
  bool Wanted(const ViewerState& state) const override { return !state.notices.empty(); }
  bool Busy() const override { return busy_; }

  void Draw(ViewerState& state) override {
    const Palette& palette = PaletteOf(state.theme);
    const float em = ImGui::GetFontSize();
    const float left = static_cast<float>(state.scene_corner.x) + 0.8F * em;
    float top = static_cast<float>(state.scene_corner.y) + 0.8F * em;
    int number = 0;
    for (auto it = state.notices.rbegin(); it != state.notices.rend(); ++it, ++number) {
      ImGui::SetNextWindowPos(ImVec2(left, top));
      ImGui::SetNextWindowSizeConstraints(ImVec2(0.0F, 0.0F), ImVec2(40.0F * em, 30.0F * em));
      ImGui::PushStyleColor(ImGuiCol_WindowBg, ImGui::GetStyleColorVec4(ImGuiCol_PopupBg));
      ImGui::PushStyleVar(ImGuiStyleVar_WindowBorderSize, 1.0F);
      const std::string id = "##notice" + std::to_string(number);
      if (ImGui::Begin(id.c_str(), nullptr,
                       ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove |
                           ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoSavedSettings |
                           ImGuiWindowFlags_NoFocusOnAppearing | ImGuiWindowFlags_NoNav)) {
        ImGui::PushTextWrapPos(38.0F * em);
        ImGui::PushStyleColor(ImGuiCol_Text, it->error ? palette.bad : palette.text);
        ImGui::TextUnformatted(it->error ? ("Error: " + it->text).c_str() : it->text.c_str());
        ImGui::PopStyleColor();
        ImGui::PopTextWrapPos();
        if (ImGui::IsWindowHovered() && ImGui::IsMouseClicked(ImGuiMouseButton_Left)) {
          it->seconds_left = 0.0;
        }
        top += ImGui::GetWindowSize().y + 0.4F * em;
      }
      ImGui::End();
      ImGui::PopStyleVar();
      ImGui::PopStyleColor();
    }
    for (Notice& notice : state.notices) {
      notice.seconds_left -= state.seconds;
    }
    std::erase_if(state.notices, [](const Notice& notice) { return notice.seconds_left <= 0.0; });
    busy_ = !state.notices.empty();
  }

 private:
  bool busy_ = false;
};

}  // namespace

PanelPtr MakeHelpPanel() { return std::make_unique<HelpPanel>(); }
PanelPtr MakeNoticesPanel() { return std::make_unique<NoticesPanel>(); }

}  // namespace sqslam::viewer
