#include <imgui.h>
#include <imgui_stdlib.h>

#include <string>
#include <utility>
#include <vector>

#include "app/viewer/model/folder_list.h"
#include "app/viewer/panels/panels.h"
#include "app/viewer/widgets/widgets.h"

namespace sqslam::viewer {
namespace fs = std::filesystem;
namespace {

// A folder browser: opens results of runs, enters other folders.
class OpenPanel : public Panel {
 public:
  explicit OpenPanel(ViewerState& s) : Panel(Place::kOver, "Open", s) {}
  bool Wanted() const override { return window_.show_open; }

  void Draw() override {
    if (const int frame = ImGui::GetFrameCount(); std::exchange(drawn_, frame) != frame - 1) {
      Enter(FirstFolder());  // it was closed until now
    }
    Dialog("Open", 40.0F, [&] { DrawContent(); });
  }

 private:
  // Returns the folder that contains the open result or file, else the current folder.
  fs::path FirstFolder() const {
    std::error_code none;
    if (document_.file.empty()) {
      return fs::current_path(none);
    }
    const fs::path file = fs::absolute(document_.file, none).lexically_normal();
    const fs::path folder =
        file.filename() == "map.sqmap" ? file.parent_path().parent_path() : file.parent_path();
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

  void DrawContent() {
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
    if (ImGui::Button("Close")) {
      window_.show_open = false;
    }
  }

  void DrawEntries() {
    const fs::path folder = folder_;  // entering changes it
    if (folder.has_relative_path() && ImGui::Selectable("..")) {
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
      const bool chosen = ImGui::Selectable((entry.name + (enters ? "/" : "")).c_str());
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

  int drawn_ = -1;  // last frame of the window in which it was drawn
  fs::path folder_;
  std::string text_;
  std::vector<FolderEntry> entries_;
};

}  // namespace

PanelPtr MakeOpenPanel(ViewerState& s) { return std::make_unique<OpenPanel>(s); }

}  // namespace sqslam::viewer
