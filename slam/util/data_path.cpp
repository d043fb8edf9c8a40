#include "slam/util/data_path.h"

#include <fmt/format.h>

#include <system_error>

#include "slam/util/error.h"

namespace sqslam {
namespace fs = std::filesystem;

fs::path DataPath(const fs::path& name) {
  std::error_code error;
  const fs::path bin = fs::read_symlink("/proc/self/exe", error).parent_path();
  for (const fs::path& root : {bin / ".." / "share" / "sqslam", bin / ".." / ".." / ".."}) {
    const fs::path candidate = (root / name).lexically_normal();
    if (fs::exists(candidate, error)) {
      return candidate;
    }
  }
  throw InputError(
      fmt::format("{}: not found beside {}, expected below ../share/sqslam (cmake --install puts it there)",
                  name.string(), bin.string()));
}

}  // namespace sqslam
