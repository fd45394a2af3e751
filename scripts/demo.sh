#!/usr/bin/env bash
# The main job: renders a furnished room and a real glTF model through the floating-point golden model, the fixed-point kernels and the
# simulated RTL core, compares them ray by ray, and says where the pictures are. Installs what is missing first.
# The simulated core renders at a third of the size, one sample a pixel: it simulates every clock of a core that does millions a second.
# usage: scripts/demo.sh [WIDTHxHEIGHT]   (default 960x640)
set -euo pipefail
cd "$(dirname "$0")/.."
size=${1:-960x640}
[[ $size =~ ^[1-9][0-9]{1,3}x[1-9][0-9]{1,3}$ ]] || { echo "demo: the size must be WIDTHxHEIGHT, 10 to 9999 each, not '$size'" >&2; exit 2; }
small=$(((${size%x*} + 2) / 3))x$(((${size#*x} + 2) / 3))
out=out/demo
log=out/demo/build.log
started=$SECONDS

scripts/setup.sh
mkdir -p "$out"
echo "demo: building the program (log in $log)"
if ! { cmake --preset release -B build/demo -DRETRACE_TESTS=OFF -DRETRACE_RTL_CONFIGS=ecp5 && cmake --build build/demo --target retrace; } >"$log" 2>&1; then
  tail -30 "$log" >&2
  echo "demo: the build failed, see $log" >&2
  exit 1
fi
retrace=build/demo/testbench/program/retrace

models=${RETRACE_MODELS_DIR:-/usr/share/assimp/models}
"$retrace" make-scene room -o "$out/room.glb"
scenes=("$out/room.glb" "$models/glTF2/2CylinderEngine-glTF-Binary/2CylinderEngine.glb")
for scene in "${scenes[@]}"; do
  name=$(basename "$scene" .glb)
  for engine in golden csim; do
    aov=()
    if [ "$engine" = csim ]; then aov=(--aov "depth,normal,id,steps,tests"); fi
    echo "demo: $name through $engine"
    "$retrace" render "$scene" -o "$out/$name.$engine.png" --engine "$engine" --size "$size" --spp 4 --shadows --ao 4 "${aov[@]}"
  done
  echo "demo: $name through rtl, configuration ecp5"
  "$retrace" render "$scene" -o "$out/$name.rtl.png" --engine rtl --size "$small" --spp 1 --shadows
  echo "demo: $name, golden against csim, primary and shadow rays"
  "$retrace" compare "$scene" --engines golden,csim --size 640x480 -o "$out/$name.difference.png"
  echo "demo: $name, all three engines: csim and rtl must give the same bits"
  "$retrace" compare "$scene" --engines golden,csim,rtl --size "$small" -o "$out/$name.engines.png"
done

echo
echo "Pictures, depth, normals, step and test heat maps, and difference images:"
for file in "$out"/*.png "$out"/*.exr; do echo "  $file"; done
echo "demo: $(((SECONDS - started + 30) / 60)) min"
