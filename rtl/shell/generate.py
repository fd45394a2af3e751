#!/usr/bin/env python3
"""Generates what follows from rt_regs.rdl: rt_regs.sv, rt_regs_pkg.sv, rt_regs.h, and on request the HTML page.

usage: generate.py [--check] [--html FOLDER]
--check writes nothing and exits 1 if a generated file differs from the one in the tree.
Needs peakrdl-cli 1.5.0, peakrdl-regblock 1.3.1, peakrdl-cheader, peakrdl-html on the PATH or next to this Python.
"""
import argparse
import filecmp
import pathlib
import shutil
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
NOT_INSTALLED = 77  # ctest shows the test as skipped
FILES = ("rt_regs.sv", "rt_regs_pkg.sv", "rt_regs.h")


def peakrdl() -> str:
    """The tool beside this interpreter (an environment of the project's own), else the one on the PATH."""
    beside = pathlib.Path(sys.executable).parent / "peakrdl"
    found = str(beside) if beside.exists() else shutil.which("peakrdl")
    if not found:
        print("generate.py: peakrdl not found; pip install peakrdl-cli==1.5.0 peakrdl-regblock==1.3.1 peakrdl-cheader peakrdl-html", file=sys.stderr)
        sys.exit(NOT_INSTALLED)
    return found


def run(*arguments: str) -> None:
    subprocess.run([peakrdl(), *arguments], check=True, stdout=subprocess.DEVNULL)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true")
    parser.add_argument("--html", metavar="FOLDER")
    options = parser.parse_args()
    source = str(HERE / "rt_regs.rdl")
    if options.html:
        run("html", source, "-o", options.html)
        return 0
    with tempfile.TemporaryDirectory() as folder:
        run("regblock", source, "-o", folder, "--cpuif", "axi4-lite-flat", "--rt-read-fanin")
        run("c-header", source, "-o", f"{folder}/rt_regs.h")
        differing = [f for f in FILES if not (HERE / f).exists() or not filecmp.cmp(HERE / f, f"{folder}/{f}", shallow=False)]
        if options.check:
            for name in differing:
                print(f"generate.py: rtl/shell/{name} is not what rt_regs.rdl gives; run rtl/shell/generate.py", file=sys.stderr)
            return 1 if differing else 0
        for name in differing:
            shutil.copyfile(f"{folder}/{name}", HERE / name)
            print(f"wrote rtl/shell/{name}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
