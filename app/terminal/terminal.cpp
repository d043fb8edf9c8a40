#include "app/terminal/terminal.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <glog/logging.h>
#include <spawn.h>
#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/dist_sink.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <new>
#include <opencv2/core/utils/logger.hpp>
#include <optional>
#include <thread>

#include "slam/io/live_source.h"
#include "slam/util/error.h"
#include "slam/util/text_lines.h"

namespace sqslam::app {
using Clock = std::chrono::steady_clock;
namespace {

volatile std::sig_atomic_t interrupted = 0;  // global: written by a signal handler

void Handle(int) { interrupted = 1; }

// SIGHUP means that the terminal was closed. Signals that were ignored at program start (nohup, background
// jobs of a script) stay ignored.
void Install(void (*handler)(int)) {
  struct sigaction action {};
  action.sa_handler = handler;
  action.sa_flags = SA_RESTART | (handler == SIG_DFL ? 0 : static_cast<int>(SA_RESETHAND));
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    struct sigaction before {};
    if (sigaction(signal, nullptr, &before) == 0 && before.sa_handler != SIG_IGN) {
      sigaction(signal, &action, nullptr);
    }
  }
}

// Runs `work`; throws InputError if its output could not be written, for example on a full disk.
int RunAndFlush(const std::function<int()>& work) {
  const int code = work();
  errno = 0;
  if (std::fflush(stdout) != 0 || std::ferror(stdout) != 0) {
    throw InputError("standard output cannot be written ({})",
                     errno != 0 ? std::strerror(errno) : "an earlier write failed");
  }
  return code;
}

// Writes the message of a log line without control characters: labels and paths in it are untrusted.
class CleanMessage : public spdlog::custom_flag_formatter {
 public:
  void format(const spdlog::details::log_msg& message, const std::tm&, spdlog::memory_buf_t& line) override {
    const std::string clean = ReplaceControls({message.payload.data(), message.payload.size()});
    line.append(clean.data(), clean.data() + clean.size());
  }
  std::unique_ptr<custom_flag_formatter> clone() const override { return std::make_unique<CleanMessage>(); }
};

// Cuts the middle out of an overlong message, for example with a path of thousands of characters.
std::string Shortened(const std::string& message) {
  constexpr std::size_t kKeptBytes = 1000;  // at either end
  return message.size() <= 2 * kKeptBytes ? message
                                          : fmt::format("{} ... {}", message.substr(0, kKeptBytes),
                                                        message.substr(message.size() - kKeptBytes));
}

}  // namespace

int ExitCodeOf(const std::function<int()>& work, const std::function<void(const std::string&)>& fail) {
  try {
    return work();
  } catch (const UsageError& e) {
    fail(e.what());
    return 2;
  } catch (const InputError& e) {
    fail(e.what());
    return 3;
  } catch (const NoMapError& e) {
    fail(e.what());
    return 4;
  } catch (const std::filesystem::filesystem_error& e) {  // overlong path, loop of symbolic links
    constexpr std::size_t kMaxShown = 200;                // bytes of the path
    fail(fmt::format("{}: {}", e.path1().string().substr(0, kMaxShown), e.code().message()));
    return 3;
  } catch (const std::system_error& e) {  // failed writes, for example to a full disk
    fail(e.what());
    return 3;
  } catch (const std::bad_alloc&) {
    fail("not enough memory for this input");
    return 3;
  } catch (const std::exception& e) {
    fail(fmt::format("internal error: {}", e.what()));
    return 1;
  }
}

int RunProgram(const std::string& name, const std::function<int()>& work) {
  std::signal(SIGXFSZ, SIG_IGN);  // a file size limit then fails the write, as a full disk does
  // A dist_sink, so that a run can add its own sink for warnings (WarningLog).
  const auto screen = std::make_shared<spdlog::sinks::stderr_color_sink_mt>();
  const auto sinks = std::make_shared<spdlog::sinks::dist_sink_mt>();
  sinks->add_sink(screen);
  const auto logger = std::make_shared<spdlog::logger>(name, sinks);
  auto formatter = std::make_unique<spdlog::pattern_formatter>();
  formatter->add_flag<CleanMessage>('*').set_pattern(name + ": %^%l%$: %*");
  logger->set_formatter(std::move(formatter));
  spdlog::set_default_logger(logger);
  cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);
  ::setenv("OPENCV_FFMPEG_LOGLEVEL", "-8", 0);
  FLAGS_minloglevel = google::GLOG_FATAL;  // Ceres warns of steps that it then takes shorter
  return ExitCodeOf([&] { return RunAndFlush(work); },
                    [&](const std::string& message) { PrintNotice(name + ": " + Shortened(message)); });
}

std::vector<std::string> CommandWords() {
  std::ifstream file("/proc/self/cmdline", std::ios::binary);
  std::vector<std::string> words;
  for (std::string word; std::getline(file, word, '\0');) {
    words.push_back(word);
  }
  return words;
}

std::string CommandLine() { return ShownCommandLine(CommandWords()); }

std::string ShownCommandLine(std::vector<std::string> words) {
  words.front() = std::filesystem::path(words.front()).filename().string();
  for (std::string& word : words) {
    word = IsStreamAddress(word) ? PublicAddress(word) : word;
  }
  return ShellLine(words);
}

