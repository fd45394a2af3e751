#!/usr/bin/env python3
"""The list of packages stands in one file: rtl/packages.txt names every package once, each behind those it uses, retrace.core repeats it, nobody else does."""
import os
import re
import sys
import unittest

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
sys.path.insert(0, os.path.join(ROOT, "scripts"))
from rtl_packages import rtl_packages  # noqa: E402

READERS = ("CMakeLists.txt", ".cmake", ".py", ".sh", ".tcl")


def text_of(path):
    with open(os.path.join(ROOT, path), errors="replace") as file:
        return file.read()


class Packages(unittest.TestCase):
    def test_every_package_once_and_in_order(self):
        listed = rtl_packages()
        there = [os.path.relpath(os.path.join(folder, name), os.path.join(ROOT, "rtl"))
                 for folder, _, names in os.walk(os.path.join(ROOT, "rtl")) for name in names if name.endswith("_pkg.sv")]
        self.assertEqual(sorted(listed), sorted(there))
        for i, path in enumerate(listed):
            used = set(re.findall(r"\b(rt_\w+_pkg)::", text_of("rtl/" + path)))
            behind = {os.path.basename(p)[:-len(".sv")] for p in listed[i + 1:]}
            self.assertFalse(used & behind, path)

    def test_fusesoc(self):
        found = re.findall(r"^\s*- rtl/(\S+_pkg\.sv)", text_of("retrace.core"), re.M)
        self.assertEqual(found, rtl_packages())

    def test_nobody_else_has_a_list(self):
        for top in ("scripts", "tests", "testbench"):
            for folder, _, names in os.walk(os.path.join(ROOT, top)):
                for name in names:
                    path = os.path.relpath(os.path.join(folder, name), ROOT)
                    if not name.endswith(READERS) and os.path.join(top, name) != "scripts/bitstream":
                        continue
                    found = set(re.findall(r"(?:lib/rt_lib|stages/rt_stage|regs/rt_regs|board/rt_board)_pkg(?:\.sv)?\b[^(]?", text_of(path)))
                    self.assertLessEqual(len(found), 1, "%s names packages by itself: %s" % (path, sorted(found)))


if __name__ == "__main__":
    unittest.main()
