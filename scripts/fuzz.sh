#!/bin/bash
# Fuzzes the file readers (libFuzzer, AddressSanitizer, UBSan) and prints how many inputs each one was given.
# usage: scripts/fuzz.sh [MINUTES [TARGET]...]     default: 10 minutes in all, over all targets of tests/fuzz
# Exits with 1 if a reader crashed, took over 5 s or over 1 GiB, or failed with an error that a user would not
# understand. The failing input is kept in build/fuzz/found/TARGET-...: fix the reader, and move the file to
# tests/fuzz/corpus/TARGET, which the ordinary tests replay.
set -euo pipefail
cd "$(dirname "$0")/.."

minutes=${1:-10}
[[ $minutes =~ ^[0-9]+$ && $minutes -gt 0 ]] || { echo "fuzz.sh: expected MINUTES, a whole number above 0, not '$minutes'" >&2; exit 2; }
shift || true
scripts/install-packages.sh clang-16 libclang-rt-16-dev  # 14 does not take libstdc++12's views
scripts/build.sh fuzz
programs=build/fuzz/bin
targets=("$@")
[ ${#targets[@]} -gt 0 ] || mapfile -t targets < <(cd $programs && ls -1 | sed -n 's/^fuzz_//p' | grep -vx test)
seconds=$((60 * minutes * $(nproc) / ${#targets[@]}))
[ $seconds -gt 0 ] || seconds=1
mkdir -p build/fuzz/found
[ -w /dev/shm ] && export TMPDIR=/dev/shm  # a file is written for each input

fuzz() {
  local target=$1 seconds=$2 corpus=build/fuzz/corpus/$1 log=build/fuzz/$1.log
  mkdir -p "$corpus"
  local known=()
  [ -d "tests/fuzz/corpus/$target" ] && known=("tests/fuzz/corpus/$target")
  if SQSLAM_FUZZ_SEED=$corpus/seed "build/fuzz/bin/fuzz_$target" "$corpus" "${known[@]}" -seed=1 \
      -max_total_time="$seconds" -timeout=5 -rss_limit_mb=1024 -malloc_limit_mb=1024 -max_len=65536 \
      -artifact_prefix="build/fuzz/found/$target-" -print_final_stats=1 >"$log" 2>&1; then
    awk -v name="$target" '/number_of_executed_units/ {n = $2} /peak_rss_mb/ {m = $2} /slowest_unit_time/ {s = $2}
      END {printf "%-14s %9d inputs, slowest %s s, at most %s MiB\n", name, n, s, m}' "$log"
  else
    printf '%-14s FAILED, see %s\n' "$target" "$log"
    return 1
  fi
}
export -f fuzz
failed=0
printf '%s\n' "${targets[@]}" | xargs -P "$(nproc)" -I{} bash -c "fuzz {} $seconds" || failed=1
exit $failed
