#!/usr/bin/env python3
"""What one design costs beyond another, by module: a table in Markdown of the cells that `scripts/bitstream --synthesis` has counted.

usage: compare_cells.py ONE.json OTHER.json        the figures are OTHER - ONE; modules that differ by fewer than --least sites, and by no block, are one line
"""
import argparse
import json

KINDS = {"luts": "LUT4", "carry_cells": "CCU2C", "ffs": "FF", "distributed_rams": "DPR16X4", "block_rams": "DP16KD", "multipliers": "MULT18X18D"}
SITES = {"luts": 1, "carry_cells": 2, "distributed_rams": 6}  # of an ECP5, as in scripts/bitstream


def sites(cells):
    return sum(SITES[kind] * cells[kind] for kind in SITES)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("one")
    parser.add_argument("other")
    parser.add_argument("--least", type=int, default=40, help="sites that a module has to differ by to have a line of its own")
    arguments = parser.parse_args()
    designs = []
    for path in (arguments.one, arguments.other):
        with open(path) as file:
            designs.append(json.load(file))
    none = dict.fromkeys(KINDS, 0)
    rest = dict(none)
    rows = []
    for module in sorted(designs[0]["modules"].keys() | designs[1]["modules"].keys()):
        one, other = (design["modules"].get(module, none) for design in designs)
        more = {kind: other[kind] - one[kind] for kind in KINDS}
        if abs(sites(more)) < arguments.least and more["block_rams"] == 0 and more["multipliers"] == 0:
            rest = {kind: rest[kind] + more[kind] for kind in KINDS}
        else:
            rows.append((module, more))
    rows.sort(key=lambda row: -sites(row[1]))
    rows.append(("all others", rest))
    rows.append(("**all**", {kind: designs[1]["cells"][kind] - designs[0]["cells"][kind] for kind in KINDS}))
    print("| %s - %s | sites | %s |" % (designs[1]["design"], designs[0]["design"], " | ".join(KINDS.values())))
    print("| --- |" + " --- |" * (1 + len(KINDS)))
    for module, cells in rows:
        name = module if module.startswith("*") or " " in module else "`%s`" % module
        print("| %s | %d | %s |" % (name, sites(cells), " | ".join(str(cells[kind]) for kind in KINDS)))
    print("| %s | %d | %s |" % (designs[1]["design"], sites(designs[1]["cells"]), " | ".join(str(designs[1]["cells"][kind]) for kind in KINDS)))


if __name__ == "__main__":
    main()
