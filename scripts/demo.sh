#!/bin/bash
# Installs missing packages on a bare Debian 12, builds sqslam and runs `sqslam demo` with the given arguments.
set -euo pipefail
repository=$(cd "$(dirname "$0")/.." && pwd)

"$repository/scripts/build.sh" demo
"$repository/build/release/bin/sqslam" demo "$@"
