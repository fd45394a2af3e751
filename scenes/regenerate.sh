#!/usr/bin/env bash
# Makes the .glb files of this folder anew: scenes/regenerate.sh [path of the retrace program]
set -euo pipefail
cd "$(dirname "$0")"
retrace=$(realpath "${1:-../build/release/testbench/program/retrace}")
grep -v '^#' shipped.txt | while read -r file scene parameters; do
  arguments=()
  for parameter in $parameters; do arguments+=(--set "$parameter"); done
  "$retrace" make-scene "$scene" "${arguments[@]}" -o "$file"
done
