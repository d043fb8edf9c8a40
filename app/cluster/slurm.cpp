#include "app/cluster/slurm.h"

#include <fmt/format.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdio>
#include <string_view>

#include "slam/util/markup.h"
#include "slam/util/text_lines.h"
#include "slam/util/throw_if.h"

namespace sqslam::app {
namespace fs = std::filesystem;
using Words = std::vector<std::string>;
namespace {

struct ProgramOutput {
  int exit_code = 0;
  std::string text;  // stdout and stderr
};

// Runs a Slurm program shielded from Ctrl-C, which could lose the id of a submitted job, and without the
// array variables of the surrounding job, which sbatch would pass on to the new one.
ProgramOutput OutputOf(const Words& words) {
  ProgramOutput output;
  const std::string line =
      "trap '' INT HUP; unset SLURM_ARRAY_JOB_ID SLURM_ARRAY_TASK_ID SLURM_RESTART_COUNT; " +
      ShellLine(words) + " 2>&1";
  FILE* const pipe = ::popen(line.c_str(), "r");
  ThrowIf<InputError>(pipe == nullptr, "{}: cannot be started, expected Slurm's programs", words.front());
  std::array<char, 4096> part{};
  while (const std::size_t size = std::fread(part.data(), 1, part.size(), pipe)) {
    output.text.append(part.data(), size);
  }
  const int status = ::pclose(pipe);
  output.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 1;
  return output;
}

Words Lines(const std::string& text) {
  Words lines = Split(text, '\n');
  std::erase(lines, "");
  return lines;
}

// Returns the lines that are job ids, "12" or "12;CLUSTER"; the others are warnings.
Words JobNumbers(const ProgramOutput& output) {
  Words numbers;
  for (const std::string& line : Lines(output.text)) {
    if (std::isdigit(static_cast<unsigned char>(line.front())) != 0) {
      numbers.push_back(line.substr(0, line.find(';')));
    }
  }
  return numbers;
}

// Returns the error message of a Slurm program in one line.
std::string ErrorText(const ProgramOutput& output) {
  const Words lines = Lines(output.text);
  return lines.empty() ? fmt::format("exit code {}", output.exit_code) : lines.back();
}

// Escapes a path for the quotes of an #SBATCH line, where Slurm expands %a and the like.
std::string InScript(const fs::path& path) {
  std::string text;
  for (const char c : path.string()) {
    text += c == '%' ? "%%" : c == '"' ? "\\\"" : std::string(1, c);
  }
  return text;
}

// Returns the path of this program, even if a new build has replaced the file it was started from.
std::string OwnPath() {
  constexpr std::string_view kDeletedSuffix = " (deleted)";
  std::string path = fs::read_symlink("/proc/self/exe").string();
  return path.ends_with(kDeletedSuffix) ? path.substr(0, path.size() - kDeletedSuffix.size()) : path;
}

}  // namespace

std::string JobScript(const SlurmJobText& job, const SlurmOptions& options) {
  const bool array = job.words.size() > 1;
  std::string text = "#!/bin/bash\n# Written by sqslam; the same command rewrites it.\n";
  const auto add = [&text](const std::string& option) { text += fmt::format("#SBATCH {}\n", option); };
  add("--job-name=" + job.name);
  if (array) {
    add(fmt::format("--array=0-{}%{}", job.words.size() - 1, job.at_once));
  }
  add(fmt::format("--output=\"{}/{}.log\"", InScript(job.logs), array ? "%a" : job.name));
  add("--open-mode=append");
  add("--requeue");  // Slurm restarts a task whose node failed or was taken away
  add(fmt::format("--cpus-per-task={}", options.cpus));
  const auto add_if = [&](const char* name, const std::string& value) {
    if (!value.empty()) {
      add(fmt::format("--{}={}", name, value));
    }
  };
  add_if("partition", options.partition);
  add_if("time", options.time);
  add_if("mem", options.memory);
  for (const std::string& option : options.sbatch) {
    add(option);
  }
  for (const std::string& line : options.setup) {
    text += line + "\n";
  }
  const std::string program = options.program.empty() ? ShellLine({OwnPath()}) : options.program;
  text += fmt::format("tasks=({})\nexec {} {} --task \"${{tasks[${{SLURM_ARRAY_TASK_ID:-0}}]}}\"\n",
                      ShellLine(job.words), program, ShellLine(job.command));
  return text;
}

std::string JobName(const std::string& title, const fs::path& folder) {
  std::string plain = title;
  std::ranges::replace_if(
      plain, [](unsigned char c) { return std::isalnum(c) == 0 && c != '.' && c != '_'; }, '-');
  return fmt::format("sqslam-{}-{}", plain, Fingerprint(folder.string()).substr(0, 8));
}

std::string SubmitJob(const fs::path& script, const Words& after) {
  Words words = {"sbatch", "--parsable"};
  if (!after.empty()) {
    std::string dependency = "--dependency=afterany";
    for (const std::string& job : after) {
      dependency += ":" + job;
    }
    words.push_back(dependency);
  }
  words.push_back(script.string());
  const ProgramOutput output = OutputOf(words);
  const Words numbers = JobNumbers(output);
  ThrowIf<InputError>(output.exit_code != 0 || numbers.empty(), "{}: sbatch rejected it: {}", script.string(),
                      ErrorText(output));
  return numbers.back();
}

std::optional<Words> QueuedJobs(const std::string& name, std::string& problem) {
  const ProgramOutput output =
      OutputOf({"squeue", "-h", "-r", "-u", std::to_string(::getuid()), "-n", name, "-o", "%F"});
  if (output.exit_code != 0) {
    problem = "squeue: " + ErrorText(output);
    return std::nullopt;
  }
  return JobNumbers(output);
}

}  // namespace sqslam::app
