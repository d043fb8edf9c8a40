#include "app/viewer/input/input_events.h"

#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <array>
#include <span>
#include <sstream>
#include <utility>

#include "slam/util/error.h"
#include "slam/util/text_lines.h"

namespace sqslam::viewer {
namespace {

// ImGui's keys became a type of their own with 1.87: Debian 12 has 1.86, Debian 13 has 1.90.
#if IMGUI_VERSION_NUM >= 18700
constexpr int kUiKeypadEnter = ImGuiKey_KeypadEnter;
#else
constexpr int kUiKeypadEnter = ImGuiKey_KeyPadEnter;
#endif

// A key with its name in scripts and, if ImGui uses it, its index in ImGui's table.
struct NamedKey {
  int code;
  const char* name;
  int ui = -1;
};
constexpr std::array<NamedKey, 31> kNamed = {{{key::kSpace, "Space", ImGuiKey_Space},
                                              {key::kEscape, "Escape", ImGuiKey_Escape},
                                              {key::kEnter, "Enter", ImGuiKey_Enter},
                                              {key::kTab, "Tab", ImGuiKey_Tab},
                                              {key::kBackspace, "Backspace", ImGuiKey_Backspace},
                                              {key::kInsert, "Insert", ImGuiKey_Insert},
                                              {key::kDelete, "Delete", ImGuiKey_Delete},
                                              {key::kRight, "Right", ImGuiKey_RightArrow},
                                              {key::kLeft, "Left", ImGuiKey_LeftArrow},
                                              {key::kDown, "Down", ImGuiKey_DownArrow},
                                              {key::kUp, "Up", ImGuiKey_UpArrow},
                                              {key::kPageUp, "PageUp", ImGuiKey_PageUp},
                                              {key::kPageDown, "PageDown", ImGuiKey_PageDown},
                                              {key::kHome, "Home", ImGuiKey_Home},
                                              {key::kEnd, "End", ImGuiKey_End},
                                              {key::kKeypadEnter, "KeypadEnter", kUiKeypadEnter},
                                              {key::kLeftShift, "Shift"},
                                              {key::kLeftControl, "Control"},
                                              {key::kLeftAlt, "Alt"},
                                              {key::kRightShift, "RightShift"},
                                              {key::kRightControl, "RightControl"},
                                              {key::kRightAlt, "RightAlt"},
                                              {44, "Comma"},
                                              {46, "Period"},
                                              {47, "Slash"},
                                              {'A', "A", ImGuiKey_A},
                                              {'C', "C", ImGuiKey_C},
                                              {'V', "V", ImGuiKey_V},
                                              {'X', "X", ImGuiKey_X},
                                              {'Y', "Y", ImGuiKey_Y},
                                              {'Z', "Z", ImGuiKey_Z}}};

constexpr std::array<std::string_view, 3> kButtons = {"left", "right", "middle"};

constexpr double kMaxNumber = 1e6;  // of frames, seconds or pixels: fits into an int

// Reads the words of one line in order.
class Words {
 public:
  Words(const std::string& text, std::string source, int line)
      : stream_(text), source_(std::move(source)), line_(line) {}

  std::string Next() {
    std::string word;
    stream_ >> word;
    return word;
  }
  double Number(const char* expected, double least = -kMaxNumber) {
    double value = 0.0;
    if (!(stream_ >> value)) {
      Fail(expected);
    }
    if (value < least || value > kMaxNumber) {
      Fail(fmt::format("{} from {:.0f} to {:.0f}", expected, least, kMaxNumber));
    }
    return value;
  }
  std::string Rest() {
    std::string rest;
    std::getline(stream_ >> std::ws, rest);
    return rest;
  }
  std::string Verbatim() {  // after one blank: further ones may have been typed
    std::string rest;
    stream_.ignore();
    std::getline(stream_, rest);
    return rest;
  }
  [[noreturn]] void Fail(const std::string& expected) const {
    throw UsageError("{}:{}: expected {}", source_, line_, expected);
  }

