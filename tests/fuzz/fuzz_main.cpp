// libFuzzer over the target of fuzz_targets.h that SQSLAM_FUZZ_TARGET names. Without one it prints the names
// of all. With SQSLAM_FUZZ_SEED=FILE it first writes the target's seed.
#include <spdlog/spdlog.h>

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <iostream>

#include "tests/fuzz/fuzz_targets.h"
#include "tests/io/temporary_folder.h"

namespace {

const sqslam::testing::FuzzTarget& Target() {
  static const auto& target = sqslam::testing::FindFuzzTarget(std::getenv("SQSLAM_FUZZ_TARGET"));
  return target;
}

}  // namespace

extern "C" int LLVMFuzzerInitialize(int* /*argc*/, char*** /*argv*/) {
  if (std::getenv("SQSLAM_FUZZ_TARGET") == nullptr) {
    for (const auto& target : sqslam::testing::FuzzTargets()) {
      std::cout << target.name << '\n';
    }
    std::exit(0);
  }
  spdlog::set_level(spdlog::level::off);
  if (const char* file = std::getenv("SQSLAM_FUZZ_SEED")) {
    std::ofstream(file, std::ios::binary) << Target().seed();
  }
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const sqslam::TemporaryFolder folder;
  sqslam::testing::ReadFuzzed(Target(), folder.Path(), {reinterpret_cast<const char*>(data), size});
  return 0;
}
