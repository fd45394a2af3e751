#!/usr/bin/env python3
"""The rooms of rtl/ (rtl/rooms.txt): no module instantiates one of a room above its own. The packages (rtl/packages.txt): each once, behind those it uses;
retrace.core repeats the list, nobody else does."""
import os
import re
import sys
import unittest

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
sys.path.insert(0, os.path.join(ROOT, "scripts"))
from rtl_rooms import rtl_packages, rtl_rooms  # noqa: E402

READERS = ("CMakeLists.txt", ".cmake", ".py", ".sh", ".tcl")


def text_of(path):
    with open(os.path.join(ROOT, path), errors="replace") as file:
        return file.read()


def arrows_up(rooms, modules):
    """[(module, what it instantiates)] where the second stands in a room above. `modules`: {name: (room, text)}."""
    level = {room: i for i, room in enumerate(rooms)}
    found = []
    for name, (room, text) in sorted(modules.items()):
        text = re.sub(r"//[^\n]*", "", text)
        for used in sorted(set(re.findall(r"^\s*(?:else\s+)?(?:begin\s*(?::\s*\w+\s*)?)?(rt_\w+)\s*(?:#\s*\(|u_\w+)", text, re.M)) & set(modules)):
            if level[modules[used][0]] > level[room]:
                found.append((name, used))
    return found


class Rooms(unittest.TestCase):
    def setUp(self):
        self.modules = {}
        for folder, _, names in os.walk(os.path.join(ROOT, "rtl")):
            for name in names:
                if name.startswith("rt_") and name.endswith((".sv", ".v")) and not name.endswith("_pkg.sv"):
                    room = os.path.relpath(folder, os.path.join(ROOT, "rtl"))
                    self.modules[os.path.splitext(name)[0]] = room, text_of("rtl/%s/%s" % (room, name))

    def test_every_room_is_listed(self):
        there = {room for room, _ in self.modules.values()} | {"pkg"}
        self.assertEqual(set(rtl_rooms()), there)

    def test_no_arrow_up(self):
        self.assertGreater(len(self.modules), 50)
        self.assertEqual(arrows_up(rtl_rooms(), self.modules), [])

    def test_an_arrow_up_is_seen(self):
        """Every instance there is, with the order of the rooms turned round."""
        seen = arrows_up(rtl_rooms()[::-1], self.modules)
        for arrow in [("rt_top", "rt_core"), ("rt_core", "rt_lane"), ("rt_lane", "rt_context_pipe"), ("rt_board", "rt_top"), ("rt_result_unit", "rt_fifo")]:
            self.assertIn(arrow, seen)


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
                    found = set(re.findall(r"(?:pkg/rt_lib|pkg/rt_stage|shell/rt_regs|board/rt_board)_pkg(?:\.sv)?\b[^(]?", text_of(path)))
                    self.assertLessEqual(len(found), 1, "%s names packages by itself: %s" % (path, sorted(found)))


if __name__ == "__main__":
    unittest.main()
