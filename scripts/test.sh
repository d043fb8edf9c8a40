#!/bin/bash
# Installs missing packages, builds, and runs all tests with ctest, to which the arguments are passed.
set -euo pipefail
cd "$(dirname "$0")/.."

scripts/build.sh release
ctest --preset release --parallel "$(nproc)" "$@"
