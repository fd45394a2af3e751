#!/usr/bin/env python3
"""Draws docs/core.svg, the block diagram of the RTL core, from the tables below.

usage: core_diagram.py [--png FILE]   (in an environment with matplotlib, such as .env/py)
"""
import argparse
import pathlib

import matplotlib

matplotlib.use("Agg")
import matplotlib.patches as patches  # noqa: E402
import matplotlib.pyplot as plt  # noqa: E402

ROOT = pathlib.Path(__file__).resolve().parent.parent
CORE, SHELL, MEMORY = "#dbe9f6", "#eeeeee", "#fdebd0"
# name: (x, y, width, height, what it does, colour)
BOXES = {
    "rt_ray_source": (0.3, 6.3, 2.0, 1.0, "rays from memory,\nin tiles", SHELL),
    "rt_launch": (3.3, 6.3, 2.0, 1.0, "rt_ray_setup,\na free context", CORE),
    "rt_lane x N": (6.0, 6.3, 2.2, 1.0, "kd_descend,\nkd_backtrack", CORE),
    "rt_leaf_unit": (9.0, 6.3, 2.0, 1.0, "leaf record,\nleaf_exit", CORE),
    "rt_reference_unit": (11.8, 6.3, 2.3, 1.0, "references,\nmailbox", CORE),
    "rt_tri_test": (11.95, 4.4, 2.0, 0.9, "unit triangle", CORE),
    "rt_result_unit": (9.0, 4.35, 2.0, 1.0, "best hit;\non or done", CORE),
    "rt_hit_finish": (6.1, 4.4, 2.0, 0.9, "t, id, u, v", CORE),
    "rt_transform": (12.0, 2.6, 2.3, 0.8, "rows of rt_tri_test and\nrt_entry (levels = 2)", CORE),
    "rt_entry": (9.0, 2.6, 2.0, 0.8, "ray of an object\n(levels = 2)", CORE),
    "rt_hit_sink": (0.3, 4.35, 2.0, 1.0, "lines of 64 bytes\nwith strobes", SHELL),
    "rt_raster": (0.3, 0.7, 2.0, 1.0, "rays from a camera\n(pixels = 1)", SHELL),
    "rt_shadow": (3.3, 0.7, 2.0, 1.0, "rays to the light,\nsamples", SHELL),
    "rt_shade": (6.3, 0.7, 2.2, 1.0, "rt_lookup, rt_turn,\nrt_light, pixels", SHELL),
    "node cache": (6.1, 8.3, 2.0, 0.7, "a port a lane", MEMORY),
    "leaf cache": (9.0, 8.3, 2.0, 0.7, "", MEMORY),
    "list, triangle cache": (11.7, 8.3, 2.5, 0.7, "", MEMORY),
    "rt_control": (3.3, 8.3, 2.0, 0.7, "header, run", CORE),
    "read requests, fills": (3.3, 9.8, 10.9, 0.6, "one memory port: the units' requests in turn", MEMORY),
    "rt_isolate": (0.3, 9.6, 2.0, 0.8, "soft reset", SHELL),
    "registers": (0.3, 8.2, 2.0, 0.8, "AXI4-Lite, counters", SHELL),
}
# (from, to, points, label, where the label stands)
PATHS = [
    ([(2.3, 6.8), (3.3, 6.8)], "rays", (2.8, 6.93)),
    ([(5.3, 6.8), (6.0, 6.8)], "launch", (5.66, 6.93)),
    ([(8.2, 6.8), (9.0, 6.8)], "arrival", (8.6, 6.93)),
    ([(11.0, 6.8), (11.8, 6.8)], "tests", (11.4, 6.93)),
    ([(12.95, 6.3), (12.95, 5.3)], "", None),
    ([(11.95, 4.85), (11.0, 4.85)], "results", (11.48, 4.98)),
    ([(10.0, 6.3), (10.0, 5.35)], "empty leaf, end", (10.75, 5.75)),
    ([(9.4, 5.35), (9.4, 5.85), (7.1, 5.85), (7.1, 6.3)], "return", (8.2, 5.98)),
    ([(9.0, 4.85), (8.1, 4.85)], "finish", (8.55, 4.98)),
    ([(6.1, 4.85), (2.3, 4.85)], "hits", (5.2, 4.98)),
    ([(2.3, 1.45), (2.6, 1.45), (2.6, 6.55), (3.3, 6.55)], "", None),
    ([(3.3, 1.45), (2.6, 1.45), (2.6, 2.0)], "", None),
    ([(2.0, 1.7), (2.0, 2.25), (9.6, 2.25), (9.6, 2.6)], "of the camera, and back (levels = 2)", (11.3, 2.2)),
    ([(1.3, 0.7), (1.3, 0.35), (7.4, 0.35), (7.4, 0.7)], "misses", (4.3, 0.43)),
    ([(5.0, 4.85), (5.0, 1.7)], "", None),
    ([(5.3, 1.2), (6.3, 1.2)], "samples", (5.8, 1.33)),
    ([(7.4, 1.7), (7.4, 2.1), (-0.1, 2.1), (-0.1, 4.6), (0.3, 4.6)], "pixels", (6.5, 2.18)),
    ([(9.6, 4.35), (9.6, 3.85), (4.3, 3.85), (4.3, 6.3)], "free context", (6.9, 3.96)),
    ([(13.6, 6.3), (14.4, 6.3), (14.4, 3.65), (10.6, 3.65), (10.6, 3.4)], "instance", (14.0, 3.73)),
    ([(11.0, 3.1), (12.0, 3.1)], "", None),
    ([(12.0, 2.8), (11.0, 2.8)], "rows", (11.5, 2.62)),
    ([(13.2, 3.4), (13.2, 4.4)], "", None),
    ([(9.0, 3.0), (8.5, 3.0), (8.5, 6.05), (7.7, 6.05), (7.7, 6.3)], "launch", (8.2, 3.1)),
    ([(7.1, 7.3), (7.1, 8.3)], "", None),
    ([(10.0, 7.3), (10.0, 8.3)], "", None),
    ([(12.95, 7.3), (12.95, 8.3)], "", None),
    ([(7.1, 9.0), (7.1, 9.8)], "", None),
    ([(10.0, 9.0), (10.0, 9.8)], "", None),
    ([(12.95, 9.0), (12.95, 9.8)], "", None),
    ([(4.3, 9.0), (4.3, 9.8)], "", None),
    ([(3.3, 10.1), (2.3, 10.1)], "", None),
    ([(2.3, 8.65), (3.3, 8.65)], "run", (2.8, 8.78)),
    ([(0.3, 10.0), (-0.5, 10.0)], "AXI reads", (-0.55, 10.15)),
    ([(0.3, 8.6), (-0.5, 8.6)], "AXI4-Lite", (-0.55, 8.75)),
    ([(0.3, 4.85), (-0.5, 4.85)], "AXI writes", (-0.55, 5.0)),
    ([(1.0, 7.3), (1.0, 7.75), (-0.1, 7.75), (-0.1, 9.8), (0.3, 9.8)], "", None),
]


