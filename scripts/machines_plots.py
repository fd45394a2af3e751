#!/usr/bin/env python3
"""Draws what `retrace machines --json` measured: clocks, bytes, steps and tests a ray of each machine on each scene, and how busy its units are on the first.

usage: machines_plots.py FILE.json OUTPUT.svg    (in an environment with matplotlib, such as .env/py)
"""
import json
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402

QUANTITIES = {"clocks_per_ray": "clocks a ray", "bytes_per_ray": "bytes a ray", "steps_per_ray": "steps a ray", "tests_per_ray": "tests a ray"}
MARKERS = "osD^v*"


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    try:
        with open(sys.argv[1], encoding="utf-8") as file:
            scenes = json.load(file)["scenes"]
        machines = list(dict.fromkeys(row["machine"] for scene in scenes for row in scene["machines"]))
        busy = [("%s: %s" % (row["machine"], unit), 100 * share) for row in scenes[0]["machines"] for unit, share in row["busy"].items()]
        points = {key: [[(row[key], machines.index(row["machine"])) for row in scene["machines"]] for scene in scenes] for key in QUANTITIES}
    except (OSError, ValueError, KeyError, TypeError, IndexError) as error:
        sys.exit("machines_plots: %s is no output of retrace machines --json: %s" % (sys.argv[1], error))
    plt.rcParams.update({"svg.hashsalt": "machines", "svg.fonttype": "none"})
    figure, axes = plt.subplot_mosaic([["clocks_per_ray", "bytes_per_ray", "busy"], ["steps_per_ray", "tests_per_ray", "busy"]], figsize=(15, 7), layout="constrained")
    for i, (key, title) in enumerate(QUANTITIES.items()):
        plot = axes[key]
        for number, scene in enumerate(scenes):
            plot.plot(*zip(*points[key][number]), MARKERS[number % len(MARKERS)], label=scene["name"])
        plot.set_yticks(range(len(machines)), machines if i % 2 == 0 else [])
        plot.set_ylim(len(machines) - 0.5, -0.5)
        plot.set_xscale("log")
        plot.grid(alpha=0.4)
        plot.set_title(title)
    axes["clocks_per_ray"].legend()
    plot = axes["busy"]
    plot.barh(range(len(busy)), [share for _, share in busy])
    plot.set_yticks(range(len(busy)), [label for label, _ in busy], fontsize=8)
    plot.set_ylim(len(busy) - 0.5, -0.5)
    plot.set_xlim(0, 100)
    plot.set_title("units busy, %% of the clocks, %s" % scenes[0]["name"])
    figure.savefig(sys.argv[2], metadata={"Date": None} if sys.argv[2].endswith(".svg") else None)


if __name__ == "__main__":
    main()
