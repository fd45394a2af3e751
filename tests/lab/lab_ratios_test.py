"""Work counts of `retrace lab` on a surface seen from outside (the knot) agree with the literature in order and ratio.

Foley & Sugerman 2005, camera rays: restart 3.2, backtrack 1.7, stack 1 in nodes visited; Horn et al. 2007: a short stack of 4 stays within
10 % of the full one; mailboxes save a third of the tests or more where triangles stand in several cells by their bounding box. And
docs/lab.md says what is measured: every row of its tables of this scene is compared. Prints the ratios.
Usage: lab_ratios_test.py RETRACE LAB.md
"""
import json
import pathlib
import re
import subprocess
import sys
import tempfile

SHORT = 1.10         # the short stack's visits over the full stack's
ABOUT = 0.20         # how far a ratio may be from the published one
RESTART, BACKTRACK = 3.2, 1.7
SAVED = 1 / 3        # of the tests, by an exact mailbox
CHECKED = ["kd-sah/", "kd-unclipped/", "grid-pharr"]


def tables(text):
    """Rows of all tables of the scene without their build times, with the line before each table."""
    rows, about = [], ""
    for line in text.splitlines():
        if not line.startswith("|"):
            about = line or about
            continue
        cells = [c.strip() for c in line.strip("|").split("|")]
        if "build s" in line:
            about = "build"
        if about == "build" and len(cells) > 4:
            del cells[2]
        rows.append((about, tuple(cells)))
    return rows


def main() -> int:
    with tempfile.TemporaryDirectory() as folder:
        page = pathlib.Path(folder) / "lab.md"
        run = subprocess.run([sys.argv[1], "lab", "knot", "--json", "--markdown", page, "-q", *(x for key in CHECKED for x in ("--only", key))],
                             capture_output=True, text=True, check=True)
        measured = page.read_text()
    failures = []
    interior, tests = {}, {}
    for row in json.loads(run.stdout)["scenes"][0]["structures"]:
        work = row["rays"]["primary"]["per_ray"]
        if row["mailbox"] == 0:
            interior[row["key"]] = work["down"] + work["up"]
        if row["mailbox"] == "exact":
            tests[row["key"]] = [r["per_ray"]["skipped"] / (r["per_ray"]["tests"] + r["per_ray"]["skipped"]) for r in row["rays"].values()]
    for tree in ("kd-sah", "kd-unclipped"):
        ratio = {key.split("/")[1]: visits / interior[tree + "/stack"] for key, visits in interior.items() if key.startswith(tree + "/")}
        for name, value in ratio.items():
            print(f"{tree}/{name}: {interior[f'{tree}/{name}']:.2f} interior nodes a ray, {value:.2f} of the stack")
        for back in ("backtrack-boxes", "backtrack-plane"):
            if not ratio["restart"] > ratio[back] > 1:
                failures.append(f"{tree}: restart > {back} > stack does not hold")
        if ratio["short-stack-4"] > SHORT:
            failures.append(f"{tree}: the short stack of 4 visits more than 10 % more than the stack")
        for name, published in (("backtrack-plane", BACKTRACK), ("restart", RESTART)):
            if tree == "kd-sah" and abs(ratio[name] / published - 1) > ABOUT:
                failures.append(f"{tree}: {name} is at {ratio[name]:.2f} of the stack, far from {published}")
    for key, saved in tests.items():
        print(f"{key}: an exact mailbox saves " + ", ".join(f"{100 * s:.0f} %" for s in saved) + " of the tests (primary, shadow, bounce)")
    for key in ("kd-unclipped/face-links", "grid-pharr"):
        if min(tests[key]) < SAVED:
            failures.append(f"{key}: an exact mailbox saves less than a third")

    documented = re.search(r"^### knot\n(.*?)(?=^### |^<!-- retrace lab: end)", pathlib.Path(sys.argv[2]).read_text(), re.S | re.M)
    if not documented:
        failures.append("docs/lab.md has no tables of the knot; make them with retrace lab --markdown")
    else:
        known, rows = set(tables(documented.group(1))), tables(measured)
        stale = [row for _, row in (r for r in rows if r not in known)]
        print(f"{len(rows) - len(stale)} of {len(rows)} rows stand in docs/lab.md")
        for row in stale:
            failures.append("not in docs/lab.md: " + " | ".join(row))
        if len(rows) < 30:
            failures.append("too few rows were compared")
    for failure in failures:
        print(failure)
    return int(bool(failures))


if __name__ == "__main__":
    sys.exit(main())
