#include "app/command_line/command.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cctype>
#include <limits>
#include <string_view>

#include "slam/util/error.h"
#include "slam/util/text_lines.h"
#include "slam/util/to_vector.h"

namespace sqslam::app {
namespace {

// "--output", "-o", "--output=x", but not "-" (a file) or "-1.5".
bool LooksLikeOption(const std::string& word) {
  return word.size() > 1 && word[0] == '-' && word[1] != '.' &&
         std::isdigit(static_cast<unsigned char>(word[1])) == 0;
}

void Read(Argument& argument, const std::string& text) {
  std::string_view rest = text;
  for (std::size_t i = 0; i < argument.fields.size(); ++i) {
    const bool last = i + 1 == argument.fields.size();
    const std::size_t end = last ? rest.size() : rest.find(',');
    if (end == std::string_view::npos || !ReadOption(std::string(rest.substr(0, end)), argument.fields[i])) {
      throw UsageError("{} {}: expected {}{}", argument.names.front(), text,
                       argument.fields.size() > 1 ? argument.value_name + ", each " : "",
                       OptionExpectation(argument.fields[i]));
    }
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
  if (argument.store) {
    argument.store();
  }
  argument.given = true;
}

}  // namespace

Argument& Argument::Required() {
  required = true;
  default_text.clear();
  return *this;
}

Argument& Argument::AtLeast(double min) { return Range(min, std::numeric_limits<double>::infinity()); }

Argument& Argument::Range(double min, double max) {
  for (OptionField& field : fields) {
    field.min = min;
    field.max = max;
  }
  return *this;
}

Argument& Argument::OneOf(std::vector<std::string> words) {
  fields.front().allowed = std::move(words);
  return *this;
}

Argument& Argument::Several() {
  several = true;
  return *this;
}

Argument& Argument::ImplicitValue(std::string value) {
  implicit_value = std::move(value);
  return *this;
}

Command::Command(std::string name, std::string summary)
    : name_(std::move(name)), summary_(std::move(summary)) {}

Command& Command::AddCommand(std::string name, std::string summary) {
  Command& command = commands_.emplace_back(std::move(name), std::move(summary));
  command.parent_ = this;
  command.own_group_ = group_ == "Options" ? "Commands" : group_;
  return command;
}

Argument& Command::Add(std::deque<Argument>& arguments, const std::string& names, Binding binding,
                       std::string help) {
  Argument& argument = arguments.emplace_back();
  const std::size_t blank = std::min(names.find(' '), names.size());
  argument.names = Split(names.substr(0, blank), ',');
  argument.value_name = names.substr(std::min(blank + 1, names.size()));
  argument.help = std::move(help);
  argument.group = group_;
  argument.fields = std::move(binding.fields);
  argument.store = std::move(binding.store);
  argument.list = binding.list;
  if (!argument.store && !argument.IsFlag()) {
    argument.default_text = OptionText(argument.fields.front());
  }
  return argument;
}

std::string Command::Path() const { return parent_ == nullptr ? name_ : parent_->Path() + " " + name_; }

Argument* Command::FindOption(const std::string& name) {
  for (Argument& option : options_) {
    if (std::ranges::find(option.names, name) != option.names.end()) {
      return &option;
    }
  }
  return parent_ == nullptr ? nullptr : parent_->FindOption(name);
}

Command* Command::FindCommand(const std::string& name) {
  const auto it = std::ranges::find(commands_, name, &Command::name_);
  return it == commands_.end() ? nullptr : &*it;
}

std::vector<std::string> Command::OptionNames() const {
  std::vector<std::string> names =
      parent_ == nullptr ? std::vector<std::string>{"--help"} : parent_->OptionNames();
  for (const Argument& option : options_) {
    std::ranges::copy_if(option.names, std::back_inserter(names),
                         [](const std::string& name) { return name.starts_with("--"); });
  }
  return names;
}

std::vector<std::string> Command::CommandNames() const { return ToVector(commands_, &Command::name_); }

void Command::CheckRequired() const {
  std::vector<std::string> missing;
  for (const std::deque<Argument>* list : {&positionals_, &options_}) {
    for (const Argument& argument : *list) {
      if (argument.required && !argument.given) {
        missing.push_back(argument.names.front());
      }
    }
  }
  if (!missing.empty()) {
    Fail(fmt::format("{} {} missing", fmt::join(missing, " and "), missing.size() > 1 ? "are" : "is"));
  }
}

void Command::Fail(const std::string& message) const {
  throw UsageError("{} (see {} --help)", message, Path());
}

void Command::FailWithoutValue(const Argument& option) const {
  const std::string& name = option.names.front();
  Fail(fmt::format("{}: the value is missing, expected {} {}", name, name, option.value_name));
}

// Parses with CLI11, but words the errors itself.
class Command::Parser {
 public:
  explicit Parser(Command& program) : program_(program), root_(program.summary_, program.name_) {
    if (program.version_) {
      root_.set_version_flag("--version", program.version_);
    }
    Declare(root_, program);
  }

