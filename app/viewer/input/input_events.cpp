#include "app/viewer/input/input_events.h"

#include <fmt/format.h>

#include <array>
#include <fstream>
#include <iterator>
#include <sstream>

#include "app/viewer/input/keys.h"
#include "slam/util/error.h"

namespace sqslam::viewer {
namespace {

struct NamedKey {
  int code;
  const char* name;
};
constexpr std::array<NamedKey, 25> kNamed = {{{key::kSpace, "Space"},
                                              {key::kEscape, "Escape"},
                                              {key::kEnter, "Enter"},
                                              {key::kTab, "Tab"},
                                              {key::kBackspace, "Backspace"},
                                              {key::kInsert, "Insert"},
                                              {key::kDelete, "Delete"},
                                              {key::kRight, "Right"},
                                              {key::kLeft, "Left"},
                                              {key::kDown, "Down"},
                                              {key::kUp, "Up"},
                                              {key::kPageUp, "PageUp"},
                                              {key::kPageDown, "PageDown"},
                                              {key::kHome, "Home"},
                                              {key::kEnd, "End"},
                                              {key::kKeypadEnter, "KeypadEnter"},
                                              {key::kLeftShift, "Shift"},
                                              {key::kLeftControl, "Control"},
                                              {key::kLeftAlt, "Alt"},
                                              {key::kRightShift, "RightShift"},
                                              {key::kRightControl, "RightControl"},
                                              {key::kRightAlt, "RightAlt"},
                                              {44, "Comma"},
                                              {46, "Period"},
                                              {47, "Slash"}}};

constexpr std::array<const char*, 3> kButtons = {"left", "right", "middle"};

[[noreturn]] void Refuse(const std::string& source, int line, const std::string& expected) {
  throw UsageError(fmt::format("{}:{}: expected {}", source, line, expected));
}

// The words of one line, taken one after the other.
class Words {
 public:
  Words(const std::string& text, std::string source, int line)
      : stream_(text), source_(std::move(source)), line_(line) {}

  std::string Next() {
    std::string word;
    stream_ >> word;
    return word;
  }
  double Number(const char* expected) {
    double value = 0.0;
    if (!(stream_ >> value)) {
      Refuse(source_, line_, expected);
    }
    return value;
  }
  std::string Rest() {
    std::string rest;
    std::getline(stream_ >> std::ws, rest);
    return rest;
  }
  [[noreturn]] void Fail(const char* expected) const { Refuse(source_, line_, expected); }