 private:
  std::istringstream stream_;
  std::string source_;
  int line_;
};

// The kinds of operand of the first word of a line.
enum class Operand { kNone, kPoint, kButton, kKey, kNumber, kText, kState, kPointAndText };

// A word that begins a line.
struct LineWord {
  std::string_view word;
  Operand operand;
  ScriptLine::Kind kind = ScriptLine::Kind::kEvent;
  InputEvent::Kind event = InputEvent::Kind::kMove;
  const char* number = "0 or 1";  // expected operand of kNumber
};

std::span<const LineWord> LineWords() {
  using enum Operand;
  using Line = ScriptLine::Kind;
  using Event = InputEvent::Kind;
  static constexpr std::array<LineWord, 18> kWords = {
      {{"move", kPoint, Line::kEvent, Event::kMove},
       {"press", kButton, Line::kEvent, Event::kPress},
       {"release", kButton, Line::kEvent, Event::kRelease},
       {"wheel", kPoint, Line::kEvent, Event::kWheel},
       {"keydown", kKey, Line::kEvent, Event::kKeyDown},
       {"keyup", kKey, Line::kEvent, Event::kKeyUp},
       {"text", kText, Line::kEvent, Event::kText},
       {"resize", kPoint, Line::kEvent, Event::kResize},
       {"focus", kNumber, Line::kEvent, Event::kFocus},
       {"drop", kText, Line::kEvent, Event::kDrop},
       {"close", kNone, Line::kEvent, Event::kClose},
       {"frames", kNumber, Line::kFrames, {}, "a number of frames"},
       {"repeat", kNumber, Line::kRepeat, {}, "a number of seconds"},
       {"wait", kState, Line::kWait},
       {"picture", kText, Line::kPicture},
       {"command", kText, Line::kCommand},
       {"expect", kText, Line::kExpect},
       {"point", kPointAndText, Line::kPoint}}};
  return kWords;
}

ScriptLine ReadLine(const LineWord& type, Words& words, int number) {
  ScriptLine line{type.kind, {.kind = type.event}, 0, "", number};
  InputEvent& event = line.event;
  switch (type.operand) {
    case Operand::kNone:
      break;
    case Operand::kPoint:
      event.x = words.Number("two numbers");
      event.y = words.Number("two numbers");
      break;
    case Operand::kButton: {
      const auto* const found = std::ranges::find(kButtons, words.Next());
      if (found == kButtons.end()) {
        words.Fail("left, right or middle");
      }
      event.code = static_cast<int>(found - kButtons.begin());
      break;
    }
    case Operand::kKey:
      event.code = KeyCode(words.Next());
      if (event.code < 0) {
        words.Fail("a key such as Space, F12, A or Left");
      }
      break;
    case Operand::kNumber:
      event.code = line.count = static_cast<int>(words.Number(type.number, 0.0));
      break;
    case Operand::kText:
      event.text = line.text = type.kind == ScriptLine::Kind::kEvent ? words.Verbatim() : words.Rest();
      if (type.kind == ScriptLine::Kind::kPicture && !line.text.ends_with(".png")) {
        words.Fail("FILE.png");
      }
      break;
    case Operand::kPointAndText:
      event.x = words.Number("two numbers and a text");
      event.y = words.Number("two numbers and a text");
      line.text = words.Rest();
      break;
    case Operand::kState:
      line.text = words.Next();
      if (line.text == "frame") {
        line.count = static_cast<int>(words.Number("frame N", 0.0));
      } else if (line.text != "idle" && line.text != "map" && line.text != "end") {
        words.Fail("idle, map or end, or frame N");
      }
      break;
  }
  return line;
}

void AppendLine(const std::string& text, const std::string& source, int line,
                std::vector<ScriptLine>& script) {
  Words words(text, source, line);
  const std::string word = words.Next();
  if (word.empty() || word[0] == '#') {
    return;
  }
  std::vector<std::string> parts;
  if (word == "click") {  // the label is under the mouse for a frame before the button goes down
    parts = {"point 0 0 " + words.Rest(), "frames 1", "press left", "release left", "frames 2"};
  } else if (word == "key") {  // down for a frame
    const std::string name = words.Rest();
    parts = {"keydown " + name, "frames 1", "keyup " + name};
  }
  for (const std::string& part : parts) {
    AppendLine(part, source, line, script);
  }
  if (!parts.empty()) {
    return;
  }
  std::string known;
  for (const LineWord& type : LineWords()) {
    if (type.word == word) {
      script.push_back(ReadLine(type, words, line));
      return;
    }
    known.append(type.word).append(", ");
  }
  words.Fail(known + "click or key");
}

}  // namespace

std::string KeyName(int code) {
  for (const NamedKey& named : kNamed) {
    if (named.code == code) {
      return named.name;
    }
  }
  if ((code >= 'A' && code <= 'Z') || (code >= '0' && code <= '9')) {
    return std::string(1, static_cast<char>(code));
  }
  if (code >= key::kF1 && code <= key::kF12) {
    return fmt::format("F{}", code - key::kF1 + 1);
  }
  return code >= key::kKeypad0 && code <= key::kKeypad9 ? fmt::format("Keypad{}", code - key::kKeypad0) : "";
}

int KeyCode(const std::string& name) {
  for (int code = 0; code < 512 && !name.empty(); ++code) {
    if (KeyName(code) == name) {
      return code;
    }
  }
  return -1;
}

std::vector<ScriptLine> ParseScript(const std::string& text, const std::string& source) {
  std::vector<ScriptLine> script;
  std::istringstream stream(text);
  std::string line;
  for (int number = 1; std::getline(stream, line); ++number) {
    AppendLine(line, source, number, script);
  }
  return script;
}

std::vector<ScriptLine> ReadScript(const std::string& path) {
  return ParseScript(ReadFile(path, "a script of events"), path);
}

std::string FormatEvent(const InputEvent& event) {
  const LineWord& type = *std::ranges::find(LineWords(), event.kind, &LineWord::event);
  std::string operands;
  if (type.operand == Operand::kPoint) {
    operands = fmt::format(" {} {}", event.x, event.y);
  } else if (type.operand == Operand::kButton) {
    operands = fmt::format(" {}", kButtons.at(static_cast<std::size_t>(event.code)));
  } else if (type.operand == Operand::kKey) {
    if (KeyName(event.code).empty()) {
      return "";
    }
    operands = " " + KeyName(event.code);
  } else if (type.operand == Operand::kNumber) {
    operands = fmt::format(" {}", event.code);
  } else if (type.operand == Operand::kText) {
    operands = " " + event.text;
  }
  return fmt::format("{}{}\n", type.word, operands);
}

void SetUpUiKeys() {
  for (const NamedKey& named : kNamed) {
    if (named.ui >= 0) {
      ImGui::GetIO().KeyMap[named.ui] = named.code;
    }
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
      if (event.code == 0) {  // releases outside the window are not reported
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

bool IsKeyDown(int code) { return ImGui::IsKeyDown(static_cast<ImGuiKey>(code)); }

}  // namespace sqslam::viewer
