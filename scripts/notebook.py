#!/usr/bin/env python3
"""Runs the notebook docs/embree.ipynb and checks that it prints what it holds; with --write it puts outputs into it and writes docs/embree.md, its page, and its pictures.

usage: scripts/notebook.py [--write]     Needs the module with its notebook's packages: pip install '.[notebook]'

A picture is a figure of matplotlib that is open after a cell. Cells check by themselves what matters; texts hold no times.
"""
import argparse
import contextlib
import io
import json
import pathlib
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
NOTEBOOK = ROOT / "docs/embree.ipynb"
PAGE = ROOT / "docs/embree.md"


def run(cells, pictures):
    """Text and picture of each code cell, run one after the other in one namespace."""
    import matplotlib
    matplotlib.use("agg")
    import matplotlib.pyplot as plt
    space, results = {"__name__": "__main__"}, {}
    for number, cell in enumerate(cells):
        if cell["cell_type"] != "code":
            continue
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed):
            exec(compile("".join(cell["source"]), "%s, cell %d" % (NOTEBOOK.name, number), "exec"), space)
        picture = None
        if plt.get_fignums():
            picture = "pictures/embree-%d.png" % number
            if pictures:
                plt.savefig(ROOT / "docs" / picture, dpi=80, metadata={"Software": None})
            plt.close("all")
        results[number] = printed.getvalue(), picture
    return results


def page(cells, results):
    parts = ["<!-- Written by scripts/notebook.py from embree.ipynb. -->\n"]
    for number, cell in enumerate(cells):
        source = "".join(cell["source"]).rstrip()
        if cell["cell_type"] != "code":
            parts.append(source + "\n")
            continue
        text, picture = results[number]
        parts.append("```python\n%s\n```\n" % source)
        if text:
            parts.append("```text\n%s\n```\n" % text.rstrip())
        if picture:
            parts.append("![The figure of the cell above](%s)\n" % picture)
    return "\n".join(parts)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--write", action="store_true")
    arguments = parser.parse_args()
    notebook = json.loads(NOTEBOOK.read_text(encoding="utf-8"))
    cells = notebook["cells"]
    results = run(cells, arguments.write)
    outputs = {number: [{"name": "stdout", "output_type": "stream", "text": text.splitlines(keepends=True)}] if text else [] for number, (text, _) in results.items()}
    if arguments.write:
        for number, output in outputs.items():
            cells[number]["outputs"] = output
        NOTEBOOK.write_text(json.dumps(notebook, indent=1) + "\n", encoding="utf-8")
        PAGE.write_text(page(cells, results), encoding="utf-8")
        return 0
    wrong = [number for number, output in outputs.items() if cells[number]["outputs"] != output]
    for number in wrong:
        print("notebook: cell %d printed\n%snot what it holds" % (number, results[number][0]), file=sys.stderr)
    if not wrong and PAGE.read_text(encoding="utf-8") != page(cells, results):
        wrong = [-1]
        print("notebook: docs/embree.md is not the notebook's page: scripts/notebook.py --write", file=sys.stderr)
    print("notebook: %d cells, %d differ" % (len(results), len(wrong)))
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
