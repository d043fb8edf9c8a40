#!/bin/bash
# Redraws the reference pictures of the tests in tests/baselines. Look at each of them before committing.
set -eu
cd "$(dirname "$0")/.."
preset=${1:-release}
programs=(render_test viewer_test)
cmake --build --preset "$preset" --target "${programs[@]}"
for program in "${programs[@]}"; do
  SQSLAM_UPDATE_BASELINES=1 "build/$preset/bin/$program" --gtest_filter='*Baseline*'
done
git status --short tests/baselines
