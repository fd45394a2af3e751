#!/usr/bin/env python3
"""Measures the RTL core against its bounds and writes the table of docs/core-performance.md.

usage: scripts/core_performance.py [--program build/release/testbench/program/retrace] [-o FILE]
Primary rays in image order, 320x240, memory latency 40 clocks. Exits with 1, and writes nothing, if a bound does not hold.
"""
import argparse
import json
import os
import pathlib
import subprocess
import sys

ENGINE = "/usr/share/assimp/models/glTF2/2CylinderEngine-glTF-Binary/2CylinderEngine.glb"
SCENES = ["room", ENGINE]
# Configuration, bytes a clock, and what must hold: most clocks a ray, least steps a clock, least share of the clocks the limiting unit is busy.
RUNS = [("ecp5", 8, 20.0, 0.0, 0.75), ("ecp5x128", 16, 15.0, 0.0, 0.75), ("small", 8, None, 0.9, 0.0)]
LEAST_SPEED = 100_000  # simulated clocks a second, ecp5


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--program", default="build/release/testbench/program/retrace")
    parser.add_argument("-o", "--output", default="docs/core-performance.md")
    arguments = parser.parse_args()
    failures = []
    lines = [
        "# What the RTL core does with its clocks",
        "",
        "Written by `scripts/core_performance.py`, which fails if a bound does not hold: primary rays in image order, 320x240, memory latency",
        "40 clocks, closest hit. Shares of the clocks are busy / starved / blocked, in percent; bus: a beat either way.",
        "",
        "| scene | configuration | bytes a clock | clocks a ray | bound | steps a clock | bound | bytes a ray | hit rate node, leaf, triangle |"
        " lanes | leaf unit | references | tri_test | bus |",
        "|" + " --- |" * 14,
    ]
    for configuration, width, most_clocks, least_steps, least_busy in RUNS:
        for scene in SCENES:
            if scene.startswith("/") and not os.path.exists(scene):
                print(f"core_performance: {scene} is not there; its rows are missing", file=sys.stderr)
                continue
            command = [arguments.program, "bench", scene, "--engine", f"rtl:{configuration}", "--memory",
                       f"latency=40,bytes={width}", "--size", "320x240", "--json", "--quiet"]
            run = json.loads(subprocess.run(command, check=True, stdout=subprocess.PIPE).stdout)["rtl"][0]
            what = f"{run['scene']}, {configuration}, {width} bytes a clock"
            if most_clocks and run["clocks_per_ray"] > most_clocks:
                failures.append(f"{what}: {run['clocks_per_ray']:.2f} clocks a ray, at most {most_clocks}")
            if run["steps_per_clock"] < least_steps:
                failures.append(f"{what}: {run['steps_per_clock']:.3f} steps a clock, at least {least_steps}")
            busiest = max(unit["busy"] for unit in run["units"].values())
            if busiest < least_busy:
                failures.append(f"{what}: the limiting unit is busy {100 * busiest:.1f} %, at least {100 * least_busy:.0f} %")
            if configuration == "ecp5" and run["sim_clocks_per_s"] < LEAST_SPEED:
                failures.append(f"{what}: {run['sim_clocks_per_s']:.0f} simulated clocks/s, at least {LEAST_SPEED}")
            rates = ", ".join(f"{run['hit_rate'][name]:.3f}" for name in ("node", "leaf", "triangle"))
            units = [" / ".join(f"{100 * run['units'][name][share]:.0f}" for share in ("busy", "starved", "blocked"))
                     for name in ("lanes", "leaf_unit", "references", "tri_test", "bus")]
            row = [run["scene"], f"`{configuration}`", str(width), f"{run['clocks_per_ray']:.2f}",
                   f"{most_clocks:g}" if most_clocks else "", f"{run['steps_per_clock']:.3f}",
                   f"{least_steps:g}" if least_steps else "", f"{run['bytes_per_ray']:.1f}", rates, *units]
            lines.append("| " + " | ".join(row) + " |")
            print(lines[-1], file=sys.stderr)
    if failures:
        sys.exit("core_performance: " + "\ncore_performance: ".join(failures))
    output = pathlib.Path(arguments.output)
    temporary = output.with_suffix(output.suffix + ".tmp")
    temporary.write_text("\n".join(lines) + "\n")
    temporary.replace(output)


if __name__ == "__main__":
    main()
