#!/usr/bin/env bash
# Lints every RTL module: verilator -Wall with the waivers of rtl/waivers.vlt, then Yosys with its slang frontend where pyosys is installed
# (.env/py): it must accept the module, find no combinational loop, no multiple driver and no latch. MODULE:CONFIG is a module in a configuration that is
# not its default; rt_top:ConfigSaarcor, the core of two levels, is one of all.
# Usage: scripts/rtl_lint.sh [--require-yosys] [module...]
set -uo pipefail
cd "$(dirname "$0")/.."

require_yosys=0
if [ "${1:-}" = --require-yosys ]; then
  require_yosys=1
  shift
fi

mapfile -t dirs < <(sed -e '/^#/d' -e 's,^,rtl/,' rtl/rooms.txt)
# Packages of the rooms up to a module's own.
packages_of() {
  local dir
  for dir in "${dirs[@]}"; do
    sed -n "s,^\(${dir#rtl/}/.*_pkg.sv\)\$,rtl/\1,p" rtl/packages.txt
    if [ "$dir" = "$(dirname "$1")" ]; then break; fi
  done
}
modules=("$@")
if ((${#modules[@]} == 0)); then
  for file in $(find "${dirs[@]}" -name 'rt_*.sv' ! -name '*_pkg.sv' | sort); do modules+=("$(basename "$file" .sv)"); done
  modules+=(rt_top:ConfigSaarcor)
fi

failed=0
includes=()
for dir in "${dirs[@]}"; do includes+=(-y "$dir"); done
includes+=(+incdir+rtl/pkg)
tasks=()
for named in "${modules[@]}"; do
  module=${named%:*}
  config=()
  if [ "$named" != "$module" ]; then config=("RT_CONFIG=${named#*:}"); fi
  file=$(find "${dirs[@]}" -name "$module.sv")
  mapfile -t packages < <(packages_of "$file")
  tasks+=("$module ${config[*]/#/-D } ${packages[*]} $file")
  if ! verilator --lint-only -Wall --assert "${includes[@]}" "${config[@]/#/+define+}" rtl/waivers.vlt "${packages[@]}" "$file" \
    --top-module "$module"; then
    echo "rtl_lint: verilator finds fault with $named" >&2
    failed=1
  fi
done

python=${RETRACE_PYTHON:-.env/py/bin/python}
if "$python" -c 'import pyosys' 2>/dev/null; then
  "$python" - "${tasks[@]}" <<'PYTHON' || failed=1
import os
import subprocess
import sys

sys.path.insert(0, "scripts")
from rtl_rooms import rtl_rooms

folders = " ".join("-y rtl/" + room for room in rtl_rooms())
bad = 0
for task in sys.argv[1:]:
    module, files = task.split(" ", 1)
    script = "; ".join([
        "read_slang -j 1 --top %s -I rtl/pkg %s %s" % (module, folders, files),
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
