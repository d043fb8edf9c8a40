#!/bin/bash
# Draws the baseline pictures of the tests anew. Look at each of them (git diff shows which changed) before commit.
set -euo pipefail
cd "$(dirname "$0")/.."

cmake --build --preset release --target render_picture_test
SQSLAM_UPDATE_BASELINES=1 build/release/bin/render_picture_test --gtest_filter='*Look*As*Did*'
git status --short tests/baselines
