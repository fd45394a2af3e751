"""A million rays from NumPy to hits, beside the program's own rate: rate.py RETRACE [--scene SCENE] [--rays N] [--repeat N] [--engine NAME]

The program's rate is that of `retrace trace`, which counts the time in the engine alone; the module's is that of the whole call, ray quantisation and hit records included.
Runs alternate, so that both see the same machine; prints both medians and their ratio.
"""
import argparse
import json
import pathlib
import statistics
import subprocess
import tempfile
import time

import numpy as np
import retrace


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("program")
    parser.add_argument("--scene", default="room:detail=0.3")
    parser.add_argument("--rays", type=int, default=1_000_000)
    parser.add_argument("--repeat", type=int, default=5)
    parser.add_argument("--engine", action="append")
    arguments = parser.parse_args()
    random = np.random.default_rng(1)
    image = retrace.Scene.open(arguments.scene, textures=False).build()
    rays = retrace.rays([0, 1.2, 0], random.normal(size=(arguments.rays, 3)))
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        np.save(folder / "rays.npy", rays)
        for kind in arguments.engine or ["golden", "csim"]:
            engine, out, program, module = image.engine(kind), np.empty(len(rays), retrace.HIT), [], []
            for _ in range(arguments.repeat):
                subprocess.run([arguments.program, "trace", arguments.scene, "-i", folder / "rays.npy", "-o", folder / "hits.npy", "-e", kind, "--stats", folder / "stats.json", "-q"],
                               check=True, stdout=subprocess.DEVNULL)
                program.append(len(rays) / json.loads((folder / "stats.json").read_text())["trace_s"])
                began = time.perf_counter()
                engine.trace(rays, out=out)
                module.append(len(rays) / (time.perf_counter() - began))
            assert out.tobytes() == np.load(folder / "hits.npy").tobytes()
            a, b = statistics.median(program), statistics.median(module)
            print("%-8s program %.0f rays/s, module %.0f rays/s, module / program %.3f" % (kind, a, b, b / a), flush=True)


if __name__ == "__main__":
    main()
