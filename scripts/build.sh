#!/usr/bin/env bash
# Configures a preset and builds targets of it. Says nothing unless that fails: then the errors and the name of the log, build/PRESET.log; exit code 1.
# usage: scripts/build.sh PRESET TARGET...
set -euo pipefail
cd "$(dirname "$0")/.."
if (($# < 2)); then
  echo "usage: scripts/build.sh PRESET TARGET..." >&2
  exit 2
fi
preset=$1
shift
mkdir -p build
if ! { cmake --preset "$preset" && cmake --build "build/$preset" --target "$@"; } >"build/$preset.log" 2>&1; then
  grep -E 'error|FAILED|undefined' -A8 "build/$preset.log" | head -60 >&2 || tail -40 "build/$preset.log" >&2
  echo "build: preset $preset failed, see build/$preset.log" >&2
  exit 1
fi
