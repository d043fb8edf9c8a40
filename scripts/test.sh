#!/bin/bash
# Installs missing packages, builds, and runs all tests with ctest, to which the arguments are passed.
set -euo pipefail
cd "$(dirname "$0")/.."

scripts/build.sh release
# Without npm or its registry, the one test of this validator is skipped.
if command -v npm >/dev/null && [ ! -d build/release/node_modules/gltf-validator ]; then
  npm install --silent --no-save --no-package-lock --prefix build/release gltf-validator ||
    echo "test.sh: no gltf-validator from npm: its test will be skipped" >&2
fi
# One more than processors: some tests wait for the clock of a live camera or for a window.
ctest --preset release --parallel "$(($(nproc) + 1))" "$@"
