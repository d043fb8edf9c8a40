#include "app/viewer/input/window_text.h"

#include <imgui.h>
#include <imgui_internal.h>

#include <array>
#include <cmath>
#include <map>
#include <tuple>

namespace sqslam::viewer {
namespace {

struct Letter {
  const ImFont* font = nullptr;
  const ImFontGlyph* glyph = nullptr;
};

// The letters of all fonts by their place in the fonts' texture, which vertices keep exactly.
using Letters = std::map<std::array<float, 4>, Letter>;

Letters KnownLetters() {
  Letters letters;
  for (const ImFont* font : ImGui::GetIO().Fonts->Fonts) {
    for (const ImFontGlyph& glyph : font->Glyphs) {
      if (glyph.Visible != 0) {
        letters[{glyph.U0, glyph.V0, glyph.U1, glyph.V1}] = {font, &glyph};
      }
    }
  }
  return letters;
}

// Joins letters, in the order of drawing, to texts.
class TextJoiner {
 public:
  void Add(const Letter& letter, const ImDrawVert& corner, const ImDrawVert& opposite,
           const ImVec4& visible) {
    const ImFontGlyph& glyph = *letter.glyph;
    const double scale = (opposite.pos.x - corner.pos.x) / (glyph.X1 - glyph.X0);
    const double pen = corner.pos.x - scale * glyph.X0;
    const double line = corner.pos.y - scale * glyph.Y0;
    const double blank = scale * letter.font->GetCharAdvance(' ');
    const double gap = texts_.empty() ? 0.0 : pen - texts_.back().pen;
    const bool spaced = std::abs(gap - blank) < 0.5;
    const bool same_line = font_ == letter.font && std::abs(line - line_) < 0.5;
    if (texts_.empty() || !same_line || (std::abs(gap) > 0.5 && !spaced)) {
      texts_.emplace_back().left = pen;
      visible_.push_back(visible);
      font_ = letter.font;
      line_ = line;
    } else if (spaced) {
      texts_.back().text += ' ';
    }
    std::array<char, 5> utf8{};
    WindowText& text = texts_.back();
    text.text += ImTextCharToUtf8(utf8.data(), glyph.Codepoint);
    text.pen = pen + scale * glyph.AdvanceX;
    text.x = 0.5 * (text.left + text.pen);
    text.y = line + 0.5 * scale * letter.font->FontSize;
  }

  std::vector<WindowText> Visible() const {
    std::vector<WindowText> texts;
    for (std::size_t i = 0; i < texts_.size(); ++i) {
      const WindowText& text = texts_[i];
      const ImVec4& part = visible_[i];
      if (text.x > part.x && text.y > part.y && text.x < part.z && text.y < part.w) {
        texts.push_back(text);
      }
    }
    return texts;
  }

 private:
  std::vector<WindowText> texts_;
  std::vector<ImVec4> visible_;  // part of the window to which each is clipped
  const ImFont* font_ = nullptr;
  double line_ = 0.0;
};

}  // namespace

std::vector<WindowText> TextsOf(const ImDrawData& drawn) {
  const Letters letters = KnownLetters();
  TextJoiner joiner;
  for (int i = 0; i < drawn.CmdListsCount; ++i) {
    const ImDrawList& list = *drawn.CmdLists[i];
    for (const ImDrawCmd& command : list.CmdBuffer) {
      // A letter is a rectangle of two triangles: its first and third vertices are opposite corners.
      for (unsigned at = command.IdxOffset; at + 6 <= command.IdxOffset + command.ElemCount;) {
        const auto vertex = [&](unsigned index) -> const ImDrawVert& {
          return list
              .VtxBuffer[static_cast<int>(command.VtxOffset + list.IdxBuffer[static_cast<int>(at + index)])];
        };
        const ImDrawVert& corner = vertex(0);
        const ImDrawVert& opposite = vertex(2);
        const auto found = letters.find({corner.uv.x, corner.uv.y, opposite.uv.x, opposite.uv.y});
        if (found != letters.end()) {
          joiner.Add(found->second, corner, opposite, command.ClipRect);
        }
        at += found != letters.end() ? 6 : 3;
      }
    }
  }
  return joiner.Visible();
}

std::optional<WindowText> FindText(std::string_view text) {
  const ImDrawData* drawn = ImGui::GetDrawData();  // null while a frame is held back
  if (drawn == nullptr) {
    return std::nullopt;
  }
  const bool begins = text.ends_with('*');
  const std::string_view wanted = text.substr(0, text.size() - (begins ? 1 : 0));
  std::optional<WindowText> best;
  for (WindowText& found : TextsOf(*drawn)) {
    const bool same = begins ? found.text.starts_with(wanted) : found.text == wanted;
    if (same && (!best || std::tie(found.y, found.x) < std::tie(best->y, best->x))) {
      best = std::move(found);
    }
  }
  return best;
}

}  // namespace sqslam::viewer
