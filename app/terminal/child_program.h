#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace sqslam::app {

struct ChildResult {
  int exit_code = 0;     // 128 + number where a signal ended it
  bool stopped = false;  // because `stop` said so
  std::string message;  // what went wrong: the last line it printed, or the signal; empty where all went well
};

// Runs `program` (by default this very one) with other arguments as a process of its own, so that its crash
// is not ours. What it
// prints is added to the file `log`. While it runs `stop` is asked now and then; where it says true the child
// is ended, by force if it does not end within ten seconds. Throws InputError where it cannot be started.
ChildResult RunChild(const std::vector<std::string>& arguments, const std::filesystem::path& log,
                     const std::function<bool()>& stop,
                     const std::filesystem::path& program = "/proc/self/exe");

}  // namespace sqslam::app
