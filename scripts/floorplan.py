"""Picture of a placed ECP5: where the cells of each module are.

usage: floorplan.py PLACED.json PICTURE.png [--title TEXT]

PLACED.json is what nextpnr writes with --write. Each tile has the mean of its modules' colours, darker the more of its cells are used; block RAMs and
multipliers are outlined. The legend counts the packed cells of each module.
"""
import argparse
import collections
import os

import matplotlib
matplotlib.use("Agg")
import matplotlib.patches
import matplotlib.pyplot
import numpy

import placed_netlist

CELLS_IN_TILE = 16  # eight LUTs and eight registers
OTHERS = "others"
MODULES_SHOWN = 12
WORDS = {"TRELLIS_COMB": "LUTs", "DP16KD": "block RAMs", "MULT18X18D": "multipliers"}


def group_of(cell):
    """What is drawn as one: a unit of the core, or what is around it."""
    parts = [part for part in placed_netlist.instances_of(cell) if part != "u_core"]
    return parts[0][2:] if parts else OTHERS


def read_cells(path):
    """[(group, type, x, y)] of every cell that has a place."""
    found = []
    for name, cell in placed_netlist.top_cells(path).items():
        place = placed_netlist.place_of(cell)
        if place and cell["type"] in ("TRELLIS_COMB", "TRELLIS_FF", "DP16KD", "MULT18X18D"):
            found.append((group_of(name), cell["type"], *place[:2]))
    return found


def draw(cells, picture, title):
    sizes = collections.Counter(group for group, kind, _, _ in cells if kind in ("TRELLIS_COMB", "TRELLIS_FF"))
    shown = [group for group, _ in sizes.most_common(MODULES_SHOWN)]
    colours = {group: numpy.array(matplotlib.colormaps["tab20"](2 * i % 20 + 2 * i // 20)[:3]) for i, group in enumerate(shown)}
    grey = numpy.array([0.55, 0.55, 0.55])
    width, height = (max(cell[axis] for cell in cells) + 1 for axis in (2, 3))
    ink, total = numpy.zeros((height, width)), numpy.zeros((height, width, 3))
    figure, axes = matplotlib.pyplot.subplots(figsize=(14, 9), dpi=110)
    for group, kind, x, y in cells:
        colour = colours.get(group, grey)
        if kind in ("DP16KD", "MULT18X18D"):
            wide = 2 if kind == "DP16KD" else 1
            axes.add_patch(matplotlib.patches.Rectangle((x - 0.5, y - 0.5), wide, 1, facecolor=colour, edgecolor="black", linewidth=0.3))
        else:
            ink[y, x] += 1
            total[y, x] += colour
    full = numpy.clip(ink / CELLS_IN_TILE, 0, 1)[..., None]
    mean = total / numpy.maximum(ink, 1)[..., None]
    axes.imshow(1 - full * (1 - mean), interpolation="nearest", aspect="equal")
    counts = collections.Counter((group if group in colours else OTHERS, kind) for group, kind, _, _ in cells)
    handles = []
    for group in shown + ([OTHERS] if OTHERS not in shown else []):
        text = ", ".join("%d %s" % (counts[group, kind], word) for kind, word in WORDS.items() if counts[group, kind])
        handles.append(matplotlib.patches.Patch(color=colours.get(group, grey), label="%s: %s" % (group, text)))
    axes.legend(handles=handles, loc="upper left", bbox_to_anchor=(1.01, 1), frameon=False, fontsize=8)
    axes.set_title(title)
    axes.set_xlabel("column")
    axes.set_ylabel("row")
    figure.savefig(picture + ".tmp.png", bbox_inches="tight")
    os.replace(picture + ".tmp.png", picture)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("placed")
    parser.add_argument("picture")
    parser.add_argument("--title", default="")
    arguments = parser.parse_args()
    draw(read_cells(arguments.placed), arguments.picture, arguments.title)


if __name__ == "__main__":
    main()
