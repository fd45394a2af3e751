#!/usr/bin/env bash
# Whole frames through the kernel in C simulation and through the RTL core: every hit must be the same in every byte.
# Primary rays and shadow rays, both ways up, one, four and eight lanes; the memory answers after 1 to 200 clocks, mixes the answers of
# different ids and stalls one clock in five. Writes a Markdown table.
# usage: scripts/whole_frames.sh [--quick] [--bench RTL_BENCH] [-o FILE]     default: docs/whole-frames.md
# RETRACE_SEED chooses the seed of the memory.
set -euo pipefail
cd "$(dirname "$0")/.."
bench=build/release/testbench/sim/core/rtl_bench
output=docs/whole-frames.md
size=320x240
engine=/usr/share/assimp/models/glTF2/2CylinderEngine-glTF-Binary/2CylinderEngine.glb
scenes=(room knot "$engine" needles slivers coincident degenerate one none)
command="scripts/whole_frames.sh"
while [ $# -gt 0 ]; do
  case $1 in
    --quick)
      size=48x36
      scenes=(room:detail=0.05 knot:along=60,around=8 coincident none)
      command="$command --quick"
      ;;
    --bench) bench=${2:?"--bench takes a program"}; shift ;;
    -o) output=${2:?"-o takes a file"}; shift ;;
    *) echo "whole_frames: unknown option '$1'" >&2; exit 2 ;;
  esac
  shift
done
seed=${RETRACE_SEED:-1}
echo "whole_frames: seed $seed" >&2
table=$(mktemp "$output.XXXXXX")
trap 'rm -f "$table"' EXIT
{
  echo "# Whole frames: kernel and RTL core"
  echo
  echo "Written by \`$command\`, seed $seed: frames of $size, hits of the kernel in C simulation and of the RTL core compared in every byte,"
  echo "memory latency 1 to 200 clocks, answers out of order, one clock in five stalled."
  echo
  echo "| scene | rays | configuration | way up | rays traced | hits that differ | clocks a ray |"
  echo "| --- | --- | --- | --- | --- | --- | --- |"
} >"$table"
failed=0
for scene in "${scenes[@]}"; do
  name=$(basename "$scene" .glb)
  if [[ $scene == /* && ! -f $scene ]]; then
    echo "whole_frames: $scene is not there; its rows are missing" >&2
    continue
  fi
  for rays in primary shadow; do
    for configuration in small ecp5 wide; do
      for up in face parent; do
        shadow=0
        [ $rays = shadow ] && shadow=1
        status=0
        text=$("$bench" "$scene" $configuration $size --latency 1-200 --reorder 1 --stall 20 --up $up --shadow $shadow --seed "$seed") || status=$?
        if [ $status -gt 1 ]; then
          echo "whole_frames: $name $rays $configuration $up: rtl_bench ended with $status" >&2
          failed=1
        elif [ $status = 1 ]; then
          echo "whole_frames: $name $rays $configuration $up: hits differ" >&2
          failed=1
        fi
        row=$(sed -nE 's/.*: ([0-9]+) rays, ([0-9]+) differ from csim/\1 | \2/p' <<<"$text")
        clocks=$(sed -nE 's/^ *([0-9.]+) clocks\/ray.*/\1/p' <<<"$text")
        echo "| $name | $rays | $configuration | $up | ${row:-? | ?} | ${clocks:-?} |" | tee -a "$table" >&2
      done
    done
  done
done
[ $failed = 0 ] || exit 1
chmod 644 "$table"
mv "$table" "$output"
