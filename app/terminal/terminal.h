#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace sqslam::app {

// Does `work` and returns its exit code; what it throws becomes a line for `fail` and the code of its kind.
int ExitCodeOf(const std::function<int()>& work, const std::function<void(const std::string&)>& fail);

// The main() of a program: warnings and errors go to stderr as one line each. Libraries that print by
// themselves are silenced: what they find comes back to the reader, which says it with file and frame.
int RunProgram(const std::string& name, const std::function<int()>& work);

// The words that this process was started with, the program first.
std::vector<std::string> CommandWords();

// The command that this process was started with, as a shell takes it, without passwords of addresses.
std::string CommandLine();
std::string ShownCommandLine(std::vector<std::string> words);  // the same of the words given, at least one

void PrintLine(const std::string& line);  // on stdout, at once: it may be a pipe that somebody follows

// While one lives, the first Ctrl-C (SIGINT) or SIGTERM only sets a flag; the second ends the program as
// usual.
class InterruptGuard {
 public:
  InterruptGuard();
  ~InterruptGuard();
  InterruptGuard(const InterruptGuard&) = delete;
  InterruptGuard& operator=(const InterruptGuard&) = delete;

  bool Interrupted() const;
};

// One line on stderr that says how far a program is: rewritten in place on a terminal, a new line every few
// seconds in a log file, nothing where quiet. A total of 0 is endless (a live camera).
class Progress {
 public:
  // `unit` is what is counted, in the singular.
  Progress(std::int64_t total, bool quiet, std::string unit = "frame");

  ~Progress() { Finish(); }
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void Update(std::int64_t done, const std::string& state);
  void Finish();  // leaves the terminal's cursor on a line of its own

 private:
  using Clock = std::chrono::steady_clock;

  void Print(const std::string& line);

  std::int64_t total_;
  bool quiet_;
  std::string unit_;
  bool terminal_;
  bool line_open_ = false;
  Clock::time_point start_ = Clock::now();
  Clock::time_point last_ = start_;
};

// Progress of work in steps, each with a total of its own.
class StepProgress {
 public:
  StepProgress(bool quiet, std::string unit) : quiet_(quiet), unit_(std::move(unit)) {}

  void Update(std::int64_t done, std::int64_t total, const std::string& state);

 private:
  bool quiet_;
  std::string unit_;
  std::optional<Progress> progress_;
};

struct ChildResult {
  int exit_code = 0;     // 128 + number where a signal ended it
  bool stopped = false;  // because `stop` said so
  std::string message;  // what went wrong: the last line it printed, or the signal; empty where all went well
};

// Runs `program` (by default this very one) with other arguments as a process of its own, so that its crash
// is not ours. What it prints is added to the file `log`. While it runs `stop` is asked now and then; where
// it says true the child is ended, by force if it does not end within ten seconds. Throws InputError where it
// cannot be started.
ChildResult RunChild(const std::vector<std::string>& arguments, const std::filesystem::path& log,
                     const std::function<bool()>& stop,
                     const std::filesystem::path& program = "/proc/self/exe");

}  // namespace sqslam::app
