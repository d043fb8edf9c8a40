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

// Makes the C library return large blocks to the system as soon as they are freed; to be called first in
// main(). By default glibc keeps all blocks up to the size of the largest one freed so far, so the memory of
// a long run would grow with the largest map saved.
inline void ReturnFreedMemory() {
#ifdef __GLIBC__
  constexpr int kLargeBlock = 4 << 20;  // bytes; above a megapixel image, which each frame allocates
  mallopt(M_MMAP_THRESHOLD, kLargeBlock);
  mallopt(M_TRIM_THRESHOLD, 2 * kLargeBlock);
#endif
}

}  // namespace sqslam
