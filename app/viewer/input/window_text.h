#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

struct ImDrawData;

namespace sqslam::viewer {

// A piece of text in the window, in one font and on one line.
struct WindowText {
  std::string text;            // UTF-8
  double x = 0.0, y = 0.0;     // its middle, pixels
  double left = 0.0, pen = 0;  // its first edge, and where its next letter would begin
};

// Reads back the texts that the panels have drawn; those out of sight in a scrolled panel are left out.
std::vector<WindowText> TextsOf(const ImDrawData& drawn);

// Finds a text in the frame drawn last, as scripts name what they click on: "cup 3", or "cup*" for one that
// begins so. Of several it is the uppermost, then the leftmost.
std::optional<WindowText> FindText(std::string_view text);

}  // namespace sqslam::viewer
