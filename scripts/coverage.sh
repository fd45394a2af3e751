#!/usr/bin/env bash
# Line and toggle coverage of the RTL over the benches of library, stages and core: writes docs/coverage.md. Exit code 1 below 90 %.
# The core is that of two configurations; lines count in both, bits in one. The frames and errors that test one thing for long are left out:
# together they add one bit in a thousand to the count.
# usage: scripts/coverage.sh [--output FILE|-] [--missing]
set -euo pipefail
cd "$(dirname "$0")/.."
data=build/coverage/data
tests=(rtl_core/rtl_core_test rtl/rtl_stages_test rtl/rtl_lib_test)  # the longest first
scripts/build.sh release retrace_hls retrace_csim retrace_testkit retrace_generators retrace_render  # lent to the preset `coverage`
scripts/build.sh coverage "${tests[@]##*/}"
rm -rf "$data"
mkdir -p "$data"
shards=16
export RETRACE_COVERAGE=$data RETRACE_VECTORS=${RETRACE_VECTORS:-100000} GTEST_TOTAL_SHARDS=$shards
run() {  # run TEST SHARD: where it fails, the end of what it said and its name go to standard error; 255 stops xargs
  local log=build/coverage/${1##*/}-$2.log
  GTEST_SHARD_INDEX=$2 "build/coverage/tests/$1" --gtest_brief=1 --gtest_filter=-*slivers*:*needles*:*EveryPositionOfAnError >"$log" 2>&1 ||
    { tail -30 "$log" >&2; echo "coverage: ${1##*/} failed" >&2; exit 255; }
}
export -f run
for test in "${tests[@]}"; do
  for ((shard = 0; shard < shards; shard++)); do echo "$test $shard"; done
done | xargs -P "$(nproc)" -L 1 bash -c 'run "$0" "$1"'
python3 scripts/coverage.py --data "$data" "$@"
