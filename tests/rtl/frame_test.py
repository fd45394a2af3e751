"""The vector file of tb_frame is what frame_vectors writes; and tb_frame, as FuseSoC built it, notices every kind of wrong hit."""
import argparse
import glob
import os
import subprocess
import sys
import tempfile

VECTORS = "testbench/vendor/sv/frame.hex"
FRAME = ["box", "12x8"]


def vectors(arguments):
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "frame.hex")
        subprocess.run([arguments.generator, *FRAME, path], check=True)
        with open(path, "rb") as new, open(VECTORS, "rb") as old:
            if new.read() != old.read():
                sys.exit("%s is not current; write it with: frame_vectors %s %s" % (VECTORS, " ".join(FRAME), VECTORS))


def bites(arguments):
    programs = glob.glob(os.path.join(arguments.build, "**", "Vtb_frame"), recursive=True)
    if len(programs) != 1:
        sys.exit("no simulation in %s: run scripts/fusesoc.sh sim --build %s" % (arguments.build, arguments.build))
    with open(VECTORS, encoding="ascii") as file:
        words = file.read().split()
    image, rays = int(words[0], 16), int(words[1], 16)
    hits = 8 + image + 4 * rays
    flip = lambda place, bit: words[:place] + ["%016x" % (int(words[place], 16) ^ 1 << bit)] + words[place + 1:]
    cases = [("as it is", words, None), ("first hit", flip(hits, 0), "hit 0, word 0"), ("last hit", flip(hits + 2 * rays - 1, 63), "hit %d, word 1" % (rays - 1)),
             ("magic of the image", flip(8, 0), "status"), ("no rays", flip(1, 6), "no vector file"), ("empty file", ["0"], "no vector file")]
    if rays != 64:
        sys.exit("the case 'no rays' flips bit 6 of the number of rays, which is %d" % rays)
    cases = [case + ([],) for case in cases] + [("bufferable writes", words, "a bufferable write", ["+bufferable"])]
    for name, content, complaint, options in cases:
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "frame.hex")
            with open(path, "w", encoding="ascii") as file:
                file.write("\n".join(content) + "\n")
            run = subprocess.run([programs[0], "+frame=" + path, "+seed=%d" % (len(name) * 7919), *options], capture_output=True, text=True, timeout=120, cwd=folder)
        text = run.stdout + run.stderr
        good = run.returncode == 0 and "64 hits equal" in text if complaint is None else run.returncode != 0 and complaint in text
        print("%-20s %s" % (name, "ok" if good else "NOT as expected:\n" + text))
        if not good:
            sys.exit(1)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("what", choices=["vectors", "bites"])
    parser.add_argument("--generator")
    parser.add_argument("--build")
    arguments = parser.parse_args()
    {"vectors": vectors, "bites": bites}[arguments.what](arguments)


if __name__ == "__main__":
    main()
