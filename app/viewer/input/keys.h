#pragma once

#include <string>

// Keys by number. The numbers are GLFW's, so that no table is needed in the window.
namespace sqslam::viewer {

namespace key {
inline constexpr int kSpace = 32;
inline constexpr int kEscape = 256;
inline constexpr int kEnter = 257;
inline constexpr int kTab = 258;
inline constexpr int kBackspace = 259;
inline constexpr int kInsert = 260;
inline constexpr int kDelete = 261;
inline constexpr int kRight = 262;
inline constexpr int kLeft = 263;
inline constexpr int kDown = 264;
inline constexpr int kUp = 265;
inline constexpr int kPageUp = 266;
inline constexpr int kPageDown = 267;
inline constexpr int kHome = 268;
inline constexpr int kEnd = 269;
inline constexpr int kF1 = 290;
inline constexpr int kF12 = 301;
inline constexpr int kKeypad0 = 320;
inline constexpr int kKeypad9 = 329;
inline constexpr int kKeypadEnter = 335;
inline constexpr int kLeftShift = 340;
inline constexpr int kLeftControl = 341;
inline constexpr int kLeftAlt = 342;
inline constexpr int kRightShift = 344;
inline constexpr int kRightControl = 345;
inline constexpr int kRightAlt = 346;
}  // namespace key

// "Space", "F12", "A", "7", "Left"; empty for a key without a name, -1 for a name without a key.
std::string KeyName(int code);
int KeyCode(const std::string& name);

}  // namespace sqslam::viewer
