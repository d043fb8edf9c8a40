#pragma once

#include <imgui.h>

// Keys of ImGui, which became a type of their own with 1.87: Debian 12 has 1.86, Debian 13 has 1.90.
namespace sqslam::viewer {

#if IMGUI_VERSION_NUM >= 18700
inline constexpr int kUiKeypadEnter = ImGuiKey_KeypadEnter;
#else
inline constexpr int kUiKeypadEnter = ImGuiKey_KeyPadEnter;
#endif

// Returns true while the key with this code (input_events.h) is pressed.
inline bool IsKeyDown(int code) { return ImGui::IsKeyDown(static_cast<ImGuiKey>(code)); }

}  // namespace sqslam::viewer
