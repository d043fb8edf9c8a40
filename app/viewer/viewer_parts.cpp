#include "app/viewer/panels/edit_menu.h"
#include "app/viewer/viewer_impl.h"

// How the window is made of its panels.
namespace sqslam::viewer {
namespace {

ImVec2 Corner(const cv::Rect2d& area) { return {static_cast<float>(area.x), static_cast<float>(area.y)}; }
ImVec2 Extent(const cv::Rect2d& area) {
  return {static_cast<float>(area.width), static_cast<float>(area.height)};
}

constexpr ImGuiWindowFlags kPart = ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove |
                                   ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoBringToFrontOnFocus |
                                   ImGuiWindowFlags_NoNav;

// Draws a part of the window; false where it has no place.
template <typename Content>
void DrawPart(const char* id, const cv::Rect2d& area, bool padded, Content&& content) {
  if (area.width < 1.0 || area.height < 1.0) {
    return;
  }
  ImGui::SetNextWindowPos(Corner(area));
  ImGui::SetNextWindowSize(Extent(area));
  ImGui::PushStyleVar(ImGuiStyleVar_WindowRounding, 0.0F);
  if (!padded) {
    ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, ImVec2(0.0F, 0.0F));
  }
  ImGui::PushStyleVar(ImGuiStyleVar_WindowMinSize, ImVec2(1.0F, 1.0F));
  ImGui::Begin(id, nullptr, kPart | (padded ? 0 : ImGuiWindowFlags_NoScrollWithMouse));
  ImGui::PopStyleVar(padded ? 2 : 3);
  content();
  ImGui::End();
}

}  // namespace

void Viewer::Impl::DrawMenu(double& height) {
  if (ImGui::BeginMainMenuBar()) {
    ImGui::PushFont(ImGui::GetIO().Fonts->Fonts[std::min(1, ImGui::GetIO().Fonts->Fonts.Size - 1)]);
    ImGui::TextUnformatted("sqslam");
    ImGui::PopFont();
    ImGui::Separator();
    if (ImGui::BeginMenu("File")) {
      DrawRecentFiles(state);
      if (ImGui::MenuItem("Save picture", "F12", false, state.Map() != nullptr)) {
        state.Ask(state.screenshot);
      }
      const bool drawable = state.Map() != nullptr && !state.run.active;
      if (ImGui::MenuItem("Copy command of the picture", "Ctrl Shift C", false, drawable)) {
        CopyCommand(state);
      }
      if (ImGui::MenuItem("Quit", "Ctrl Q")) {
        state.Ask(QuitRequest{});
      }
      ImGui::EndMenu();
    }
    DrawEditMenu(state);
    if (ImGui::BeginMenu("Window")) {
      ImGui::MenuItem("Image", "I", &state.show_image);
      if (ImGui::MenuItem("Light", "T", state.theme == Theme::kLight)) {
        SwitchTheme(state);
      }
      ImGui::EndMenu();
    }
    if (ImGui::BeginMenu("Help")) {
      ImGui::MenuItem("Keys and mouse", "H", &state.show_help);
      ImGui::EndMenu();
    }
    const std::string title = state.document.loading              ? state.document.title + ": loading"
                              : state.editing.document.Modified() ? state.document.title + " \u2022 not saved"
                                                                  : state.document.title;
    const float width = ImGui::CalcTextSize(title.c_str()).x;
    ImGui::SetCursorPosX(ImGui::GetWindowWidth() - width - 1.2F * ImGui::GetFontSize());
    ImGui::TextDisabled("%s", title.c_str());
    height = ImGui::GetWindowHeight();
    ImGui::EndMainMenuBar();
  }
}

void Viewer::Impl::DrawSide(const Layout& parts) {
  DrawPart("##side", parts.side, true, [&] {
    const ImVec2 padding = ImGui::GetStyle().FramePadding;
    ImGui::PushStyleVar(ImGuiStyleVar_FramePadding, ImVec2(0.75F * padding.x, padding.y));
    const bool open = ImGui::BeginTabBar("tabs");
    if (open) {
      ForEach(Place::kSide, [&](Panel& panel) {
        const std::string title = panel.Title();
        const bool to_front = state.to_front == title;
        if (ImGui::BeginTabItem(title.c_str(), nullptr, to_front ? ImGuiTabItemFlags_SetSelected : 0)) {
          if (to_front) {
            state.to_front.clear();
          }
          ImGui::PushStyleVar(ImGuiStyleVar_FramePadding, padding);
          panel.Draw(state);
          ImGui::PopStyleVar();
          ImGui::EndTabItem();
        }
      });
      ImGui::EndTabBar();
    }
    ImGui::PopStyleVar();
  });
}

void Viewer::Impl::DrawLines(const Layout& parts) {
  const auto line = [&](const char* id, const cv::Rect2d& area, ImGuiMouseCursor cursor, auto move) {
    DrawPart(id, area, false, [&] {
      ImGui::InvisibleButton("line", Extent(area));
      if (ImGui::IsItemHovered() || ImGui::IsItemActive()) {
        ImGui::SetMouseCursor(cursor);
        ImGui::GetWindowDrawList()->AddRectFilled(
            Corner(area),
            ImVec2(static_cast<float>(area.x + area.width), static_cast<float>(area.y + area.height)),
            ImGui::GetColorU32(ImGuiCol_SeparatorActive));
      }
      if (ImGui::IsItemActive()) {
        layout = move(ImGui::GetIO().MouseDelta);
      }
    });
  };
  const double scale = state.ui_scale;
  line("##side line", parts.side_line, ImGuiMouseCursor_ResizeEW,
       [&](ImVec2 d) { return MoveSide(layout, d.x, window, scale); });
  line("##bottom line", parts.bottom_line, ImGuiMouseCursor_ResizeNS,
       [&](ImVec2 d) { return MoveBottom(layout, d.y, window, scale); });
  line("##top line", parts.top_line, ImGuiMouseCursor_ResizeNS,
       [&](ImVec2 d) { return MoveTop(layout, d.y, window, scale); });
}

void Viewer::Impl::DrawWelcome(const Layout& parts) {
  const char* text = state.run.active         ? "The map begins when the camera has moved sideways"
                     : state.document.loading ? "Loading ..."
                                              : "Drop a result folder or a map.sqmap here";
  const ImVec2 size = ImGui::CalcTextSize(text);
  const ImVec2 middle(static_cast<float>(parts.scene.x + 0.5 * parts.scene.width) - 0.5F * size.x,
                      static_cast<float>(parts.scene.y + 0.5 * parts.scene.height) - 0.5F * size.y);
  ImGui::GetWindowDrawList()->AddText(middle, PaletteOf(state.theme).dim_text, text);
}

void Viewer::Impl::DrawPanels() {
  double menu = 0.0;
  DrawMenu(menu);
  const Layout parts =
      LayOut(window, menu, layout, Wanted(Place::kBottom), Wanted(Place::kTop), state.ui_scale);
  DrawPart("##scene", parts.scene, false, [&] {
    ForEach(Place::kScene, [&](Panel& p) { p.Draw(state); });
    if (state.Map() == nullptr) {
      DrawWelcome(parts);
    }
  });
  DrawPart("##top", parts.top, true, [&] { ForEach(Place::kTop, [&](Panel& p) { p.Draw(state); }); });
  DrawSide(parts);
  DrawPart("##bottom", parts.bottom, true,
           [&] { ForEach(Place::kBottom, [&](Panel& p) { p.Draw(state); }); });
  DrawLines(parts);
  ForEach(Place::kOver, [&](Panel& panel) { panel.Draw(state); });
}

}  // namespace sqslam::viewer
