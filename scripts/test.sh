#!/bin/bash
# Installs what is missing, builds, and runs every test. Ends with ctest's summary.
# Arguments go to ctest.
set -euo pipefail
cd "$(dirname "$0")/.."

scripts/build.sh release
ctest --preset release --parallel "$(nproc)" "$@"
