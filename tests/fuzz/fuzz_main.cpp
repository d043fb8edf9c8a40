// libFuzzer over one target of fuzz_targets.h. With SQSLAM_FUZZ_SEED=FILE it first writes the target's seed.
#include <spdlog/spdlog.h>

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <fstream>

#include "tests/fuzz/fuzz_targets.h"
#include "tests/io/temporary_folder.h"

extern "C" int LLVMFuzzerInitialize(int* /*argc*/, char*** /*argv*/) {
  spdlog::set_level(spdlog::level::off);
  if (const char* file = std::getenv("SQSLAM_FUZZ_SEED")) {
    const auto& target = sqslam::testing::FindFuzzTarget(SQSLAM_FUZZ_TARGET);
    std::ofstream(file, std::ios::binary) << target.seed();
  }
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const auto& target = sqslam::testing::FindFuzzTarget(SQSLAM_FUZZ_TARGET);
  static const sqslam::TemporaryFolder folder;
  sqslam::testing::ReadFuzzed(target, folder.Path(), {reinterpret_cast<const char*>(data), size});
  return 0;
}
