#!/bin/bash
# Fuzzes the file readers (libFuzzer, AddressSanitizer, UBSan) and prints how many inputs each one was given.
# usage: scripts/fuzz.sh [MINUTES | --runs N] [TARGET]...
#   MINUTES   in all, over all targets; default: 10
#   --runs N  inputs for each target, however long it takes
# Exits with 1 if a reader crashed, took over 5 s or over 1 GiB, or failed with an error that a user would not
# understand. The failing input is kept in build/fuzz/found/TARGET-...: fix the reader, and move the file to
# tests/fuzz/corpus/TARGET, which the ordinary tests replay.
set -euo pipefail
cd "$(dirname "$0")/.."

usage() {
  echo "fuzz.sh: expected MINUTES or --runs N, a whole number above 0, not '$1'" >&2
  exit 2
}
export RUNS=0
minutes=10
if [ "${1:-}" = --runs ]; then
  [[ ${2:-} =~ ^[1-9][0-9]*$ ]] || usage "${2:-}"
  RUNS=$2
  shift 2
elif [ $# -gt 0 ]; then
  [[ $1 =~ ^[1-9][0-9]*$ ]] || usage "$1"
  minutes=$1
  shift
fi
scripts/install-packages.sh clang-16 libclang-rt-16-dev  # 14 does not take libstdc++12's views
scripts/build.sh fuzz
export PROGRAM=build/fuzz/bin/fuzz_readers
targets=("$@")
[ ${#targets[@]} -gt 0 ] || mapfile -t targets < <($PROGRAM)
export SECONDS_EACH=$((60 * minutes * $(nproc) / ${#targets[@]} + 1))
mkdir -p build/fuzz/found
if [ -z "${TMPDIR:-}" ] && [ -w /dev/shm ]; then
  export TMPDIR=/dev/shm  # a file is written for each input
fi
# Allocations are most of what the readers of text do: shorter traces of them, and fewer freed ones kept.
export ASAN_OPTIONS=malloc_context_size=8:quarantine_size_mb=32

fuzz() {
  local target=$1 corpus=build/fuzz/corpus/$1 log=build/fuzz/$1.log known=() limit
  mkdir -p "$corpus"
  [ -d "tests/fuzz/corpus/$target" ] && known=("tests/fuzz/corpus/$target")
  limit=-max_total_time=$SECONDS_EACH
  [ "$RUNS" -eq 0 ] || limit=-runs=$RUNS
  local bytes=4096  # of text: longer files repeat what shorter ones say
  case $target in dense_points | photograph | recording | snapshot | vocabulary) bytes=65536 ;; esac
  if SQSLAM_FUZZ_TARGET=$target SQSLAM_FUZZ_SEED=$corpus/seed $PROGRAM "$corpus" "${known[@]}" \
      "$limit" -timeout=5 -rss_limit_mb=1024 -malloc_limit_mb=1024 -max_len=$bytes \
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
printf '%s\n' "${targets[@]}" | xargs -P "$(nproc)" -I{} bash -c "fuzz {}" || failed=1
exit $failed
