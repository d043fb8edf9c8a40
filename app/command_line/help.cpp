#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <sstream>

#include "app/command_line/command.h"
#include "slam/util/text_lines.h"

namespace sqslam::app {
namespace {

constexpr std::size_t kIndent = 2;
constexpr std::size_t kOptionColumn = 30;  // at which the text of options begins
constexpr std::size_t kContinued = 6;      // indentation of continuation lines of a command

// Wraps text at blanks to lines of at most `width` columns; a longer word gets a line of its own.
std::vector<std::string> Wrap(const std::string& text, std::size_t width) {
  std::vector<std::string> lines(1);
  std::istringstream words(text);
  for (std::string word; words >> word;) {
    if (!lines.back().empty() && CountCharacters(lines.back()) + 1 + CountCharacters(word) > width) {
      lines.emplace_back();
    }
    lines.back() += (lines.back().empty() ? "" : " ") + word;
  }
  return lines;
}

struct Item {
  std::string left;
  std::string right;
};

// Breaks an example command that is too long for a line with backslashes; an option stays with its value.
std::string WrapCommand(const std::string& command, std::size_t width) {
  if (CountCharacters(command) + kIndent <= width) {
    return command;
  }
  std::string text;
  std::size_t used = kIndent;
  for (std::size_t at = 0; at < command.size();) {
    const std::size_t end = std::min(command.find(" -", at + 1), command.size());
    const std::string part = command.substr(at, end - at);
    if (at > 0 && used + CountCharacters(part) + 2 > width) {
      text += fmt::format(" \\\n{:{}}", "", kContinued - 1);
      used = kContinued - 1;
    }
    text += part;
    used += CountCharacters(part);
    at = end;
  }
  return text;
}

// Formats two columns. The second begins at `column`, or on the next line if the first is too long.
std::string FormatItem(const Item& item, std::size_t column, std::size_t width) {
  const std::string left = WrapCommand(item.left, width);
  std::string text = fmt::format("{:{}}{}", "", kIndent, left);
  if (item.right.empty()) {
    return text + "\n";
  }
  std::size_t used = CountCharacters(text.substr(text.rfind('\n') + 1));
  if (used + 2 > column && used + 2 + CountCharacters(item.right) <= width) {
    return text + "  " + item.right + "\n";
  }
  if (used + 2 > column) {
    text += '\n';
    used = 0;
  }
  for (const std::string& line : Wrap(item.right, std::max<std::size_t>(width - column, 20))) {
    text += fmt::format("{:{}}{}\n", "", column - used, line);
    used = 0;
  }
  return text;
}

// Formats items; the second column begins after the longest first one that fits in half the width.
std::string FormatItems(const std::vector<Item>& items, std::size_t width) {
  std::size_t column = 0;
  for (const Item& item : items) {
    const std::size_t wanted = kIndent + CountCharacters(item.left) + 2;
    if (!item.right.empty() && wanted <= width / 2) {
      column = std::max(column, wanted);
    }
  }
  std::string text;
  for (const Item& item : items) {
    text += FormatItem(item, column > 0 ? column : kContinued, width);
  }
  return text;
}

// See Command::Notes.
class NotesFormatter {
 public:
  explicit NotesFormatter(std::size_t width) : width_(width) {}

  std::string Format(const std::string& notes) {
    for (const std::string& line : Split(notes, '\n')) {
      Add(line);
    }
    Flush();
    return text_;
  }

 private:
  void Add(const std::string& line) {
    const std::size_t margin = line.find_first_not_of(' ');
    if (margin == std::string::npos) {
      Flush();
      text_ += '\n';
    } else if (line.starts_with("| ")) {
      Flush();
      text_ += fmt::format("  {}\n", line.substr(2));
    } else if (margin == 0) {
      FlushItems();
      paragraph_ += ' ' + line;
    } else if (margin > kIndent && !items_.empty()) {
      items_.back().right += " " + line.substr(margin);
    } else {
      FlushParagraph();
      const std::size_t gap = line.find("  ", margin);
      const std::size_t right = gap == std::string::npos ? gap : line.find_first_not_of(' ', gap);
      items_.push_back({line.substr(margin, gap == std::string::npos ? gap : gap - margin),
                        right == std::string::npos ? "" : line.substr(right)});
    }
  }
  void FlushParagraph() {
    if (!paragraph_.empty()) {
      text_ += fmt::format("{}\n", fmt::join(Wrap(paragraph_, width_), "\n"));
      paragraph_.clear();
    }
  }
  void FlushItems() {
    text_ += FormatItems(items_, width_);
    items_.clear();
  }
  void Flush() {
    FlushParagraph();
    FlushItems();
  }

  std::size_t width_;
  std::string text_;
  std::string paragraph_;
  std::vector<Item> items_;
};

// Returns "-o, --output FILE" and its help text.
Item ItemOf(const Argument& argument) {
  std::vector<std::string> names = argument.names;
  std::ranges::stable_sort(names, {}, [](const std::string& name) { return name.size() > 2; });
  Item item{fmt::format("{}", fmt::join(names, ", ")), argument.help};
  if (!argument.value_name.empty()) {
    item.left += " " + argument.value_name;
  }
  std::string values = fmt::format("{}", fmt::join(argument.fields.front().allowed, ", "));
  if (!argument.default_text.empty()) {
    values += (values.empty() ? "default: " : "; default: ") + argument.default_text;
  }
  if (!values.empty()) {
    item.right += " (" + values + ")";
  }
  return item;
}

}  // namespace

std::string Command::Help(int columns) const {
  const auto width = static_cast<std::size_t>(std::max(columns, 40));
  std::string usage = Path();
  std::deque<std::pair<std::string, std::vector<Item>>> headings;  // in order of first appearance
  const auto under = [&](const std::string& heading) -> std::vector<Item>& {
    const auto found = std::ranges::find(headings, heading, &decltype(headings)::value_type::first);
    return found != headings.end() ? found->second
                                   : headings.emplace_back(heading, std::vector<Item>()).second;
  };
  for (const Command& command : commands_) {
    under(command.own_group_).push_back({command.name_, command.summary_});
  }
  for (const Argument& positional : positionals_) {
    const std::string name = positional.names.front() + (positional.list ? "..." : "");
    usage += positional.required ? " " + name : " [" + name + "]";
    under(positional.group).push_back(ItemOf(positional));
  }
  for (const Command* command = this; command != nullptr; command = command->parent_) {
    for (const Argument& option : command->options_) {
      under(option.group).push_back(ItemOf(option));
    }
  }
  usage += commands_.empty() || !positionals_.empty() ? " [OPTIONS]" : " COMMAND [OPTIONS]";
  std::vector<Item> general = under("General");
  std::erase_if(headings, [](const auto& heading) { return heading.first == "General"; });
  general.push_back({"-h, --help", "Print this help"});
  if (version_) {
    general.push_back({"--version", "Print version, libraries and rendering back ends"});
  }
  headings.emplace_back("General", std::move(general));
  std::string text = fmt::format("{}\n\nUsage: {}\n", fmt::join(Wrap(summary_, width), "\n"), usage);
  for (const auto& [heading, items] : headings) {
    text += fmt::format("\n{}:\n", heading);
    const std::size_t column = std::min(kOptionColumn, width / 2);
    for (const Item& item : items) {
      text += FormatItem(item, column, width);
    }
  }
  return text + NotesFormatter(width).Format(notes_);
}

int TerminalWidth() {
  winsize size{};
  return ::ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0 ? size.ws_col : 80;
}

}  // namespace sqslam::app
