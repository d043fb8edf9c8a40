#include "app/viewer/panels/panels.h"

#include <algorithm>

#include "app/viewer/widgets/widgets.h"

namespace sqslam::viewer {
namespace {

constexpr double kGap = 5.0;  // between parts, at scale 1

ImVec2 Corner(const cv::Rect2d& area) { return Vec(area.x, area.y); }
ImVec2 Extent(const cv::Rect2d& area) { return Vec(area.width, area.height); }

constexpr ImGuiWindowFlags kPart = ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove |
                                   ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoBringToFrontOnFocus |
                                   ImGuiWindowFlags_NoNav;

// Draws a part of the window unless its area is empty.
void DrawPart(const char* id, const cv::Rect2d& area, bool padded, auto&& content) {
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

// A menu item that runs the shortcut with these keys.
void KeyItem(ViewerState& s, const std::string& name, const char* keys, bool enabled = true,
             bool checked = false) {
  if (MenuItem(name, keys, checked, enabled)) {
    std::ranges::find(Shortcuts(), keys, &Shortcut::keys)->run(s);
  }
}

void DrawFileMenu(ViewerState& s) {
  KeyItem(s, "Open ...", "Ctrl O");
  const std::vector<std::string>& recent = s.window.memory.recent_files;
  const auto draw_recent = [&] {
    for (const std::string& file : recent) {
      const std::filesystem::path path(file);
      // Results are shown by the name of their folder.
      if (MenuItem(path.filename() == "map.sqmap" ? path.parent_path().string() : file)) {
        s.requests.push_back(OpenRequest{path});
      }
    }
  };
  Menu("Open recent", draw_recent, !recent.empty());
  const bool has_map = s.document.Map() != nullptr;
  KeyItem(s, "Save picture", "F12", has_map);
  KeyItem(s, "Copy command of the picture", "Ctrl Shift C", has_map && !s.document.run.active);
  KeyItem(s, "Quit", "Ctrl Q");
}

void DrawEditMenu(ViewerState& s) {
  const EditedDocument& document = s.editing.document;
  const auto& history = document.History();
  KeyItem(s, "Undo " + history.UndoName(), "Ctrl Z", history.CanUndo());
  KeyItem(s, "Redo " + history.RedoName(), "Ctrl Y", history.CanRedo());
  ImGui::Separator();
  KeyItem(s, "Save edits", "Ctrl S", document.Modified());
  ImGui::Separator();
  KeyItem(s, "Delete object", "Delete", s.selection.selected.has_value());
  Menu("Show objects as", [&] {
    for (const auto& [representation, name] : {std::pair(SolidKind::kSuperquadric, "Superquadrics"),
                                               {SolidKind::kEllipsoid, "Ellipsoids"},
                                               {SolidKind::kCuboid, "Cuboids"}}) {
      if (MenuItem(name, nullptr, s.editing.representation == representation)) {
        s.editing.representation = representation;
      }
    }
  });
  ImGui::Separator();
  if (MenuItem("Settings ...")) {
    s.window.show_settings = true;
  }
}

// Returns the height of the menu bar.
double DrawMenu(ViewerState& s) {
  if (!ImGui::BeginMainMenuBar()) {
    return 0.0;
  }
  Bold("sqslam");
  ImGui::Separator();
  Menu("File", [&] { DrawFileMenu(s); });
  Menu("Edit", [&] { DrawEditMenu(s); });
  Menu("Window", [&] {
    KeyItem(s, "Image", "I", true, s.window.settings.show_image);
    KeyItem(s, "Light", "T", true, s.window.settings.theme == Theme::kLight);
  });
  Menu("Help", [&] { KeyItem(s, "Keys and mouse", "H", true, s.window.show_help); });
  const std::string title = s.document.title + (s.document.loading              ? ": loading"
                                                : s.editing.document.Modified() ? " \u2022 not saved"
                                                                                : "");
  const float width = ImGui::CalcTextSize(title.c_str()).x;
  ImGui::SetCursorPosX(ImGui::GetWindowWidth() - width - 1.2F * ImGui::GetFontSize());
  Dim(title);
  const double height = ImGui::GetWindowHeight();
  ImGui::EndMainMenuBar();
  return height;
}

void DrawTabs(std::string& to_front, const std::vector<PanelPtr>& panels) {
  const ImVec2 padding = ImGui::GetStyle().FramePadding;
  ImGui::PushStyleVar(ImGuiStyleVar_FramePadding, ImVec2(0.75F * padding.x, padding.y));
  if (ImGui::BeginTabBar("tabs")) {
    for (const PanelPtr& panel : panels) {
      const bool first = to_front == panel->title;
      if (panel->place != Place::kSide) {
        continue;
      }
      const bool open =
          ImGui::BeginTabItem(panel->title.c_str(), nullptr, first ? ImGuiTabItemFlags_SetSelected : 0);
      ReportItem(panel->title);
      if (open) {
        to_front = first ? "" : to_front;
        ImGui::PushStyleVar(ImGuiStyleVar_FramePadding, padding);
        panel->Draw();
        ImGui::PopStyleVar();
        ImGui::EndTabItem();
      }
    }
    ImGui::EndTabBar();
  }
  ImGui::PopStyleVar();
}

// Draws the dividers between the parts, each limited to a sensible range for the window.
void DrawLines(WindowState& state, const Layout& parts, cv::Size size) {
  // `length`: at scale 1, grows to the left or up (-1), or down (1); `most`: in pixels.
  const auto line = [&](const char* id, const cv::Rect2d& area, double& length, double way, double least,
                        double most) {
    const ImGuiMouseCursor cursor =
        area.width < area.height ? ImGuiMouseCursor_ResizeEW : ImGuiMouseCursor_ResizeNS;
    DrawPart(id, area, false, [&] {
      ImGui::InvisibleButton("line", Extent(area));
      if (ImGui::IsItemHovered() || ImGui::IsItemActive()) {
        ImGui::SetMouseCursor(cursor);
        ImGui::GetWindowDrawList()->AddRectFilled(Corner(area),
                                                  Vec(area.x + area.width, area.y + area.height),
                                                  ImGui::GetColorU32(ImGuiCol_SeparatorActive));
      }
      if (ImGui::IsItemActive()) {
        const ImVec2 moved = ImGui::GetIO().MouseDelta;
        const double pixels = cursor == ImGuiMouseCursor_ResizeEW ? moved.x : moved.y;
        length = std::max(least, std::min(length + way * pixels / state.scale, most / state.scale));
      }
    });
  };
  line("##side line", parts.side_line, state.memory.layout.side, -1.0, 240.0, 0.5 * size.width);
  line("##bottom line", parts.bottom_line, state.memory.layout.bottom, -1.0, 96.0, 0.4 * size.height);
  line("##top line", parts.top_line, state.memory.layout.top, 1.0, 120.0, 0.6 * size.height);
}

// Draws a text in place of the map. A failure stays until something else is opened.
void DrawWelcome(const ViewerState& s, const cv::Rect2d& scene) {
  const std::string& failure = s.document.failure;
  const std::string text = !failure.empty()        ? "The run has left no map.\n\n" + failure
                           : s.document.run.active ? "The map begins when the camera has moved sideways"
                           : s.document.loading    ? "Loading ..."
                                                : "Drop a result folder or a map.sqmap here, or File, Open";
  const auto width = static_cast<float>(0.8 * scene.width);
  const ImVec2 size = ImGui::CalcTextSize(text.c_str(), nullptr, false, width);
  const ImVec2 corner = Vec(scene.x + 0.5 * (scene.width - size.x), scene.y + 0.5 * (scene.height - size.y));
  const Palette& palette = PaletteOf(s.window.settings.theme);
  ImGui::GetWindowDrawList()->AddText(ImGui::GetFont(), ImGui::GetFontSize(), corner,
                                      failure.empty() ? palette.dim_text : palette.bad, text.c_str(), nullptr,
                                      width);
}

}  // namespace

Layout LayOut(cv::Size window, double menu_height, const LayoutSettings& settings, bool has_bottom,
              bool has_top, double scale) {
  Layout layout;
  const double width = window.width;
  const double height = window.height;
  const double gap = kGap * scale;
  const double bottom = has_bottom ? std::min(settings.bottom * scale, 0.4 * height) : 0.0;
  const double side = std::min(settings.side * scale, 0.5 * width);
  const double body_bottom = height - (has_bottom ? bottom + gap : 0.0);
  const double body = std::max(0.0, body_bottom - menu_height);
  layout.scene = {0.0, menu_height, std::max(0.0, width - side - gap), body};
  const double left = width - side;
  const double top = has_top ? std::min(settings.top * scale, 0.5 * body) : 0.0;
  layout.top = {left, menu_height, side, top};
  const double tabs = menu_height + (has_top ? top + gap : 0.0);
  layout.side = {left, tabs, side, std::max(0.0, body_bottom - tabs)};
  layout.side_line = {left - gap, menu_height, gap, body};
  if (has_bottom) {
    layout.bottom = {0.0, height - bottom, width, bottom};
    layout.bottom_line = {0.0, height - bottom - gap, width, gap};
  }
  if (has_top) {
    layout.top_line = {left, menu_height + top, side, gap};
  }
  return layout;
}

void DrawWindow(ViewerState& state, const std::vector<PanelPtr>& panels, cv::Size size) {
  const auto wanted = [&](Place place) {
    return std::ranges::any_of(
        panels, [&](const PanelPtr& panel) { return panel->place == place && panel->Wanted(); });
  };
  const auto draw = [&](Place place) {
    for (const PanelPtr& panel : panels) {
      if (panel->place == place && panel->Wanted()) {
        panel->Draw();
      }
    }
  };
  const double menu = DrawMenu(state);
  const Layout parts = LayOut(size, menu, state.window.memory.layout, wanted(Place::kBottom),
                              wanted(Place::kTop), state.window.scale);
  DrawPart("##scene", parts.scene, false, [&] {
    draw(Place::kScene);
    if (state.document.Map() == nullptr) {
      DrawWelcome(state, parts.scene);
    }
  });
  DrawPart("##top", parts.top, true, [&] { draw(Place::kTop); });
  DrawPart("##side", parts.side, true, [&] { DrawTabs(state.window.to_front, panels); });
  DrawPart("##bottom", parts.bottom, true, [&] { draw(Place::kBottom); });
  DrawLines(state.window, parts, size);
  draw(Place::kOver);
}

}  // namespace sqslam::viewer
