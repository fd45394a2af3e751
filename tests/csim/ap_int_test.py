#!/usr/bin/env python3
"""The integers of C simulation are the vendor's: two builds of ap_int_values.cpp print the same checksums.

usage: ap_int_test.py OURS VENDORS      RETRACE_SEED chooses the operands
"""
import os
import subprocess
import sys


def values(program, seed):
    step = subprocess.run([program, seed], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    if step.returncode != 0:
        sys.exit("ap_int_test: %s ended with %d" % (program, step.returncode))
    return step.stdout.splitlines()


def main():
    ours, vendors = sys.argv[1:]
    seed = os.environ.get("RETRACE_SEED", "20070701")
    print("seed", seed)
    a, b = values(ours, seed), values(vendors, seed)
    differ = [(x, y) for x, y in zip(a, b) if x != y]
    for x, y in differ:
        print("ours     %s\nvendor's %s" % (x, y))
    print("%d of %d rows differ" % (len(differ), len(b)))
    return 1 if differ or len(a) != len(b) or len(b) < 100 else 0


if __name__ == "__main__":
    sys.exit(main())
