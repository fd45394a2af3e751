#!/usr/bin/env python3
"""Every glTF file of a folder and every generated scene through the program: what is refused and why, what is noted, and the classes of agreement of
golden model and kernels. Writes docs/models.md and the contact sheet docs/pictures/models.png.

usage: scripts/models.py [--retrace PROGRAM] [--models FOLDER] [--output FILE.md] [--sheet FILE.png]

Exit code 1 if a comparison has a violation, or the program ends otherwise than with 0 or 1.
"""
import argparse
import json
import pathlib
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
SCENES = ["box", "coincident", "degenerate", "field", "knot", "needles", "none", "one", "room:detail=0.3", "slivers", "sphere"]
CLASSES = ("same", "edge", "depth", "violation")
COLUMNS = 8
TILE = (160, 120)
HEAD = """# Models

<!-- Written by scripts/models.py. Do not edit. -->

Every glTF file of Debian's `assimp-testmodels` (`/usr/share/assimp/models`, which `scripts/setup.sh` installs) and every generated scene, through
`retrace render --engine csim` and `retrace compare --engines golden,csim --size 320x240`, primary and shadow rays; printed by `scripts/models.py`. What is refused and noted in
general is in [program](program.md#gltf-files).

![Contact sheet of the models that load, in the order of the tables](pictures/models.png)

"""


def run(command):
    return subprocess.run([str(word) for word in command], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def lines_of(result, name):
    lines = [line.removeprefix("retrace: ").removeprefix("error: ") for line in result.stderr.splitlines()]
    return [line.replace(str(name) + ": ", "").replace("|", "\\|") for line in lines if not line.startswith(("render ", "build ", "\r"))]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--retrace", type=pathlib.Path, default=ROOT / "build/release/testbench/program/retrace")
    parser.add_argument("--models", type=pathlib.Path, default=pathlib.Path("/usr/share/assimp/models"))
    parser.add_argument("--output", type=pathlib.Path, default=ROOT / "docs/models.md")
    parser.add_argument("--sheet", type=pathlib.Path, default=ROOT / "docs/pictures/models.png")
    arguments = parser.parse_args()
    models = sorted(path for path in arguments.models.rglob("*") if path.suffix.lower() in (".gltf", ".glb"))
    if not models:
        sys.exit("models: no glTF file in %s; scripts/setup.sh installs assimp-testmodels" % arguments.models)
    loaded, refused, totals, failed = [], [], {}, []
    with tempfile.TemporaryDirectory(prefix="retrace-models-") as work:
        tiles = []
        for scene in models + SCENES:
            name = str(scene.relative_to(arguments.models)) if scene in models else scene
            tile, stats = pathlib.Path(work) / ("%03d.png" % len(tiles)), pathlib.Path(work) / "stats.json"
            result = run([arguments.retrace, "render", scene, "-o", tile, "--engine", "csim", "--size", "%dx%d" % TILE])
            said = lines_of(result, scene)
            if result.returncode == 1:
                refused.append("| `%s` | %s |" % (name, said[-1]))
                continue
            if result.returncode != 0:
                failed.append("%s: render ended with %d" % (name, result.returncode))
                continue
            tiles.append(tile)
            result = run([arguments.retrace, "compare", scene, "--engines", "golden,csim", "--size", "320x240", "--quiet", "--stats", stats])
            if result.returncode != 0:
                failed.append("%s: compare ended with %d" % (name, result.returncode))
            document = json.loads(stats.read_text(encoding="utf-8"))
            kinds = [document["pairs"][0][kind] for kind in ("primary", "shadow") if kind in document["pairs"][0]]
            classes = [sum(kind[key] for kind in kinds) for key in CLASSES]
            for key, count in zip(CLASSES, classes):
                totals[key] = totals.get(key, 0) + count
            loaded.append("| `%s` | %s | %s | %s |" % (name, format(document["scene"]["triangles"], ","), " | ".join(format(c, ",") for c in classes), "<br>".join(said)))
            print("%-70s %s" % (name, classes), flush=True)
        result = run(["oiiotool", *tiles, "--mosaic:pad=4", "%dx%d" % (COLUMNS, (len(tiles) + COLUMNS - 1) // COLUMNS), "-o", arguments.sheet])
        if result.returncode != 0:
            sys.exit("models: oiiotool: " + result.stderr)
    text = HEAD + "## Loaded\n\nRays in each [class](program.md#classes-of-agreement).\n\n| file or scene | triangles | same | edge | depth | violation | notes |\n| --- | ---: | ---: | ---: | ---: | ---: | --- |\n"
    text += "\n".join(loaded) + "\n| **all** | | %s | |\n" % " | ".join("**%s**" % format(totals[key], ",") for key in CLASSES)
    text += "\n## Refused\n\n| file | why |\n| --- | --- |\n" + "\n".join(refused) + "\n"
    arguments.output.write_text(text, encoding="utf-8")
    print("models: %d loaded, %d refused, classes %s" % (len(loaded), len(refused), totals))
    if failed:
        sys.exit("models: " + "; ".join(failed))


if __name__ == "__main__":
    main()