// fmt::print would throw in the middle of the work. RunAndFlush reports failed writes.
void PrintLine(const std::string& line) {
  std::fputs((line + '\n').c_str(), stdout);
  std::fflush(stdout);
}

void PrintNotice(const std::string& line) { std::fputs((ReplaceControls(line) + '\n').c_str(), stderr); }

std::string DurationText(double seconds) {
  const auto whole = static_cast<long>(seconds + 0.5);
  return whole >= 3600 ? fmt::format("{}:{:02}:{:02}", whole / 3600, whole / 60 % 60, whole % 60)
                       : fmt::format("{}:{:02}", whole / 60, whole % 60);
}

InterruptGuard::InterruptGuard() : previous_pipe_handler_(std::signal(SIGPIPE, SIG_IGN)) {
  interrupted = 0;
  Install(Handle);
}
InterruptGuard::~InterruptGuard() {
  Install(SIG_DFL);
  std::signal(SIGPIPE, previous_pipe_handler_);
}
bool InterruptGuard::Interrupted() const { return interrupted != 0; }

Progress::Progress(bool quiet, std::string unit)
    : quiet_(quiet), unit_(std::move(unit)), terminal_(::isatty(STDERR_FILENO) == 1) {}

void Progress::Update(std::int64_t done, std::int64_t total, const std::string& state) {
  const auto interval = terminal_ ? std::chrono::milliseconds(200) : std::chrono::milliseconds(5000);
  const Clock::time_point now = Clock::now();
  if (!start_) {
    start_ = last_ = now;
  }
  if (total > 0 && done >= total) {
    Finish();
    return;
  }
  if (quiet_ || now - last_ < interval) {
    return;
  }
  last_ = now;
  const double seconds = std::chrono::duration<double>(now - *start_).count();
  const double rate = static_cast<double>(done) / seconds;
  if (total <= 0) {
    Print(fmt::format("{} {}  {:.1f}/s  {}", unit_, done, rate, state));
    return;
  }
  const double left = static_cast<double>(total - done) / std::max(rate, 1e-3);
  Print(fmt::format("{:3}%  {} {}/{}  {:.1f} {}  {} left  {}", 100 * done / total, unit_, done, total, rate,
                    unit_ == "frame" ? "fps" : unit_ + "s/s", DurationText(left), state));
}

void Progress::Print(const std::string& line) {
  std::fputs(fmt::format("{}{}{}", terminal_ ? "\r" : "", line, terminal_ ? "\033[K" : "\n").c_str(), stderr);
  line_open_ = terminal_;
}

void Progress::Finish() {
  start_.reset();
  if (line_open_) {
    std::fputs("\r\033[K", stderr);
    line_open_ = false;
  }
}

namespace {

pid_t Spawn(const std::vector<std::string>& arguments, const std::filesystem::path& log,
            const std::filesystem::path& program) {
  std::vector<std::string> words = {"sqslam"};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv;
  for (std::string& word : words) {
    argv.push_back(word.data());
  }
  argv.push_back(nullptr);
  posix_spawn_file_actions_t files{};  // stdin, stdout and stderr of the child
  posix_spawn_file_actions_init(&files);
  posix_spawn_file_actions_addopen(&files, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&files, STDOUT_FILENO, log.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0644);
  posix_spawn_file_actions_adddup2(&files, STDOUT_FILENO, STDERR_FILENO);
  pid_t pid = 0;
  const int error = posix_spawn(&pid, program.c_str(), &files, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&files);
  if (error != 0) {
    throw InputError("{}: cannot start the program that logs here ({})", log.string(), std::strerror(error));
  }
  return pid;
}

// Waits for the child; polls `stop` at 50 Hz.
int WaitFor(pid_t pid, const std::function<bool()>& stop, bool& stopped) {
  std::optional<Clock::time_point> asked;
  int status = 0;
  for (pid_t ended = 0; (ended = waitpid(pid, &status, WNOHANG)) != pid;) {
    if (ended < 0) {
      throw InputError("the exit code of a child process is lost ({})", std::strerror(errno));
    }
    if (!asked && stop()) {
      asked = Clock::now();
      stopped = true;
      kill(pid, SIGTERM);
    } else if (asked && Clock::now() - *asked > std::chrono::seconds(10)) {
      kill(pid, SIGKILL);
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  return status;
}

std::string LastLine(const std::filesystem::path& log) {
  std::ifstream file(log);
  std::string last;
  for (std::string line; std::getline(file, line);) {
    last = line.empty() ? last : line;
  }
  constexpr std::string_view kPrefix = "sqslam: ";
  return last.starts_with(kPrefix) ? last.substr(kPrefix.size()) : last;
}

}  // namespace

ChildResult RunChild(const std::vector<std::string>& arguments, const std::filesystem::path& log,
                     const std::function<bool()>& stop, const std::filesystem::path& program) {
  ChildResult result;
  const int status = WaitFor(Spawn(arguments, log, program), stop, result.stopped);
  if (WIFSIGNALED(status)) {
    result.exit_code = 128 + WTERMSIG(status);
    result.message = fmt::format("ended by signal {} ({})", WTERMSIG(status), strsignal(WTERMSIG(status)));
    return result;
  }
  result.exit_code = WEXITSTATUS(status);
  if (result.exit_code != 0) {
    const std::string line = LastLine(log);
    result.message = line.empty() ? fmt::format("exit code {}", result.exit_code) : line;
  }
  return result;
}

}  // namespace sqslam::app
