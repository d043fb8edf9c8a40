#pragma once

#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "slam/util/options.h"

namespace sqslam::app {

// An option, a flag or a positional argument: its names, its help, and the variable that takes its value.
struct Argument {
  std::vector<std::string> names;  // "--output", "-o"; for a positional argument its placeholder
  std::string value_name;          // "FILE"; empty for flags
  std::string help;
  std::string group;                // heading in --help
  std::vector<OptionField> fields;  // target variables (several for "W,H") and their limits
  std::function<void()> store;      // passes on the values if `fields` are temporaries
  std::string default_text;         // shown in --help; empty: none
  std::string implicit_value;       // of an option given without a value; empty: that is an error
  bool required = false;
  bool list = false;     // may be repeated
  bool several = false;  // takes all words up to the next option
  bool given = false;

  Argument& Required();
  Argument& AtLeast(double min);
  Argument& Range(double min, double max);  // both ends allowed
  Argument& OneOf(std::vector<std::string> words);
  Argument& Several();
  Argument& ImplicitValue(std::string value);

  bool IsFlag() const { return std::holds_alternative<bool*>(fields.front().value); }
};

// std::array<int, 2>, Eigen::Vector3d: given as "1280,720".
template <typename T>
concept SeveralNumbers = requires(T values) {
  values.begin();
  requires std::is_arithmetic_v<std::remove_reference_t<decltype(values[0])>>;
}
&&!std::is_same_v<T, std::string>;

// A command of a program, or the program itself: arguments bound to variables, the text of --help, and an
// action. Example:
//
//   const auto [info, a] = program.AddCommand("info", "Say what is in a map", "", Info);
//   info.Positional("MAP", a.map, "map.sqmap, or the result folder that holds it").Required();
//   info.Group("Output");
//   info.Option("--output,-o FILE", a.output, "File to write");
//   info.QuietFlag(a.quiet, "No summary");
//
// Variables may be numbers, strings and enums with names, std::optional of these or of several numbers
// ("1280,720"), and std::vector of these (an option is then repeated). They must outlive the command.
class Command {
 public:
  Command(std::string name, std::string summary);

  Command& AddCommand(std::string name, std::string summary);

  // Adds a command that runs `run` with its arguments. Returns it with these, to be bound to its options.
  template <typename Result, typename Arguments>
  std::pair<Command&, Arguments&> AddCommand(std::string name, std::string summary, std::string notes,
                                             Result (*run)(const Arguments&)) {
    const auto arguments = std::make_shared<Arguments>();
    Command& command = AddCommand(std::move(name), std::move(summary));
    command.Notes(std::move(notes));
    command.OnRun([run, arguments] { return run(*arguments); });
    return {command, *arguments};
  }

  // Sets the --help heading of the arguments and commands added from now on.
  void Group(std::string heading) { group_ = std::move(heading); }

  Argument& Option(const std::string& names_and_value, auto& value, std::string help) {
    return Add(options_, names_and_value, Bind(value), std::move(help));
  }
  Argument& Option(const std::string& names_and_value, OptionField field, std::string help) {
    return Add(options_, names_and_value, {{std::move(field)}}, std::move(help));
  }
  Argument& Flag(const std::string& names, bool& value, std::string help) {
    return Add(options_, names, Bind(value), std::move(help));
  }
  Argument& Positional(const std::string& name, auto& value, std::string help) {
    return Add(positionals_, name, Bind(value), std::move(help));
  }
  // Adds --quiet under the heading "General".
  void QuietFlag(bool& quiet, std::string help) {
    Group("General");
    Flag("--quiet,-q", quiet, std::move(help));
  }

  // Sets the text below the options. Unindented lines are paragraphs; "  name   text" is an item in two
  // columns, continued by lines that are indented further; "| text" stays as it is.
  void Notes(std::string text) { notes_ = std::move(text); }

  // The action returns the exit code, or nothing for 0.
  template <typename Action>
  void OnRun(Action action) {
    if constexpr (std::is_void_v<std::invoke_result_t<Action>>) {
      action_ = [action] { return action(), 0; };
    } else {
      action_ = std::move(action);
    }
  }
  void OnVersion(std::function<std::string()> version) { version_ = std::move(version); }

  // Parses a command line, runs the command it names, and returns its exit code. Throws UsageError with the
  // problem, the nearest valid name and a pointer to --help. A command without an action prints its help, as
  // do --help and `help COMMAND`.
  int Run(const std::vector<std::string>& words);

  // The text of --help for a terminal of `width` columns.
  std::string Help(int width) const;

  const std::string& Name() const { return name_; }
  const std::deque<Command>& Commands() const { return commands_; }

 private:
  class Parser;  // CLI11

  struct Binding {
    std::vector<OptionField> fields;
    std::function<void()> store = {};
    bool list = false;
  };
  static Binding Bind(auto& value) { return {{FieldOf(value)}}; }
  template <typename T>
  static Binding Bind(std::optional<T>& value) {
    const auto read = std::make_shared<T>();
    return {{FieldOf(*read)}, [read, &value] { value = *read; }};
  }
  template <SeveralNumbers T>
  static Binding Bind(std::optional<T>& values) {
    const auto read = std::make_shared<T>();
    Binding binding{{}, [read, &values] { values = *read; }};
    for (auto& number : *read) {
      binding.fields.push_back(FieldOf(number));
    }
    return binding;
  }
  template <typename T>
  static Binding Bind(std::vector<T>& values) {
    const auto read = std::make_shared<T>();
    return {{FieldOf(*read)}, [read, &values] { values.push_back(*read); }, true};
  }

  Argument& Add(std::deque<Argument>& arguments, const std::string& names, Binding binding, std::string help);
  std::string Path() const;  // "sqslam figure maps"
  Argument* FindOption(const std::string& name);
  Command* FindCommand(const std::string& name);
  std::vector<std::string> OptionNames() const;
  std::vector<std::string> CommandNames() const;
  void CheckRequired() const;
  [[noreturn]] void Fail(const std::string& message) const;
  [[noreturn]] void FailWithoutValue(const Argument& option) const;

  std::string name_;
  std::string summary_;
  std::string notes_;
  std::string group_ = "Options";
  std::string own_group_;  // heading in the parent's --help
  Command* parent_ = nullptr;
  std::deque<Argument> positionals_;
  std::deque<Argument> options_;
  std::deque<Command> commands_;
  std::function<int()> action_;
  std::function<std::string()> version_;
};

// Returns the width in columns of the terminal on stdout; 80 if stdout is not a terminal.
int TerminalWidth();

}  // namespace sqslam::app