 private:
  std::istringstream stream_;
  std::string source_;
  int line_;
};

int Button(Words& words) {
  const std::string name = words.Next();
  for (std::size_t i = 0; i < kButtons.size(); ++i) {
    if (name == kButtons[i]) {
      return static_cast<int>(i);
    }
  }
  words.Fail("left, right or middle");
}

int Key(Words& words) {
  const int code = KeyCode(words.Next());
  if (code < 0) {
    words.Fail("a key such as Space, F12, A or Left");
  }
  return code;
}

// Appends what one line means; false where its first word is none of an event.
bool AppendEvent(const std::string& word, Words& words, int line, std::vector<ScriptLine>& script) {
  using Kind = InputEvent::Kind;
  InputEvent event;
  if (word == "move" || word == "wheel" || word == "resize") {
    event.kind = word == "move" ? Kind::kMove : word == "wheel" ? Kind::kWheel : Kind::kResize;
    event.x = words.Number("two numbers");
    event.y = words.Number("two numbers");
  } else if (word == "press" || word == "release") {
    event.kind = word == "press" ? Kind::kPress : Kind::kRelease;
    event.code = Button(words);
  } else if (word == "keydown" || word == "keyup" || word == "key") {
    event.kind = word == "keyup" ? Kind::kKeyUp : Kind::kKeyDown;
    event.code = Key(words);
  } else if (word == "text" || word == "drop") {
    event.kind = word == "text" ? Kind::kText : Kind::kDrop;
    event.text = words.Rest();
  } else if (word == "focus") {
    event.kind = Kind::kFocus;
    event.code = static_cast<int>(words.Number("0 or 1"));
  } else if (word == "close") {
    event.kind = Kind::kClose;
  } else {
    return false;
  }
  script.push_back({ScriptLine::Kind::kEvent, event, 0, "", line});
  if (word == "key") {  // down, seen by one frame, and up
    ScriptLine& pause = script.emplace_back();
    pause.kind = ScriptLine::Kind::kFrames;
    pause.count = 1;
    pause.line = line;
    event.kind = Kind::kKeyUp;
    script.push_back({ScriptLine::Kind::kEvent, event, 0, "", line});
  }
  return true;
}

void AppendLine(const std::string& text, const std::string& source, int line,
                std::vector<ScriptLine>& script) {
  Words words(text, source, line);
  const std::string word = words.Next();
  if (word.empty() || word[0] == '#' || AppendEvent(word, words, line, script)) {
    return;
  }
  ScriptLine action;
  action.line = line;
  if (word == "frames") {
    action.kind = ScriptLine::Kind::kFrames;
    action.count = static_cast<int>(words.Number("a number of frames"));
  } else if (word == "wait") {
    action.kind = ScriptLine::Kind::kWait;
    action.text = words.Next();
    if (action.text == "frame") {
      action.count = static_cast<int>(words.Number("frame N"));
    } else if (action.text != "idle" && action.text != "map" && action.text != "end") {
      words.Fail("idle, map or end, or frame N");
    }
  } else if (word == "picture") {
    action.kind = ScriptLine::Kind::kPicture;
    action.text = words.Rest();
  } else if (word == "command") {
    action.kind = ScriptLine::Kind::kCommand;
    action.text = words.Rest();
  } else if (word == "expect") {
    action.kind = ScriptLine::Kind::kExpect;
    action.text = words.Rest();
  } else if (word == "repeat") {
    action.kind = ScriptLine::Kind::kRepeat;
    action.count = static_cast<int>(words.Number("a number of seconds"));
  } else {
    words.Fail(
        "move, press, release, wheel, key, keydown, keyup, text, resize, focus, drop, close, frames, wait, "
        "picture, command, expect or repeat");
  }
  script.push_back(std::move(action));
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
  if (code >= key::kKeypad0 && code <= key::kKeypad9) {
    return fmt::format("Keypad{}", code - key::kKeypad0);
  }
  return "";
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
  int number = 0;
  for (std::string line; std::getline(stream, line);) {
    AppendLine(line, source, ++number, script);
  }
  return script;
}

std::vector<ScriptLine> ReadScript(const std::string& path) {
  std::ifstream file(path);
  if (!file) {
    throw InputError(fmt::format("{}: cannot be read, expected a script of events", path));
  }
  return ParseScript(std::string(std::istreambuf_iterator<char>(file), {}), path);
}

std::string FormatEvent(const InputEvent& event) {
  using Kind = InputEvent::Kind;
  switch (event.kind) {
    case Kind::kMove:
      return fmt::format("move {} {}", event.x, event.y);
    case Kind::kPress:
    case Kind::kRelease:
      return fmt::format("{} {}", event.kind == Kind::kPress ? "press" : "release",
                         kButtons.at(static_cast<std::size_t>(event.code)));
    case Kind::kWheel:
      return fmt::format("wheel {} {}", event.x, event.y);
    case Kind::kKeyDown:
      return fmt::format("keydown {}", KeyName(event.code));
    case Kind::kKeyUp:
      return fmt::format("keyup {}", KeyName(event.code));
    case Kind::kText:
      return "text " + event.text;
    case Kind::kResize:
      return fmt::format("resize {} {}", event.x, event.y);
    case Kind::kFocus:
      return fmt::format("focus {}", event.code);
    case Kind::kDrop:
      return "drop " + event.text;
    case Kind::kClose:
      return "close";
  }
  return "";
}

}  // namespace sqslam::viewer
