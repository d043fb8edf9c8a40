#!/bin/bash
# From a bare Debian 12 to pictures of an object map: installs what is missing, builds sqslam, runs `sqslam demo`.
# Arguments go to `sqslam demo`.
set -euo pipefail
cd "$(dirname "$0")/.."

scripts/build.sh demo
build/release/bin/sqslam demo "$@"
