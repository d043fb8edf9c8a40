#include <filesystem>
#include <initializer_list>
#include <string>

#include "app/viewer/widgets/widgets.h"

namespace sqslam::viewer {
namespace {

constexpr float kTextSize = 15.0F;  // pixels at scale 1

void LoadFont(const char* name, float size) {
  const std::string file = std::string("/usr/share/fonts/truetype/dejavu/") + name + ".ttf";
  ImGuiIO& io = ImGui::GetIO();
  ImFontConfig config;
  config.OversampleH = 3;
  config.OversampleV = 1;
  config.PixelSnapH = true;
  static const ImWchar kRanges[] = {0x20,   0xFF,   0x100,  0x17F,  0x370,  0x3FF,  0x2010, 0x203A,
                                    0x2190, 0x21FF, 0x2212, 0x2212, 0x25A0, 0x25FF, 0};
  if (std::filesystem::exists(file)) {
    io.Fonts->AddFontFromFileTTF(file.c_str(), size, &config, kRanges);
    return;
  }
  config.SizePixels = size;
  io.Fonts->AddFontDefault(&config);
}

ImVec4 Color(unsigned rgb, float alpha = 1.0F) {
  return {static_cast<float>((rgb >> 16) & 255U) / 255.0F, static_cast<float>((rgb >> 8) & 255U) / 255.0F,
          static_cast<float>(rgb & 255U) / 255.0F, alpha};
}

ImU32 PackedRgb(unsigned rgb, float alpha = 1.0F) {
  return ImGui::ColorConvertFloat4ToU32(Color(rgb, alpha));
}

// Colours of surfaces from back to front, and of the text and marks on them.
struct Shades {
  unsigned window, panel, field, hovered, active, border, text, dim, accent;
};
constexpr Shades kDark = {0x14171c, 0x1b1f26, 0x262c36, 0x313947, 0x3d4757,
                          0x2b323d, 0xe4e8ee, 0x98a3b3, 0x56b4e9};
constexpr Shades kLight = {0xe9ecf0, 0xf7f8fa, 0xe7eaef, 0xdbe0e8, 0xcdd4de,
                           0xd2d8e0, 0x1c2530, 0x5c6876, 0x0072b2};

void ApplyColors(const Shades& s) {
  const auto paint = [](const ImVec4& color, std::initializer_list<ImGuiCol> parts) {
    for (const ImGuiCol part : parts) {
      ImGui::GetStyle().Colors[part] = color;
    }
  };
  paint(Color(s.text), {ImGuiCol_Text});
  paint(Color(s.text, 0.03F), {ImGuiCol_TableRowBgAlt});
  paint(Color(s.dim), {ImGuiCol_TextDisabled, ImGuiCol_ScrollbarGrabHovered, ImGuiCol_ScrollbarGrabActive});
  paint(Color(s.window), {ImGuiCol_TitleBg, ImGuiCol_TitleBgActive, ImGuiCol_MenuBarBg});
  paint(Color(s.panel), {ImGuiCol_WindowBg, ImGuiCol_Tab, ImGuiCol_TabUnfocused});
  paint(Color(s.panel, 0.0F), {ImGuiCol_ChildBg, ImGuiCol_ScrollbarBg});
  paint(Color(s.panel, 0.98F), {ImGuiCol_PopupBg});
  paint(Color(s.border),
        {ImGuiCol_Border, ImGuiCol_Separator, ImGuiCol_TableBorderStrong, ImGuiCol_TableBorderLight});
  paint(Color(s.field), {ImGuiCol_FrameBg, ImGuiCol_Button, ImGuiCol_TabActive, ImGuiCol_TabUnfocusedActive,
                         ImGuiCol_TableHeaderBg});
  paint(Color(s.hovered), {ImGuiCol_FrameBgHovered, ImGuiCol_ButtonHovered, ImGuiCol_TabHovered});
  paint(Color(s.active), {ImGuiCol_FrameBgActive, ImGuiCol_ButtonActive, ImGuiCol_ScrollbarGrab});
  paint(Color(s.accent),
        {ImGuiCol_CheckMark, ImGuiCol_SliderGrab, ImGuiCol_SliderGrabActive, ImGuiCol_SeparatorHovered,
         ImGuiCol_SeparatorActive, ImGuiCol_PlotHistogram, ImGuiCol_NavHighlight});
  paint(Color(s.accent, 0.18F), {ImGuiCol_HeaderHovered});
  paint(Color(s.accent, 0.28F), {ImGuiCol_Header});
  paint(Color(s.accent, 0.35F), {ImGuiCol_HeaderActive, ImGuiCol_TextSelectedBg});
  paint(Color(0x000000, 0.0F), {ImGuiCol_BorderShadow});
  paint(Color(0x000000, 0.45F), {ImGuiCol_ModalWindowDimBg});
}

Palette MakePalette(const Shades& s, bool dark) {
  return {PackedRgb(s.accent),
          PackedRgb(s.text),
          PackedRgb(s.dim),
          PackedRgb(dark ? 0x3fc9a0 : 0x00795a),
          PackedRgb(dark ? 0xff8a5c : 0xb84a00),
          PackedRgb(dark ? 0x56b4e9 : 0x0072b2),
          PackedRgb(dark ? 0xe69f00 : 0xb87a00),
          PackedRgb(dark ? 0xcc79a7 : 0xa8487f),
          PackedRgb(s.panel, 0.94F)};
}

}  // namespace

void LoadFonts(double scale) {
  const float size = kTextSize * static_cast<float>(scale);
  LoadFont("DejaVuSans", size);
  LoadFont("DejaVuSans-Bold", size);
}

void ApplyTheme(Theme theme, double scale) {
  ImGuiStyle& style = ImGui::GetStyle();
  style = ImGuiStyle();
  style.WindowPadding = ImVec2(12.0F, 10.0F);
  style.FramePadding = ImVec2(9.0F, 5.0F);
  style.ItemSpacing = ImVec2(8.0F, 7.0F);
  style.ItemInnerSpacing = ImVec2(7.0F, 5.0F);
  style.CellPadding = ImVec2(6.0F, 4.0F);
  style.ScrollbarSize = 11.0F;
  style.GrabMinSize = 12.0F;
  style.WindowRounding = 8.0F;
  style.ChildRounding = 6.0F;
  style.FrameRounding = 5.0F;
  style.PopupRounding = 6.0F;
  style.ScrollbarRounding = 6.0F;
  style.GrabRounding = 5.0F;
  style.TabRounding = 5.0F;
  style.WindowBorderSize = 0.0F;
  style.PopupBorderSize = 1.0F;
  style.FrameBorderSize = 0.0F;
  style.ScaleAllSizes(static_cast<float>(scale));
  ApplyColors(theme == Theme::kDark ? kDark : kLight);
}

const Palette& PaletteOf(Theme theme) {
  static const Palette kDarkPalette = MakePalette(kDark, true);
  static const Palette kLightPalette = MakePalette(kLight, false);
  return theme == Theme::kDark ? kDarkPalette : kLightPalette;
}

}  // namespace sqslam::viewer
