#!/usr/bin/env python3
"""Cost, clock and rays per second of the board's configurations: docs/ray-rates.md.

usage: scripts/ray_rates.py [--build DIR] [-o FILE]

Clock and cells are those of the committed reports (docs/results/ecp5-CONFIG.json, made by scripts/bitstream for the whole board). Clocks a ray are
simulated here: primary rays of whole frames, 320x240, in models built for the purpose; every hit must be csim's.
"""
import argparse
import json
import os
import re
import subprocess
import sys

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
ENGINE = "/usr/share/assimp/models/glTF2/2CylinderEngine-glTF-Binary/2CylinderEngine.glb"
SCENES = [("room", "room"), ("2CylinderEngine", ENGINE)]
CONFIGS = {"ecp5l1": 1, "ecp5l2": 2, "ecp5": 4, "ecp5l6": 6}  # lanes
MEMORIES = [
    ("8 B a clock, 40 clocks", "latency=40,bytes=8"),
    ("on the part: 8 B a clock, 4 clocks", "latency=4,bytes=8"),
    ("the board's SDRAM: 2 B a clock, 12 clocks", "latency=12,bytes=2"),
]
# What the field has: primary rays a second, as published.
OTHERS = """
| | primary rays a second | clock | part |
| --- | --- | --- | --- |
| RPU (Woop, Schmittler, Slusallek 2005) | 1.1 M | 66 MHz | Virtex-II 6000 |
| Dynamic SaarCOR (Schmittler, Woop, Wagner, Paul, Slusallek 2004) | 4 M to 12 M | 90 MHz | Virtex-II 6000, all 144 multipliers |
"""


def clock_of(report):
    return "%.1f" % report["fmax_mhz"] + ("" if report["routed"] else " expected after placement, not routed")


def run(command, what):
    step = subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, check=False)
    if step.returncode != 0:
        sys.exit("ray_rates: %s failed: %s" % (what, (step.stderr or step.stdout).strip().splitlines()[-1:]))
    return step.stdout


def read_reports():
    reports = {}
    for config in CONFIGS:
        path = os.path.join(ROOT, "docs/results/ecp5-%s.json" % config)
        try:
            with open(path) as file:
                reports[config] = json.load(file)
        except FileNotFoundError:
            print("ray_rates: %s has no report; make it with scripts/bitstream (docs/board.md)" % config, file=sys.stderr)
        except ValueError as error:
            sys.exit("ray_rates: %s is not a report: %s" % (path, error))
    return reports


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--build", default="build/rates")
    parser.add_argument("-o", "--output", default="docs/ray-rates.md")
    arguments = parser.parse_args()
    reports = read_reports()
    run(["cmake", "--preset", "release", "-B", arguments.build, "-DRETRACE_RTL_CONFIGS=" + ";".join(CONFIGS)], "cmake")
    run(["cmake", "--build", arguments.build, "--target", "rtl_bench"], "the build")
    program = os.path.join(arguments.build, "testbench/sim/core/rtl_bench")  # fails where a hit is not csim's
    lines = [
        "# Cost, clock and rays per second",
        "",
        "Written by `scripts/ray_rates.py`: clock and cells from `docs/results/ecp5-CONFIG.json` (the whole board on an LFE5U-85F, after routing),",
        "clocks a ray by simulation of the same configuration, primary rays of a frame of 320x240, hits equal to csim's.",
        "",
        "| configuration | lanes | MHz | LUTs | FFs | block RAMs | multipliers |",
        "| --- | --- | --- | --- | --- | --- | --- |",
    ]
    for config, lanes in CONFIGS.items():
        if config in reports:
            cells = reports[config]["cells"]
            lines.append("| `%s` | %d | %s | %d | %d | %d | %d |" % (
                config, lanes, clock_of(reports[config]), cells["luts"], cells["ffs"], cells["block_rams"], cells["multipliers"]))
        else:
            lines.append("| `%s` | %d | no report | | | | |" % (config, lanes))
    lines += ["", "| configuration | scene | memory | clocks a ray | million rays a second |", "| --- | --- | --- | --- | --- |"]
    for config in CONFIGS:
        for name, scene in SCENES:
            if scene.startswith("/") and not os.path.exists(scene):
                sys.exit("ray_rates: %s is not there (Debian package assimp-testmodels)" % scene)
            for memory, options in MEMORIES if config == "ecp5" else MEMORIES[:1]:
                said = run([program, scene, config, "320x240", *("--" + option for option in options.split(","))], "rtl_bench %s %s" % (name, config))
                clocks = float(re.search(r"([0-9.]+) clocks/ray", said).group(1))
                rate = "%.2f" % (reports[config]["fmax_mhz"] / clocks) if config in reports and reports[config]["routed"] else ""
                lines.append("| `%s` | %s | %s | %.2f | %s |" % (config, name, memory, clocks, rate))
                print(lines[-1], file=sys.stderr, flush=True)
    lines += [
        "",
        "The board's own memory (32 KB of block RAM) holds neither scene; its row says what the core does where memory answers at once. The SDRAM",
        "of a ULX3S has 16 data lines, two bytes a clock at the core's clock; a controller for it is not part of the project.",
        "", "Against", *OTHERS.rstrip().splitlines(),
    ]
    path = os.path.join(ROOT, arguments.output)
    with open(path + ".tmp", "w") as file:
        file.write("\n".join(lines) + "\n")
    os.replace(path + ".tmp", path)


if __name__ == "__main__":
    main()
