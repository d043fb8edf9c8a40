#pragma once

#include <sys/wait.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>
#include <string>
#include <vector>

#include "tests/io/temporary_folder.h"

namespace sqslam::testing {

struct ProgramRun {
  int exit_code = -1;
  std::string out;
  std::string err;

  // Lines on stderr that are neither warnings nor news: what a user reads as the error.
  std::vector<std::string> ErrorLines() const {
    std::vector<std::string> lines;
    std::istringstream stream(err);
    for (std::string line; std::getline(stream, line);) {
      if (!line.starts_with("sqslam: warning:") && !line.starts_with("sqslam: info:") &&
          line.find("fps") == std::string::npos) {
        lines.push_back(line);
      }
    }
    return lines;
  }
};

inline std::string Slurp(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

// Runs the program through the shell; `before` may hold shell commands such as ulimit.
inline ProgramRun RunProgram(const std::string& arguments, const std::string& before = "") {
  const TemporaryFolder folder;
  const std::string out = (folder.Path() / "out").string();
  const std::string err = (folder.Path() / "err").string();
  const std::string command = "{ " + before + (before.empty() ? "" : "; ") + "DISPLAY= " + SQSLAM_PROGRAM +
                              " " + arguments + "; } >" + out + " 2>" + err;
  const int status = std::system(command.c_str());
  return {WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status), Slurp(out), Slurp(err)};
}

}  // namespace sqslam::testing
