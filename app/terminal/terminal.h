#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace sqslam::app {

// Runs `work` and returns its exit code. An exception is passed to `fail` as one line and determines the
// code.
int ExitCodeOf(const std::function<int()>& work, const std::function<void(const std::string&)>& fail);

// Runs `work` as the body of main(): warnings and errors go to stderr, one line each. Libraries that print on
// their own (OpenCV, FFmpeg, Ceres) are silenced; our readers report their errors with file and frame.
int RunProgram(const std::string& name, const std::function<int()>& work);

// Returns argv of this process, the program first.
std::vector<std::string> CommandWords();

// Returns the command line of this process, quoted for a shell and without passwords in stream addresses.
std::string CommandLine();
std::string ShownCommandLine(std::vector<std::string> words);  // of other words, at least one

// Prints a line to stdout, flushed: a reader may follow the pipe. RunProgram reports failed writes at its
// end.
void PrintLine(const std::string& line);

// Prints a line to stderr, without control characters. Ignores failed writes: a closed terminal or a full
// disk must not end the work.
void PrintNotice(const std::string& line);

// Returns "1:02:07"; "2:07" if it is less than an hour.
std::string DurationText(double seconds);

// While it exists, the first SIGINT (Ctrl-C), SIGTERM or SIGHUP sets a flag; the second ends the program.
// SIGPIPE is ignored: a reader that closes the pipe does not end the program.
class InterruptGuard {
 public:
  InterruptGuard();
  ~InterruptGuard();
  InterruptGuard(const InterruptGuard&) = delete;
  InterruptGuard& operator=(const InterruptGuard&) = delete;

  bool Interrupted() const;

 private:
  void (*previous_pipe_handler_)(int);
};

// A progress line on stderr: rewritten in place on a terminal, one line every few seconds in a log file,
// nothing if `quiet`. Serves several steps in a row, each with its own total.
class Progress {
 public:
  // `unit`: name of the counted items, in the singular.
  explicit Progress(bool quiet, std::string unit = "frame");

  ~Progress() { Finish(); }
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  // `total`: of this step, which ends when all is done; 0: endless (a live camera).
  void Update(std::int64_t done, std::int64_t total, const std::string& state = "");
  // For use as the callback of work that continues while it returns true.
  bool operator()(std::int64_t done, std::int64_t total, const std::string& state = "") {
    return Update(done, total, state), true;
  }
  void Finish();  // ends the step and clears the line on a terminal

 private:
  using Clock = std::chrono::steady_clock;

  void Print(const std::string& line);

  bool quiet_;
  std::string unit_;
  bool terminal_;
  bool line_open_ = false;
  std::optional<Clock::time_point> start_;  // of the step; empty before its first update
  Clock::time_point last_;                  // when a line was printed
};

// Progress, as the callback of work that Ctrl-C ends.
struct StoppableProgress : Progress {
  using Progress::Progress;

  bool operator()(std::int64_t done, std::int64_t total, const std::string& state = "") {
    return Progress::operator()(done, total, state) && !interrupt.Interrupted();
  }

  const InterruptGuard interrupt;
};

struct ChildResult {
  int exit_code = 0;     // 128 + signal number if a signal ended it
  bool stopped = false;  // ended because `stop` returned true
  std::string message;   // the last line it printed, or the signal; empty on success
};

// Runs `program` (default: this executable) as a child process, so that a crash stays in the child. Its
// output is appended to the file `log`. `stop` is polled; once it returns true, the child gets SIGTERM, and
// SIGKILL after ten seconds. Throws InputError if the child cannot be started or its exit code is lost, which
// happens if this process ignores SIGCHLD.
ChildResult RunChild(const std::vector<std::string>& arguments, const std::filesystem::path& log,
                     const std::function<bool()>& stop,
                     const std::filesystem::path& program = "/proc/self/exe");

}  // namespace sqslam::app
