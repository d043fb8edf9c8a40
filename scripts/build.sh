#!/bin/bash
# Installs the packages that a preset needs, configures it and builds it.
# usage: scripts/build.sh [PRESET [ARGUMENT...]]; arguments go to cmake --build, such as --target sqslam
#   programs   sqslam and sqslam-viewer (default)
#   demo       sqslam alone
#   release    the programs and all tests
#   asan, asan-slam, tsan, debug: as CMakePresets.json describes them
# The first three share build/release, so each reuses what another has built.
set -euo pipefail
cd "$(dirname "$0")/.."

preset=${1:-programs}
case $preset in
  demo) packages=(packages.txt) ;;
  programs) packages=(packages.txt packages-viewer.txt) ;;
  *) packages=(packages.txt packages-viewer.txt packages-test.txt) ;;
esac
scripts/install-packages.sh "${packages[@]}"

case $preset in
  demo | programs) folder=build/release ;;
  *) folder=build/$preset ;;
esac
launcher=()
# Only for a new folder: changing the compiler launcher would rebuild everything.
if [ ! -f "$folder/CMakeCache.txt" ] && command -v ccache >/dev/null; then
  launcher=(-DCMAKE_C_COMPILER_LAUNCHER=ccache -DCMAKE_CXX_COMPILER_LAUNCHER=ccache)
fi
export CCACHE_SLOPPINESS=pch_defines,time_macros  # ccache asks for it where headers are precompiled
cmake --preset "$preset" "${launcher[@]}" --log-level=WARNING
# Some sources need a gigabyte to compile: run only as many compilers as fit in memory.
jobs=$(awk -v cores="$(nproc)" '/MemAvailable/ {n = int($2 / 1200000); print (n < 1 ? 1 : (n < cores ? n : cores))}' /proc/meminfo)
cmake --build --preset "$preset" --parallel "$jobs" "${@:2}"
