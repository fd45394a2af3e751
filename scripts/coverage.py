"""Line and toggle coverage of the RTL: adds up what the models counted (testbench/sim/coverage.hpp) and writes docs/coverage.md.

A point is a branch or block of lines, or one bit of one signal; a module that is instantiated several times, or with several parameters, counts
once: a point is covered if any instance covers it. Exit code 1 if a total is below the bound. Reasons for what is not covered: rtl/coverage.toml.
"""
import argparse
import collections
import glob
import os
import re
import sys
import tomllib

BOUND = 90.0
FIELD = re.compile("\x01([^\x02]+)\x02([^\x01]*)")


def read(folder):
    """{(file, line, kind, what): count} of every point below rtl/."""
    points = collections.Counter()
    names = sorted(glob.glob(os.path.join(folder, "*.dat")))
    if not names:
        sys.exit("coverage: no .dat file in %s: run the tests of a build with RETRACE_RTL_COVERAGE" % folder)
    for name in names:
        with open(name, encoding="utf-8") as file:
            for line in file:
                if not line.startswith("C '"):
                    continue
                text, _, count = line[3:].rpartition("' ")
                field = dict(FIELD.findall(text))
                path = field["f"]
                place = path.rfind("rtl/")
                if place < 0 or "testbench/" in path:
                    continue
                kind = field["page"].split("/")[0]
                what = field.get("o", "") if kind == "v_toggle" else field.get("n", "0") + ":" + field.get("o", "")
                points[(path[place:], int(field["l"]), kind, what)] += int(count)
    return points


def percent(covered, total):
    return 100.0 * covered / total if total else 100.0


def reason_for(reasons, path, line, source, what):
    """The first entry of rtl/coverage.toml that speaks of this point, or None."""
    for entry in reasons:
        if not re.fullmatch(entry["file"], path):
            continue
        if "signal" in entry and what is not None and re.fullmatch(entry["signal"], what):
            return entry
        if "line" in entry and what is None and re.search(entry["line"], source[line - 1]):
            return entry
    return None


def main():
    parser = argparse.ArgumentParser(description="Adds up the coverage of the RTL.")
    parser.add_argument("--data", required=True, help="folder with the .dat files of the models")
    parser.add_argument("--output", default="docs/coverage.md", help="the table; '-' prints it only")
    parser.add_argument("--missing", action="store_true", help="print every point that is not covered")
    arguments = parser.parse_args()
    points = read(arguments.data)
    with open("rtl/coverage.toml", "rb") as file:
        reasons = tomllib.load(file)["reason"]

    modules = collections.defaultdict(lambda: [0, 0, 0, 0])  # lines covered, lines, bits covered, bits
    missing = collections.defaultdict(int)  # reason or None -> points
    unexplained = []
    sources = {}
    for (path, line, kind, what), count in sorted(points.items()):
        toggle = kind == "v_toggle"
        row = modules[path]
        row[3 if toggle else 1] += 1
        if count:
            row[2 if toggle else 0] += 1
            continue
        if path not in sources:
            with open(path, encoding="utf-8") as file:
                sources[path] = file.read().splitlines()
        entry = reason_for(reasons, path, line, sources[path], what if toggle else None)
        missing[entry["why"] if entry else None] += 1
        place = "%s:%d %s" % (path, line, what if toggle else sources[path][line - 1].strip())
        if entry is None:
            unexplained.append(place)
        if arguments.missing:
            print("%-9s %s" % ("" if entry else "NO REASON", place))

    total = [sum(row[i] for row in modules.values()) for i in range(4)]
    lines, bits = percent(total[0], total[1]), percent(total[2], total[3])
    out = ["# Coverage of the RTL", "", "<!-- Written by scripts/coverage.sh. Do not edit. -->", "",
           "Line and toggle coverage as Verilator counts them, over the benches of the library, the stages and the whole core (`scripts/coverage.sh`).",
           "A point is a block of lines, or one bit of a signal. A module that is instantiated several times counts once. Both totals must reach %.0f %%." % BOUND,
           "Of the core, lines count in the configurations `small` and `ecp5`, bits in `small`: widths that only `ecp5` has are not among them.",
           "", "| file | lines | % | signal bits | % |", "| --- | ---: | ---: | ---: | ---: |"]
    for path, row in sorted(modules.items()):
        out.append("| `%s` | %d / %d | %.1f | %d / %d | %.1f |" % (path, row[0], row[1], percent(row[0], row[1]), row[2], row[3], percent(row[2], row[3])))
    out.append("| **all** | %d / %d | **%.1f** | %d / %d | **%.1f** |" % (total[0], total[1], lines, total[2], total[3], bits))
    out += ["", "What is missing, and why (`rtl/coverage.toml`; `scripts/coverage.sh --missing` lists every point):", "", "| points | why |", "| ---: | --- |"]
    for why, count in sorted(missing.items(), key=lambda item: -item[1]):
        out.append("| %d | %s |" % (count, why or "no reason is known: a test is missing"))
    text = "\n".join(out) + "\n"
    if arguments.output == "-":
        print(text)
    else:
        with open(arguments.output, "w", encoding="utf-8") as file:
            file.write(text)
    print("coverage: lines %.1f %%, toggles %.1f %%, %d points without a reason" % (lines, bits, len(unexplained)))
    if min(lines, bits) < BOUND:
        print("coverage: below %.0f %%" % BOUND, file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
