#!/bin/bash
# Installs missing packages, builds, and runs all tests with ctest, to which the arguments are passed.
set -euo pipefail
cd "$(dirname "$0")/.."

scripts/build.sh release
# Without npm or its registry, the tests with these validators are skipped.
if command -v npm >/dev/null && [ ! -d build/release/node_modules/axe-core ]; then
  npm install --silent --no-save --no-package-lock --prefix build/release gltf-validator axe-core ||
    echo "test.sh: no gltf-validator and axe-core from npm: their tests will be skipped" >&2
fi
# One more than processors: some tests wait for the clock of a live camera or for a window.
ctest --preset release --parallel "$(($(nproc) + 1))" "$@"
