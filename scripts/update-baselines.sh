#!/bin/sh
# Draws the baseline pictures of the tests anew, into tests/baselines. Look at every one of them before committing.
set -eu
cd "$(dirname "$0")/.."
preset=${1:-release}
cmake --build --preset "$preset" --target render_picture_test
SQSLAM_UPDATE_BASELINES=1 "build/$preset/bin/render_picture_test" --gtest_filter='*Baseline*'
git status --short tests/baselines
