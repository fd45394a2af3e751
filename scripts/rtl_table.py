"""docs/rtl-stages.md: latency, interval and DSP blocks of every RTL stage as measured in Verilator, and cells as Yosys maps them to an ECP5.

usage: rtl_table.py [--build build/release] [--check]
--check measures latency and interval again and compares them with the committed page (no synthesis).
"""
import argparse
import glob
import json
import os
import re
import subprocess
import sys

from rtl_rooms import rtl_packages, rtl_rooms

PAGE = "docs/rtl-stages.md"
STAGES = ["ray_setup", "kd_descend", "leaf_exit", "kd_backtrack", "tri_test", "hit_finish", "instance_enter"]
CELLS = {"MULT18X18D": "MULT18X18D", "LUT4": "LUT4", "CCU2C": "CCU2C", "TRELLIS_FF": "FF", "TRELLIS_DPR16X4": "DPR16X4", "DP16KD": "DP16KD"}

HEAD = """# The RTL stages in figures

<!-- Written by scripts/rtl_table.py. Do not edit. -->

Latency is counted from the clock in which an input is accepted to the clock in which its result is valid; the interval is the number of clocks from
one acceptance to the next with nothing stalled. Both are measured in Verilator (`rtl_stages --json`) and equal to `rtl/pkg/rt_stage_pkg.sv`.
Cells are what Yosys (`synth_ecp5`, %s) makes of each stage with a 16-bit tag, before placement: 18 x 18 multipliers, 4-input LUTs, two-bit
carry cells, flip-flops, 16 x 4 distributed RAMs, block RAMs.

| stage | latency | interval | MULT18X18D | LUT4 | CCU2C | FF | DPR16X4 | DP16KD |
| --- | --- | --- | --- | --- | --- | --- | --- | --- |
"""
TAIL = """
`ray_setup` and `instance_enter` send their three axes, `hit_finish` its two coordinates, through one pipelined divider, hence their intervals. Every
product of two codes of 27 or 32 bits is four blocks. How to read the contract of a stage: the head of `rtl/*/rt_<stage>.sv`.
"""


def measure(build):
    program = os.path.join(build, "testbench/stages/rtl_stages")
    run = subprocess.run([program, "--json", "--vectors", "2000", "--mode", "none"], capture_output=True, text=True, check=True)
    return {entry["stage"]: (entry["latency"], round(entry["interval"])) for entry in json.loads(run.stdout)}


def synthesize(stage):
    program = """
import sys
from pyosys import libyosys as ys
design = ys.Design()
for command in ["read_slang -j 1 --top rt_{0} -I rtl/pkg {3} {2} {4}", "synth_ecp5 -top rt_{0}", "tee -q -o {1} stat -json"]:
    ys.run_pass(command, design)
"""
    out = "build/rtl_table_%s.json" % stage
    packages = " ".join("rtl/" + path for path in rtl_packages("pkg"))
    folders = " ".join("-y rtl/" + room for room in rtl_rooms("core"))
    source, = glob.glob("rtl/*/rt_%s.sv" % stage)
    os.makedirs("build", exist_ok=True)
    python = os.environ.get("RETRACE_PYTHON", ".env/py/bin/python")
    run = subprocess.run([python, "-c", program.format(stage, out, packages, folders, source)], capture_output=True, text=True)
    if run.returncode != 0:
        sys.exit("rtl_table: yosys failed on rt_%s\n%s" % (stage, (run.stdout + run.stderr)[-2000:]))
    with open(out) as file:
        cells = json.load(file)["design"]["num_cells_by_type"]
    os.remove(out)
    return [cells.get(cell, 0) for cell in CELLS]


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--build", default="build/release")
    parser.add_argument("--check", action="store_true")
    arguments = parser.parse_args()
    measured = measure(arguments.build)
    if arguments.check:
        with open(PAGE) as file:
            rows = re.findall(r"^\| `(\w+)` \| (\d+) \| (\d+) \|", file.read(), re.M)
        committed = {stage: (int(latency), int(interval)) for stage, latency, interval in rows}
        if committed != measured:
            print("rtl_table: %s says %s, measured is %s; run scripts/rtl_table.py" % (PAGE, committed, measured), file=sys.stderr)
            return 1
        return 0
    version = subprocess.run([os.environ.get("RETRACE_PYTHON", ".env/py/bin/python"), "-c",
                              "import importlib.metadata as m; print('pyosys', m.version('pyosys'))"], capture_output=True, text=True, check=True)
    text = HEAD % version.stdout.strip()
    for stage in STAGES:
        row = [*measured[stage], *synthesize(stage)]
        text += "| `%s` | %s |\n" % (stage, " | ".join(str(x) for x in row))
    with open(PAGE + ".tmp", "w") as file:
        file.write(text + TAIL)
    os.replace(PAGE + ".tmp", PAGE)
    return 0


if __name__ == "__main__":
    sys.exit(main())
