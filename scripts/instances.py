#!/usr/bin/env python3
"""Instances placed in every way through golden model and kernels, ray by ray: writes docs/instances.md.

usage: scripts/instances.py [--retrace PROGRAM] [--size WxH] [--output FILE.md]

Exit code 1 if a comparison has a violation or a lost hit, or the program ends otherwise than with 0.
"""
import argparse
import json
import pathlib
import subprocess
import sys
import tempfile

from models import CLASSES, ROOT

SCENES = [
    ("placed:kind=0", "rigid: turned, sizes 0.6 to 1"),
    ("placed:kind=1", "scaled from 1 down to 1e-3, each as much nearer to the camera"),
    ("placed:kind=2", "squashed 1:100 on an axis of the object"),
    ("placed:kind=3", "sheared"),
    ("placed:kind=4", "mirrored"),
    ("placed:kind=5,count=1000", "nested: three levels of groups, each turned and stretched"),
    ("field", "a thousand objects of four meshes on a plane"),
    ("carousel", "rings that turn and bob"),
]
HEAD = """# Instances

<!-- Written by scripts/instances.py. Do not edit. -->

Scenes of two levels, their instances placed in every way that a record can hold, through golden model and kernels: primary and shadow rays of an image of %s
pixels, classes as in [program](program.md#classes-of-agreement). Printed by `scripts/instances.py --size %s`; one line by
`retrace compare SCENE --two-level on --engines golden,csim --size %s`. *Lost* are exact hits that the kernels overlooked; *false* are hits
outside their triangle, within the [certified band](error-bounds.md#false-hits).

| scene | placement | instances | triangles instanced | image, MB | rays | same | edge | depth | violation | lost | false |
| --- | --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |
"""


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--retrace", type=pathlib.Path, default=ROOT / "build/release/testbench/program/retrace")
    parser.add_argument("--size", default="320x240")
    parser.add_argument("--output", type=pathlib.Path, default=ROOT / "docs/instances.md")
    arguments = parser.parse_args()
    text, failed = HEAD % ((arguments.size,) * 3), []
    with tempfile.TemporaryDirectory(prefix="retrace-instances-") as work:
        stats = pathlib.Path(work) / "stats.json"
        for scene, what in SCENES:
            command = [str(arguments.retrace), "compare", scene, "--two-level", "on", "--engines", "golden,csim", "--size", arguments.size, "--quiet", "--stats", str(stats)]
            result = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
            if result.returncode not in (0, 1) or not stats.exists():
                sys.exit("instances: %s: %s" % (scene, result.stderr.strip()))
            document = json.loads(stats.read_text(encoding="utf-8"))
            stats.unlink()
            kinds = [document["pairs"][0][kind] for kind in ("primary", "shadow") if kind in document["pairs"][0]]
            counts = [sum(kind[key] for kind in kinds) for key in ("rays", *CLASSES, "lost", "false_hits")]
            if counts[1 + CLASSES.index("violation")] or counts[5] or result.returncode:
                failed.append(scene)
            about = document["scene"]
            text += "| `%s` | %s | %s | %s | %.1f | %s |\n" % (scene, what, format(about["instances"], ","), format(about["triangles"], ","), about["image_bytes"] / 1e6,
                                                               " | ".join(format(count, ",") for count in counts))
            print("%-26s %s" % (scene, dict(zip(("rays", *CLASSES, "lost", "false"), counts))), flush=True)
    arguments.output.write_text(text, encoding="utf-8")
    if failed:
        sys.exit("instances: violations or lost hits in " + ", ".join(failed))


if __name__ == "__main__":
    main()
