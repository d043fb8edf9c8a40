#!/bin/bash
# Runs the named checks, by default tidy, asan and tsan.
# usage: scripts/check.sh [CHECK]...
#   format     every source is formatted by clang-format
#   modules    modules include only lower layers, without cycles (scripts/check-modules.py)
#   words      names of tests and constants, subjects of commits (scripts/check-words.py)
#   options    docs/options.md is up to date (scripts/list-options.py)
#   asan-readers  the readers of images, videos, boxes and recordings, and the modules below them, under AddressSanitizer
#              and the cheaper checks of UBSan
# Not part of CI, as they take hours:
#   tidy       clang-tidy over all sources
#   asan       all tests under AddressSanitizer and UBSan
#   asan-runs  whole programs on short inputs, likewise (scripts/sanitized-runs.sh)
#   tsan       all tests under ThreadSanitizer, on one core (scripts/thread-sanitizer.supp says why)
set -euo pipefail
cd "$(dirname "$0")/.."

check_format() {
  scripts/install-packages.sh clang-format
  if ! git ls-files '*.cpp' '*.h' | xargs clang-format --dry-run -Werror; then
    echo "check.sh: not formatted; do it with: git ls-files '*.cpp' '*.h' | xargs clang-format -i" >&2
    return 1
  fi
}

check_modules() {
  scripts/install-packages.sh python3
  scripts/check-modules.py
}

check_words() {
  scripts/install-packages.sh python3
  scripts/check-words.py
}

check_options() {
  scripts/install-packages.sh python3
  scripts/list-options.py --check
}

check_asan-readers() {
  local programs=(util geometry snapshot io detection features recognition map)
  scripts/build.sh asan-slam --target "${programs[@]/%/_test}"
  LSAN_OPTIONS="suppressions=$PWD/scripts/leak-sanitizer.supp:print_suppressions=0" \
    xargs --max-procs "$(nproc)" -I{} env build/asan-slam/bin/{}_test --gtest_brief=1 <<<"$(printf '%s\n' "${programs[@]}")"
}

check_asan() {
  scripts/build.sh asan
  ctest --preset asan --parallel "$(nproc)"
}

check_asan-runs() {
  scripts/build.sh asan --target sqslam sqslam-viewer
  scripts/sanitized-runs.sh build/asan
}

check_tsan() {
  scripts/build.sh tsan
  taskset -c 0 ctest --preset tsan
}

check_tidy() {
  scripts/install-packages.sh packages.txt packages-viewer.txt packages-test.txt clang clang-tidy
  cmake --preset tidy --log-level=WARNING
  run-clang-tidy -quiet -p build/tidy "$PWD/(slam|render|app)/.*"
}

[ $# -gt 0 ] || set -- tidy asan tsan
for check in "$@"; do
  declare -F "check_$check" >/dev/null || { echo "check.sh: no check is called $check" >&2; exit 2; }
  echo "== $check"
  "check_$check"
done
