#!/usr/bin/env python3
"""Rows of docs/performance.md: clocks a ray of one step after the other.

usage: scripts/performance_steps.py [--step NAME]... [--program FILE] [--sizes WIDTHxHEIGHT[:FIRST-END],...]

A step is a configuration of this tree with some fields changed (rtl/targets/core.toml), or one of an earlier revision. Those of a revision are built together in
build/steps/REVISION. A row is rtl_bench: primary rays, memory of 8 bytes a clock and a latency of 40 clocks, every hit equal to csim's; FIRST-END: these rows of
the image only. --program: an rtl_bench that has the step's configuration already.
"""
import argparse
import os
import re
import subprocess
import sys

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
ENGINE = "/usr/share/assimp/models/glTF2/2CylinderEngine-glTF-Binary/2CylinderEngine.glb"
SCENES = [("room", "room"), ("2CylinderEngine", ENGINE)]
BEFORE, SINK = "3a488da", "fd532ed"
# Name -> revision, configuration, fields that are changed, more options of rtl_bench.
STEPS = {
    "before": (BEFORE, "ecp5", {}, []),
    "sink": (SINK, "ecp5", {}, []),
    "launch": ("HEAD", "ecp5", {}, []),
    "returns": ("HEAD", "ecp5", {"leaf_returns": 1}, []),
    "registers": ("HEAD", "ecp5", {"mshrs": 16}, []),
    "fast": ("HEAD", "fast", {}, []),
    "cost": ("HEAD", "fast", {}, ["--intersection-cost", "1.5"]),
}
SHOWN = ["lanes", "leaf unit", "references", "tri_test", "results", "bus"]


def run(command, what, folder=ROOT):
    step = subprocess.run(command, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, check=False)
    if step.returncode != 0:
        sys.exit("performance_steps: %s failed: %s" % (what, (step.stderr or step.stdout).strip().splitlines()[-1:]))
    return step.stdout


def model_of(name):
    """The configuration that stands for a step: itself, or a new one."""
    _, configuration, fields, _ = STEPS[name]
    return "step_" + name if fields else configuration


def build(revision, names):
    """rtl_bench of a revision with the configurations of some steps; the environment is this tree's."""
    folder = os.path.join(ROOT, "build/steps", revision)
    if not os.path.exists(folder):
        run(["git", "worktree", "add", "--detach", folder, revision], "the worktree of " + revision)
        os.symlink(os.path.join(ROOT, ".env"), os.path.join(folder, ".env"))
    path = os.path.join(folder, "rtl/targets/core.toml")
    run(["git", "checkout", path], "the description of " + revision, folder)
    with open(path) as file:
        text = file.read()
    for name in names:
        _, configuration, fields, _ = STEPS[name]
        if not fields:
            continue
        body = re.search(r"^\[configuration\.%s\]\n(.*?)^\n" % configuration, text, re.S | re.M).group(1)
        kept = [line for line in body.splitlines() if line.split(" =")[0] not in ("verified", "text", *fields)]
        text = text.replace("\n# Who reads:", "\n".join(["", "[configuration.%s]" % model_of(name), 'text = "A step."', "verified = []", *kept,
                                                         *("%s = %d" % field for field in fields.items()), "", "# Who reads:"]), 1)
    with open(path, "w") as file:
        file.write(text)
    run([sys.executable, "rtl/targets/generate.py"], "the configurations of " + revision, folder)
    models = ";".join(sorted({model_of(name) for name in names}))
    run(["cmake", "--preset", "release", "-DRETRACE_TESTS=OFF", "-DRETRACE_RTL_CONFIGS=" + models, "-DRETRACE_RTL_QUICK_CONFIGS="], "cmake of " + revision, folder)
    run(["cmake", "--build", "build/release", "--target", "rtl_bench"], "the build of " + revision, folder)
    return os.path.join(folder, "build/release/testbench/sim/core/rtl_bench")


def row(name, scene, path, size, program):
    size, _, rows = size.partition(":")
    command = [program, path, model_of(name), size, "--latency", "40", "--bytes", "8", *STEPS[name][3], *(["--rows", rows] if rows else [])]
    said = run(command, "rtl_bench %s %s" % (scene, model_of(name)))
    clocks = re.search(r"([\d.]+) clocks/ray", said).group(1)
    read, written = re.search(r"bytes/ray read ([\d.]+) written ([\d.]+)", said).groups()
    leaves, tests = re.search(r"a ray: .* leaf ([\d.]+) tests ([\d.]+) skipped", said).groups()
    busy = dict(re.findall(r"^  (\w[\w ]*?) +busy +([\d.]+) %", said, re.M))
    cells = [name, scene, size + (", rows " + rows if rows else ""), clocks, "%.1f" % (float(read) + float(written)), leaves, tests,
             " / ".join("%.0f" % float(busy[unit]) if unit in busy else "-" for unit in SHOWN)]
    return "| " + " | ".join(cells) + " |"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--step", action="append", choices=list(STEPS))
    parser.add_argument("--program")
    parser.add_argument("--sizes", default="320x240")
    arguments = parser.parse_args()
    names = arguments.step or list(STEPS)
    print("| step | scene | size | clocks a ray | bytes a ray | leaves | tests | busy, percent: %s |" % ", ".join(SHOWN))
    print("| --- " * 8 + "|", flush=True)
    programs = {}
    # By their hashes: a folder of an earlier HEAD must not stand for this one.
    revisions = {name: run(["git", "rev-parse", "--short", STEPS[name][0]], "the revision of " + name).strip() for name in names}
    for name in names:
        revision = revisions[name]
        if arguments.program is None and revision not in programs:
            programs[revision] = build(revision, [other for other in names if revisions[other] == revision])
        for scene, path in SCENES:
            for size in arguments.sizes.split(","):
                print(row(name, scene, path, size, arguments.program or programs[revision]), flush=True)


if __name__ == "__main__":
    main()
