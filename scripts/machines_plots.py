#!/usr/bin/env python3
"""Draws what `retrace machines --json` measured: clocks, bytes, steps and tests a ray of each machine on each scene, and where its clocks went.

usage: machines_plots.py FILE.json OUTPUT.svg    (in an environment with matplotlib, such as .env/py)
"""
import json
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402

QUANTITIES = {"clocks_per_ray": "clocks a ray", "bytes_per_ray": "bytes a ray", "steps_per_ray": "steps a ray", "tests_per_ray": "tests a ray"}


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    try:
        with open(sys.argv[1], encoding="utf-8") as file:
            scenes = json.load(file)["scenes"]
        machines = list(dict.fromkeys(row["machine"] for scene in scenes for row in scene["machines"]))
    except (OSError, ValueError, KeyError, TypeError) as error:
        sys.exit("machines_plots: %s is no output of retrace machines --json: %s" % (sys.argv[1], error))
    plt.rcParams["svg.hashsalt"] = "machines"
    figure, axes = plt.subplots(2, 3, figsize=(15, 8), layout="constrained")
    width = 0.8 / max(len(scenes), 1)
    for plot, (key, title) in zip(axes.flat, QUANTITIES.items()):
        for i, scene in enumerate(scenes):
            rows = {row["machine"]: row[key] for row in scene["machines"]}
            plot.barh([m + i * width for m in range(len(machines))], [rows.get(machine, 0) for machine in machines], width, label=scene["name"])
        plot.set_yticks([m + 0.4 - width / 2 for m in range(len(machines))], machines)
        plot.set_xscale("log")
        plot.set_title(title)
        plot.invert_yaxis()
    axes.flat[0].legend()
    busy = axes.flat[4]
    labels, shares = [], []
    for row in scenes[0]["machines"] if scenes else []:
        for unit, share in row["busy"].items():
            labels.append("%s: %s" % (row["machine"], unit))
            shares.append(100 * share)
    busy.barh(range(len(labels)), shares)
    busy.set_yticks(range(len(labels)), labels, fontsize=7)
    busy.set_title("units busy, %% of the clocks, %s" % (scenes[0]["name"] if scenes else ""))
    busy.invert_yaxis()
    axes.flat[5].axis("off")
    figure.savefig(sys.argv[2], metadata={"Date": None})


if __name__ == "__main__":
    main()
