#!/usr/bin/env bash
# Line and toggle coverage of the RTL over the benches of library, stages and core: writes docs/coverage.md. Exit code 1 below 90 %.
# The core is that of two configurations, of which one counts toggles, without the frames, errors and images that test one thing for long: all of them
# together add two bits in a thousand to the count.
# usage: scripts/coverage.sh [--output FILE|-] [--missing]
set -euo pipefail
cd "$(dirname "$0")/.."
data=build/coverage/data
tests=(rtl/rtl_lib_test rtl/rtl_stages_test rtl_core/rtl_core_test)
mkdir -p build
build() {  # build PRESET TARGET...: quiet unless it fails
  { cmake --preset "$1" && cmake --build "build/$1" --target "${@:2}"; } >build/coverage.log 2>&1 || { tail -30 build/coverage.log >&2; exit 1; }
}
build release retrace_hls retrace_csim retrace_testkit retrace_generators retrace_image
build coverage "${tests[@]##*/}"
rm -rf "$data"
mkdir -p "$data"
export RETRACE_COVERAGE=$data RETRACE_VECTORS=${RETRACE_VECTORS:-100000} GTEST_TOTAL_SHARDS=4
run() {  # run TEST SHARD: its name and that it failed go to standard error, with the end of what it said
  local log=build/coverage/${1##*/}-$2.log
  GTEST_SHARD_INDEX=$2 "build/coverage/tests/$1" --gtest_brief=1 --gtest_filter=-*slivers*:*needles*:*EveryPositionOfAnError:*CorruptImages* >"$log" 2>&1 ||
    { tail -30 "$log" >&2; echo "coverage: ${1##*/} failed" >&2; exit 255; }
}
export -f run
for test in rtl_core/rtl_core_test rtl/rtl_stages_test rtl/rtl_lib_test; do
  for shard in 0 1 2 3; do echo "$test $shard"; done
done | xargs -P "$(nproc)" -L 1 bash -c 'run "$0" "$1"'
python3 scripts/coverage.py --data "$data" "$@"
