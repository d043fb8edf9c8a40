#include "app/viewer/input/ui_input.h"

#include <imgui.h>

#include <array>
#include <utility>

namespace sqslam::viewer {

void SetUpUiKeys() {
  constexpr std::array<std::pair<int, int>, 22> kKeys = {{{ImGuiKey_Tab, key::kTab},
                                                          {ImGuiKey_LeftArrow, key::kLeft},
                                                          {ImGuiKey_RightArrow, key::kRight},
                                                          {ImGuiKey_UpArrow, key::kUp},
                                                          {ImGuiKey_DownArrow, key::kDown},
                                                          {ImGuiKey_PageUp, key::kPageUp},
                                                          {ImGuiKey_PageDown, key::kPageDown},
                                                          {ImGuiKey_Home, key::kHome},
                                                          {ImGuiKey_End, key::kEnd},
                                                          {ImGuiKey_Insert, key::kInsert},
                                                          {ImGuiKey_Delete, key::kDelete},
                                                          {ImGuiKey_Backspace, key::kBackspace},
                                                          {ImGuiKey_Space, key::kSpace},
                                                          {ImGuiKey_Enter, key::kEnter},
                                                          {ImGuiKey_Escape, key::kEscape},
                                                          {ImGuiKey_KeyPadEnter, key::kKeypadEnter},
                                                          {ImGuiKey_A, 'A'},
                                                          {ImGuiKey_C, 'C'},
                                                          {ImGuiKey_V, 'V'},
                                                          {ImGuiKey_X, 'X'},
                                                          {ImGuiKey_Y, 'Y'},
                                                          {ImGuiKey_Z, 'Z'}}};
  ImGuiIO& io = ImGui::GetIO();
  for (const auto& [ui, ours] : kKeys) {
    io.KeyMap[ui] = ours;
  }
}

void ApplyToUi(const InputEvent& event) {
  using Kind = InputEvent::Kind;
  ImGuiIO& io = ImGui::GetIO();
  switch (event.kind) {
    case Kind::kMove:
      io.MousePos = ImVec2(static_cast<float>(event.x), static_cast<float>(event.y));
      break;
    case Kind::kPress:
    case Kind::kRelease:
      io.MouseDown[event.code] = event.kind == Kind::kPress;
      break;
    case Kind::kWheel:
      io.MouseWheelH += static_cast<float>(event.x);
      io.MouseWheel += static_cast<float>(event.y);
      break;
    case Kind::kKeyDown:
    case Kind::kKeyUp:
      if (event.code >= 0 && event.code < 512) {
        io.KeysDown[event.code] = event.kind == Kind::kKeyDown;
      }
      io.KeyShift = io.KeysDown[key::kLeftShift] || io.KeysDown[key::kRightShift];
      io.KeyCtrl = io.KeysDown[key::kLeftControl] || io.KeysDown[key::kRightControl];
      io.KeyAlt = io.KeysDown[key::kLeftAlt] || io.KeysDown[key::kRightAlt];
      break;
    case Kind::kText:
      io.AddInputCharactersUTF8(event.text.c_str());
      break;
    case Kind::kResize:
      io.DisplaySize = ImVec2(static_cast<float>(event.x), static_cast<float>(event.y));
      break;
    case Kind::kFocus:
      io.AddFocusEvent(event.code != 0);
      if (event.code == 0) {  // what is released elsewhere is never told
        std::fill(std::begin(io.KeysDown), std::end(io.KeysDown), false);
        std::fill(std::begin(io.MouseDown), std::end(io.MouseDown), false);
        io.KeyShift = io.KeyCtrl = io.KeyAlt = false;
      }
      break;
    case Kind::kDrop:
    case Kind::kClose:
      break;
  }
}

}  // namespace sqslam::viewer
