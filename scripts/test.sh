#!/usr/bin/env bash
# Passes every test: set-up, release build, ctest, format and lint, the tests that read input under sanitizers, and
# fuzzing: a minute of each loader, 20 s of the assembler.
# What takes longer, coverage of the RTL among it, is scripts/nightly.
# usage: scripts/test.sh
# RETRACE_SEED chooses another seed for all randomised tests.
set -euo pipefail
cd "$(dirname "$0")/.."
started=$SECONDS
step() { printf '\n== %4d s  %s\n' $((SECONDS - started)) "$*"; }

step "set-up"
scripts/setup.sh --tools

step "release build"
scripts/build.sh release all
step "tests"
ctest --preset release -j "$(nproc)"
step "format and lint"
scripts/lint.sh
scripts/rtl_lint.sh --require-yosys
step "sanitizer build (address, undefined behaviour; fuzz targets)"
scripts/build.sh asan sanitized gltf_fuzz image_fuzz asm_fuzz
step "tests under sanitizers"
ctest --preset asan -L sanitized -j "$(nproc)"

step "fuzzing: glTF loader and memory image, a minute each, and the assembler, 20 s"
pids=()
declare -A seconds=([gltf]=60 [image]=60 [asm]=20)
declare -A shipped=([asm]=golden/shader/programs)  # seeds that the project has anyway
for target in gltf image asm; do
  mkdir -p "out/fuzz/$target"
  "build/asan/tests/fuzz/${target}_fuzz" -max_total_time="${seconds[$target]}" -timeout=20 -rss_limit_mb=3000 -artifact_prefix=out/fuzz/ \
    "out/fuzz/$target" "tests/fuzz/corpus/$target" ${shipped[$target]:-} >"out/fuzz/$target.log" 2>&1 &
  pids+=($!)
done
for pid in "${pids[@]}"; do
  wait "$pid" || { grep -E 'ERROR|SUMMARY|Test unit' out/fuzz/*.log >&2; echo "test: a fuzz target failed, see out/fuzz" >&2; exit 1; }
done
tail -qn 1 out/fuzz/*.log

step "all tests passed"
