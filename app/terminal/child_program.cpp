#include "app/terminal/child_program.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstring>
#include <fstream>
#include <optional>
#include <thread>

#include "slam/util/error.h"

namespace sqslam::app {
using Clock = std::chrono::steady_clock;
namespace {

// The files that the child finds open.
class FileActions {
 public:
  explicit FileActions(const std::filesystem::path& log) {
    posix_spawn_file_actions_init(&actions_);
    posix_spawn_file_actions_addopen(&actions_, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_addopen(&actions_, STDOUT_FILENO, log.c_str(), O_WRONLY | O_CREAT | O_APPEND,
                                     0644);
    posix_spawn_file_actions_adddup2(&actions_, STDOUT_FILENO, STDERR_FILENO);
  }
  ~FileActions() { posix_spawn_file_actions_destroy(&actions_); }
  FileActions(const FileActions&) = delete;
  FileActions& operator=(const FileActions&) = delete;

  const posix_spawn_file_actions_t* Get() const { return &actions_; }

 private:
  posix_spawn_file_actions_t actions_{};
};

pid_t Spawn(const std::vector<std::string>& arguments, const std::filesystem::path& log,
            const std::filesystem::path& program) {
  std::vector<std::string> words = {"sqslam"};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv;
  for (std::string& word : words) {
    argv.push_back(word.data());
  }
  argv.push_back(nullptr);
  const FileActions actions(log);
  pid_t pid = 0;
  const int error = posix_spawn(&pid, program.c_str(), actions.Get(), nullptr, argv.data(), environ);
  if (error != 0) {
    throw InputError(fmt::format("{}: a run cannot be started with its output there ({})", log.string(),
                                 std::strerror(error)));
  }
  return pid;
}

// Waits for the child; asks `stop` fifty times a second.
int WaitFor(pid_t pid, const std::function<bool()>& stop, bool& stopped) {
  std::optional<Clock::time_point> asked;
  int status = 0;
  while (waitpid(pid, &status, WNOHANG) != pid) {
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