def draw():
    figure, axes = plt.subplots(figsize=(13, 8.7))
    axes.add_patch(patches.FancyBboxPatch((2.95, 2.45), 11.65, 8.25, boxstyle="round,pad=0.1", facecolor="none", edgecolor="#336699", linewidth=1.6, linestyle="--"))
    axes.text(8.2, 2.55, "rt_core", ha="right", fontsize=12, color="#336699", weight="bold")
    axes.text(0.3, 2.45, "rt_top (AXI)", fontsize=12, color="#555555", weight="bold")
    for name, (x, y, width, height, text, colour) in BOXES.items():
        axes.add_patch(patches.FancyBboxPatch((x, y), width, height, boxstyle="round,pad=0.0,rounding_size=0.08", facecolor=colour, edgecolor="#444444"))
        axes.text(x + width / 2, y + height - 0.24, name, ha="center", va="center", fontsize=10, weight="bold")
        if text:
            axes.text(x + width / 2, y + (height - 0.34) / 2, text, ha="center", va="center", fontsize=8.5)
    for points, label, place in PATHS:
        for begin, end in zip(points[:-2], points[1:-1]):
            axes.plot(*zip(begin, end), color="#222222", linewidth=1.2)
        axes.annotate("", xy=points[-1], xytext=points[-2], arrowprops={"arrowstyle": "-|>", "color": "#222222", "linewidth": 1.2, "shrinkA": 0, "shrinkB": 0})
        if label:
            axes.text(*place, label, ha="center", fontsize=8.5, color="#222222")
    axes.set_xlim(-1.3, 14.8)
    axes.set_ylim(0.1, 10.9)
    axes.axis("off")
    return figure


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--png", help="a picture to look at as well")
    options = parser.parse_args()
    plt.rcParams.update({"svg.hashsalt": "retrace", "svg.fonttype": "none", "font.family": "DejaVu Sans"})
    figure = draw()
    figure.savefig(ROOT / "docs/core.svg", metadata={"Date": None}, bbox_inches="tight")
    if options.png:
        figure.savefig(options.png, dpi=80, bbox_inches="tight")


if __name__ == "__main__":
    main()
