#pragma once

#include <unistd.h>

#include <array>
#include <cstdlib>
#include <string>
#ifdef __GLIBC__
#include <malloc.h>
#endif

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

// Makes the C library give large blocks back to the system as soon as they are freed. Otherwise glibc keeps
// all blocks up to the size of the largest one freed so far, and the memory of a long run grows in steps with
// the largest map that it has saved. For the beginning of main().
inline void ReturnFreedMemory() {
#ifdef __GLIBC__
  constexpr int kLarge = 4 << 20;  // above images of a megapixel, which come and go with each frame
  mallopt(M_MMAP_THRESHOLD, kLarge);
  mallopt(M_TRIM_THRESHOLD, 2 * kLarge);
#endif
}

}  // namespace sqslam
