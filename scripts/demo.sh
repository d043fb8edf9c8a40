#!/bin/bash
# Installs missing packages on a bare Debian 12, builds sqslam and runs `sqslam demo` with the given arguments.
set -euo pipefail
cd "$(dirname "$0")/.."

scripts/build.sh demo
build/release/bin/sqslam demo "$@"
