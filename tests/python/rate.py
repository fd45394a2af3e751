"""A million rays from NumPy to hits, beside the program's own rate: rate.py RETRACE [--scene SCENE] [--rays N] [--pairs N] [--threads N] [--engine NAME]

Both sides do the same: rays in memory to hits and counted work in memory, the same rays, image and threads, no files. The program's time is `rows_s` of `retrace trace --stats`, the module's that
of the call. They run in pairs, first one, then the other first, so that both see the same machine; what is printed is the median of each and the median of the pairs' ratios, of
wall time and of processor time: where others use the machine, only the latter means something. `engine alone` is the module's rate over the program's rate without the
conversion of rays and hits.
"""
import argparse
import json
import os
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
    parser.add_argument("--pairs", type=int, default=6)
    parser.add_argument("--threads", type=int, default=os.cpu_count())
    parser.add_argument("--engine", action="append")
    arguments = parser.parse_args()
    random = np.random.default_rng(1)
    image = retrace.Scene.open(arguments.scene, textures=False).build()
    rays = retrace.rays([0, 1.2, 0], random.normal(size=(arguments.rays, 3)))
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        np.save(folder / "rays.npy", rays)
        for kind in arguments.engine or ["golden", "csim"]:
            engine, out, sides = image.engine(kind), np.zeros(len(rays), retrace.HIT), {"program": [], "module": []}

            def program():
                subprocess.run([arguments.program, "trace", arguments.scene, "-i", folder / "rays.npy", "-o", folder / "hits.npy", "-e", kind, "--threads", str(arguments.threads),
                                "--stats", folder / "stats.json", "-q"], check=True, stdout=subprocess.DEVNULL)
                stats = json.loads((folder / "stats.json").read_text())
                sides["program"].append((stats["rows_s"], stats["rows_cpu_s"], stats["trace_s"]))

            def module():
                wall, processor = time.perf_counter(), time.process_time()
                engine.trace(rays, work=True, out=out, threads=arguments.threads)
                sides["module"].append((time.perf_counter() - wall, time.process_time() - processor))

            for pair in range(arguments.pairs):
                for side in (program, module) if pair % 2 == 0 else (module, program):
                    side()
            assert out.tobytes() == np.load(folder / "hits.npy").tobytes()
            pairs = list(zip(sides["program"], sides["module"]))
            rate = lambda side, place: len(rays) / statistics.median(times[place] for times in sides[side])
            print("%-7s wall: program %.0f rays/s, module %.0f rays/s, module / program %.3f; processor: %.0f, %.0f, %.3f; wall, engine alone: %.3f" % (
                kind, rate("program", 0), rate("module", 0), statistics.median(a[0] / b[0] for a, b in pairs),
                rate("program", 1), rate("module", 1), statistics.median(a[1] / b[1] for a, b in pairs), statistics.median(a[2] / b[0] for a, b in pairs)), flush=True)


if __name__ == "__main__":
    main()
