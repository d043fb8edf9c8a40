#!/bin/sh
# Draws the baseline pictures of the tests anew, into tests/baselines. Look at every one of them before committing.
set -eu
cd "$(dirname "$0")/.."
preset=${1:-release}
cmake --build --preset "$preset" --target render_picture_test render_figure_test
for program in render_picture_test render_figure_test; do
  SQSLAM_UPDATE_BASELINES=1 "build/$preset/bin/$program" --gtest_filter='*Baseline*'
done
git status --short tests/baselines
