#pragma once

#include <unistd.h>

#include <array>
#include <cstdlib>
#include <string>

namespace sqslam {

inline std::string HostName() {
  std::array<char, 256> host{};
  ::gethostname(host.data(), host.size() - 1);
  return host.data();
}

// Returns the Slurm job that this program is part of, "17", or with its array task "17_3"; empty outside of
// Slurm.
inline std::string SlurmJob() {
  const auto variable = [](const char* name) {
    const char* value = std::getenv(name);
    return std::string(value != nullptr ? value : "");
  };
  const std::string array = variable("SLURM_ARRAY_JOB_ID");
  return array.empty() ? variable("SLURM_JOB_ID") : array + "_" + variable("SLURM_ARRAY_TASK_ID");
}

}  // namespace sqslam
