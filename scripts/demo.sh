#!/bin/bash
# From a bare Debian 12 to pictures of an object map: installs what is missing, builds, runs `sqslam demo`.
# Arguments go to `sqslam demo`.
set -euo pipefail
cd "$(dirname "$0")/.."

scripts/install-packages.sh
scripts/build.sh release
build/release/bin/sqslam demo "$@"
