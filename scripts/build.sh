#!/bin/bash
# Configures and builds a preset (release where none is named); ccache is used where it is installed.
set -euo pipefail
cd "$(dirname "$0")/.."

preset=${1:-release}
launcher=()
if command -v ccache >/dev/null; then
  launcher=(-DCMAKE_C_COMPILER_LAUNCHER=ccache -DCMAKE_CXX_COMPILER_LAUNCHER=ccache)
  export CCACHE_SLOPPINESS=pch_defines,time_macros  # what ccache asks for where headers are precompiled
fi
cmake --preset "$preset" "${launcher[@]}" --log-level=WARNING
# Some sources take a gigabyte to compile: no more of them at once than the memory holds.
jobs=$(awk -v cores="$(nproc)" '/MemAvailable/ {n = int($2 / 1200000); print (n < 1 ? 1 : (n < cores ? n : cores))}' /proc/meminfo)
cmake --build --preset "$preset" --parallel "$jobs"
