#!/usr/bin/env bash
# Runs the targets of retrace.core with the pinned FuseSoC of the project.
# usage: scripts/fusesoc.sh lint|lint_board|sim|ecp5 [--build FOLDER] [--top MODULE]
#   lint   verilator -Wall over the core (lint_board: over the board of the ULX3S)
#   sim    a frame through the core in Verilator, hits compared in every byte
#   ecp5   place and route (scripts/bitstream), report in FOLDER/ecp5.json; --top places one module, a stage say, instead of rt_top
set -euo pipefail
cd "$(dirname "$0")/.."
target=${1:-}
case $target in lint | lint_board | sim | ecp5) shift ;; *) sed -n '3,6s/^# //p' "$0" >&2; exit 2 ;; esac
build=build/fusesoc
export RETRACE_ROOT=$PWD RETRACE_PNR_TOP=rt_top
while (($#)); do
  case $1 in
    --build) build=${2:?--build needs a folder} ;;
    --top) RETRACE_PNR_TOP=${2:?--top needs a module} ;;
    *) echo "fusesoc: unknown option '$1'" >&2; exit 2 ;;
  esac
  shift 2
done
fusesoc=.env/py/bin/fusesoc
if [ ! -x "$fusesoc" ]; then
  echo "fusesoc: FuseSoC is not installed; run scripts/setup.sh --tools" >&2
  exit 1
fi
mkdir -p "$build"
build=$(cd "$build" && pwd)
export RETRACE_PNR_REPORT=$build/ecp5.json
rm -f "$RETRACE_PNR_REPORT"
"$fusesoc" --cores-root "$PWD" run --build-root "$build" --target="$target" ::retrace
if [ "$target" = ecp5 ] && [ ! -s "$RETRACE_PNR_REPORT" ]; then
  echo "fusesoc: place and route has written no report" >&2
  exit 1
fi