  // Parses the words, runs their command, and returns the exit code.
  int Run(std::vector<std::string> words) {
    if (!words.empty() && words.front() == "help" && program_.positionals_.empty()) {
      words.erase(words.begin());  // `help figure maps` is `figure maps --help`
      words.emplace_back("--help");
    }
    try {
      root_.parse(Reversed(Completed(words)));
    } catch (const CLI::CallForVersion& version) {
      fmt::print("{}\n", version.what());
      return 0;
    } catch (const CLI::CallForHelp&) {
      return PrintHelp();
    } catch (const CLI::ArgumentMismatch& error) {  // the last option lacks its value
      const Argument* option = Chosen().FindOption(words.back());
      option != nullptr ? Chosen().FailWithoutValue(*option) : Chosen().Fail(error.what());
    } catch (const CLI::ParseError& error) {
      CheckLeftOver(false);
      Chosen().CheckRequired();
      Chosen().Fail(error.what());
    }
    return Chosen().action_ ? Chosen().action_() : PrintHelp();
  }

 private:
  void Declare(CLI::App& app, Command& command) {
    app.require_subcommand(0, 1);  // a second command name is an argument of the first
    for (std::deque<Argument>* arguments : {&command.positionals_, &command.options_}) {
      for (Argument& argument : *arguments) {
        const bool positional = arguments == &command.positionals_;
        const auto read = [&command, &argument, positional](const CLI::results_t& texts) {
          for (const std::string& text : texts) {
            if (!positional && LooksLikeOption(text) &&
                (text == "--help" || command.FindOption(text) != nullptr)) {
              command.FailWithoutValue(argument);
            }
            Read(argument, text);
          }
          return true;
        };
        app.add_option(fmt::format("{}", fmt::join(argument.names, ",")), read)
            ->expected(argument.IsFlag()                                   ? 0
                       : argument.several || (positional && argument.list) ? -1
                                                                           : 1)
            ->multi_option_policy(argument.list ? CLI::MultiOptionPolicy::TakeAll
                                                : CLI::MultiOptionPolicy::TakeLast)
            ->required(argument.required);
      }
    }
    for (Command& subcommand : command.commands_) {
      CLI::App* child = app.add_subcommand(subcommand.name_);
      child->fallthrough(!command.options_.empty());
      Declare(*child, subcommand);
    }
  }

  // Inserts Argument::implicit_value after each option that has one and is not followed by an allowed value.
  std::vector<std::string> Completed(const std::vector<std::string>& words) const {
    std::vector<std::string> completed;
    Command* command = &program_;
    for (std::size_t i = 0; i < words.size(); ++i) {
      completed.push_back(words[i]);
      if (Command* subcommand = command->FindCommand(words[i])) {
        command = subcommand;
        continue;
      }
      const Argument* option = command->FindOption(words[i]);
      if (option != nullptr && !option->implicit_value.empty()) {
        const std::vector<std::string>& allowed = option->fields.front().allowed;
        if (i + 1 == words.size() || std::ranges::find(allowed, words[i + 1]) == allowed.end()) {
          completed.push_back(option->implicit_value);
        }
      }
    }
    return completed;
  }

  // Reverses the words, as CLI11 expects them. "--option=" is an empty value, not the next word.
  static std::vector<std::string> Reversed(const std::vector<std::string>& words) {
    std::vector<std::string> reversed;
    for (auto word = words.rbegin(); word != words.rend(); ++word) {
      const bool empty = word->starts_with("--") && word->ends_with('=');
      if (empty) {
        reversed.emplace_back();
      }
      reversed.push_back(word->substr(0, word->size() - (empty ? 1 : 0)));
    }
    return reversed;
  }

  // Returns the innermost command parsed so far.
  Command& Chosen() {
    Command* command = &program_;
    for (const CLI::App* app = &root_; !app->get_subcommands().empty();) {
      app = app->get_subcommands().front();
      command = command->FindCommand(app->get_name());
    }
    return *command;
  }

  int PrintHelp() {
    CheckLeftOver(true);
    fmt::print("{}", Chosen().Help(TerminalWidth()));
    return 0;
  }

  // Throws UsageError for unconsumed words; for help only if one of them should name a command.
  void CheckLeftOver(bool for_help) {
    const Command& command = Chosen();
    std::vector<std::string> words = root_.remaining(true);
    std::erase(words, "--");
    if (!words.empty() && !command.commands_.empty() && !LooksLikeOption(words.front())) {
      const std::vector<std::string> names = command.CommandNames();
      const std::string nearest = DidYouMean(words.front(), names);
      command.Fail(fmt::format(
          "unknown {} '{}'{}", command.parent_ == nullptr ? "command" : command.name_, words.front(),
          nearest.empty() ? fmt::format(", expected one of {}", fmt::join(names, ", ")) : nearest));
    }
    const auto option = std::ranges::find_if(words, LooksLikeOption);
    if (option != words.end() && !for_help) {
      const std::string name = option->substr(0, option->find('='));
      command.Fail(fmt::format("unknown option '{}'{}", name, DidYouMean(name, command.OptionNames())));
    }
    if (!words.empty() && !for_help) {
      command.Fail(fmt::format("{}: unexpected argument '{}'", command.name_, words.front()));
    }
  }

  Command& program_;
  CLI::App root_;
};

int Command::Run(const std::vector<std::string>& words) { return Parser(*this).Run(words); }

}  // namespace sqslam::app
