#!/usr/bin/env bash
# The long runs that scripts/test.sh leaves out, one after the other; a failing one does not stop the rest. Logs and tables go to out/nightly.
# Exit code 1 if one failed; the summary at the end says which, with its command and how long it took.
# usage: scripts/nightly.sh [--list] [NAME...]     default: all; RETRACE_SEED chooses the seed of those that draw
set -uo pipefail
cd "$(dirname "$0")/.."
names=() ; declare -A commands
run() { names+=("$1"); commands[$1]=$2; }
run coverage "scripts/coverage.sh --output out/nightly/coverage.md"
run whole_frames "scripts/whole_frames.sh -o out/nightly/whole-frames.md"
run dram_frames "for memory in ddr3 sdr; do for scene in room /usr/share/assimp/models/glTF2/2CylinderEngine-glTF-Binary/2CylinderEngine.glb; do
  build/release/testbench/sim/core/rtl_bench \$scene small 320x240 --dram \$memory || exit 1; done; done"
run bus "env RETRACE_BUS_TRANSACTIONS=1000000 build/release/tests/rtl_core/rtl_bus_test --gtest_filter=RtlBus.RandomTraffic"
run stages "build/release/testbench/stages/rtl_stages --vectors 100000000"
run netlists "scripts/netlist_sim.sh all"
run watertight "build/release/testbench/csim/tb_watertight knot ${RETRACE_SEED:-1} 10000000"
run instance_table "scripts/instances.py --size 640x480 --output out/nightly/instances.md"
run instances "env RETRACE_RAYS=1000000 build/release/tests/csim/instances_test"
run golden_edges "for mesh in box sphere random sliver; do rays=3200000; [ \$mesh != sliver ] || rays=400000
  build/release/testbench/csim/tb_watertight closed:\$mesh ${RETRACE_SEED:-1} \$rays golden || exit 1; done"
run float "env RETRACE_VECTORS=100000000 RETRACE_ALL_SIGNIFICANDS=1 build/release/tests/shader/float_test && env RETRACE_VECTORS=10000000 build/release/tests/rtl/rtl_float_test"
run hls_export "python3 tests/hls/export_test.py compile --thorough && python3 tests/hls/export_test.py csim --thorough"
run instance_walks "env RETRACE_RAYS=3400000 build/release/tests/csim/two_level_test --gtest_filter=*no_ray*"
run notebook "python3 -m venv build/notebook && build/notebook/bin/pip install --quiet '.[notebook]' && build/notebook/bin/python scripts/notebook.py"
run sweeps "scripts/setup.sh --sweeps && python3 tests/sweeps/sweep_test.py"
run slurm "scripts/setup.sh --slurm && python3 tests/sweeps/slurm_test.py"
run ring_schedules "env RETRACE_RING_SCHEDULES=1000000 build/release/tests/csim/ring_test --gtest_filter=Ring.no_order*"
run mutants "scripts/mutants.sh"
run kernel_mutants "scripts/kernel_mutants.py"

if [ "${1:-}" = --list ]; then
  for name in "${names[@]}"; do printf '%-14s %s\n' "$name" "${commands[$name]}"; done
  exit 0
fi
if (($# > 0)); then names=("$@"); fi
for name in "${names[@]}"; do
  if [ -z "${commands[$name]:-}" ]; then echo "nightly: there is no run '$name'; scripts/nightly.sh --list has them" >&2; exit 2; fi
done
mkdir -p out/nightly
scripts/setup.sh --tools && scripts/build.sh release all || exit 1
failed=0
: >out/nightly/summary.txt
for name in "${names[@]}"; do
  began=$SECONDS
  printf '== %s: %s\n' "$name" "${commands[$name]}"
  if bash -c "${commands[$name]}" >"out/nightly/$name.log" 2>&1; then verdict=passed; else verdict=FAILED; failed=1; tail -5 "out/nightly/$name.log"; fi
  printf '%-14s %-7s %6d s  %s\n' "$name" "$verdict" $((SECONDS - began)) "${commands[$name]}" | tee -a out/nightly/summary.txt
done
exit $failed
