#!/usr/bin/env bash
# Line and toggle coverage of the RTL over the benches of library, stages and core: writes docs/coverage.md. Exit code 1 below 90 %.
# The core is that of two configurations, without the frames that test one unit for long: they add nothing to the count.
# usage: scripts/coverage.sh [--output FILE|-] [--missing]
set -euo pipefail
cd "$(dirname "$0")/.."
data=build/coverage/data
tests=(rtl/rtl_lib_test rtl/rtl_stages_test rtl_core/rtl_core_test)
cmake --preset coverage >/dev/null
cmake --build build/coverage --target "${tests[@]##*/}" >build/coverage.log 2>&1 || { tail -30 build/coverage.log >&2; exit 1; }
rm -rf "$data"
mkdir -p "$data"
for test in "${tests[@]}"; do
  RETRACE_COVERAGE=$data RETRACE_VECTORS=${RETRACE_VECTORS:-100000} "build/coverage/tests/$test" --gtest_brief=1 --gtest_filter=-*slivers*:*needles* >build/coverage.log 2>&1 ||
    { tail -30 build/coverage.log >&2; exit 1; }
done
python3 scripts/coverage.py --data "$data" "$@"
