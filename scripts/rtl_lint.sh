#!/usr/bin/env bash
# Lints every RTL module: verilator -Wall with the waivers of rtl/waivers.vlt, then Yosys with its slang frontend where pyosys is installed
# (.env/py): it must accept the module, find no combinational loop, no multiple driver and no latch.
# Usage: scripts/rtl_lint.sh [--require-yosys] [module...]
set -uo pipefail
cd "$(dirname "$0")/.."

require_yosys=0
if [ "${1:-}" = --require-yosys ]; then
  require_yosys=1
  shift
fi

dirs=()
for dir in rtl/lib rtl/stages rtl/cache rtl/regs rtl/top rtl/board; do
  if [ -d "$dir" ]; then dirs+=("$dir"); fi
done
# Packages of a folder and of those before it; the cache also reads the core's sizes.
packages_of() {
  echo rtl/pkg/rt_contract_pkg.sv
  echo rtl/pkg/rt_config_pkg.sv
  local dir
  for dir in "${dirs[@]}"; do
    find "$dir" -name '*_pkg.sv' | sort
    if [ "$dir" = "$(dirname "$1")" ]; then break; fi
  done
  if [ "$(dirname "$1")" = rtl/cache ]; then echo rtl/top/rt_core_pkg.sv; fi
}
modules=("$@")
if ((${#modules[@]} == 0)); then
  for file in $(find "${dirs[@]}" -name 'rt_*.sv' ! -name '*_pkg.sv' | sort); do modules+=("$(basename "$file" .sv)"); done
fi

failed=0
includes=()
for dir in "${dirs[@]}"; do includes+=(-y "$dir" "+incdir+$dir"); done
tasks=()
for module in "${modules[@]}"; do
  file=$(find "${dirs[@]}" -name "$module.sv")
  mapfile -t packages < <(packages_of "$file")
  tasks+=("$module ${packages[*]} $file")
  if ! verilator --lint-only -Wall --assert "${includes[@]}" rtl/waivers.vlt "${packages[@]}" "$file" \
    --top-module "$module"; then
    echo "rtl_lint: verilator finds fault with $module" >&2
    failed=1
  fi
done

python=${RETRACE_PYTHON:-.env/py/bin/python}
if "$python" -c 'import pyosys' 2>/dev/null; then
  "$python" - "${tasks[@]}" <<'PYTHON' || failed=1
import os
import subprocess
import sys

folders = "-y rtl/lib -y rtl/stages -y rtl/cache -y rtl/regs -y rtl/top -y rtl/board"
bad = 0
for task in sys.argv[1:]:
    module, files = task.split(" ", 1)
    script = "; ".join([
        "read_slang -j 1 --top %s -I rtl/lib %s %s" % (module, folders, files),
        "hierarchy -check -top " + module, "proc", "flatten", "opt_clean", "check -assert", "select -assert-none t:$dlatch t:$adlatch"])
    program = "from pyosys import libyosys as ys; d = ys.Design(); [ys.run_pass(c, d) for c in %r.split('; ')]" % script
    run = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    if run.returncode != 0:
        bad += 1
        print("rtl_lint: yosys finds fault with %s\n%s" % (module, (run.stdout + run.stderr)[-1500:]), file=sys.stderr)
sys.exit(1 if bad else 0)
PYTHON
elif ((require_yosys)); then
  echo "rtl_lint: pyosys is not installed in $python" >&2
  failed=1
else
  echo "rtl_lint: pyosys is not installed, the Yosys half is skipped" >&2
fi

if ((failed == 0)); then echo "rtl_lint: ${#modules[@]} modules clean"; fi
exit $failed
