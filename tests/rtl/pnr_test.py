"""scripts/bitstream: its gate bites in both directions, and a bitstream appears only when the clock is met. scripts/placed_timing.py: its estimate.

usage: pnr_test.py [--build FOLDER]
"""
import argparse
import json
import os
import re
import subprocess
import sys
import unittest

COMMAND = [sys.executable, "scripts/bitstream"]
BUILD = ""


def bitstream(*words):
    return subprocess.run([*COMMAND, *words, "--build", BUILD], capture_output=True, text=True, check=False)


class Gate(unittest.TestCase):
    """One place and route; its report is then falsified, and the run with the same command must notice."""

    @classmethod
    def setUpClass(cls):
        cls.report = os.path.join(BUILD, "fifo.json")
        first = bitstream("--top", "rt_fifo", "--mhz", "100", "--report", cls.report)
        assert first.returncode == 0, first.stderr
        with open(cls.report) as file:
            cls.truth = json.load(file)

    def check(self, change):
        falsified = json.loads(json.dumps(self.truth))
        change(falsified)
        path = os.path.join(BUILD, "falsified.json")
        with open(path, "w") as file:
            json.dump(falsified, file)
        return bitstream("--check", path)

    def test_the_truth_passes(self):
        self.assertEqual(self.check(lambda report: None).returncode, 0)

    def test_clock_in_both_directions(self):
        for factor, word in ((0.9, "better"), (1.1, "worse")):
            run = self.check(lambda report, f=factor: report.update(fmax_mhz=report["fmax_mhz"] * f))
            self.assertEqual(run.returncode, 1)
            self.assertRegex(run.stderr, "fmax_mhz is .*%s than" % word)
            self.assertIn("scripts/bitstream --update", run.stderr)

    def test_cells_in_both_directions(self):
        for kind in ("luts", "multipliers"):
            for step, word in ((5, "better"), (-5, "worse")):
                run = self.check(lambda report, k=kind, s=step: report["cells"].update({k: report["cells"][k] + s}))
                self.assertEqual(run.returncode, 1)
                self.assertRegex(run.stderr, "%s is .*%s than" % (kind, word))

    def test_not_a_report(self):
        path = os.path.join(BUILD, "not_a_report.json")
        with open(path, "w") as file:
            file.write("[1]")
        run = bitstream("--check", path)
        self.assertEqual(run.returncode, 1)
        self.assertIn("is not a report", run.stderr)


class PlacedTiming(unittest.TestCase):
    """scripts/placed_timing.py: its clock is near the one that nextpnr gives after placement, and it names what is late."""

    def run_on(self, path, *words):
        return subprocess.run([sys.executable, "scripts/placed_timing.py", path, *words], capture_output=True, text=True, check=False)

    def test_agrees_with_nextpnr(self):
        picture = os.path.join(BUILD, "kd_descend.png")
        run = bitstream("--top", "rt_kd_descend", "--mhz", "80", "--floorplan", picture, "--no-route")
        self.assertEqual(run.returncode, 0, run.stderr)
        after_placement = re.match(r"rt_kd_descend: ([\d.]+) MHz after placement \(target 80\), slack \+", run.stdout)
        self.assertTrue(after_placement, run.stdout)
        self.assertGreater(os.path.getsize(picture), 10000)
        found = self.run_on(os.path.join(BUILD, "rt_kd_descend/seed1.placed.json"), "--mhz", "999", "--paths", "1")
        self.assertEqual(found.returncode, 0, found.stderr)
        clock, late, endpoints = re.match(r"([\d.]+) MHz before routing; (\d+) of (\d+) endpoints later", found.stdout).groups()
        self.assertTrue(0 < int(late) <= int(endpoints))
        expected, clock = float(after_placement.group(1)), float(clock)
        self.assertLess(abs(clock / expected - 1), 0.15, "%g against %g MHz" % (clock, expected))
        self.assertIn("u_ctrl", found.stdout)

    def test_not_a_netlist(self):
        for path in ("README.md", os.path.join(BUILD, "nothing.json")):
            run = self.run_on(path)
            self.assertEqual(run.returncode, 1)
            self.assertEqual(len(run.stderr.strip().split("\n")), 1)
            self.assertIn(path, run.stderr)


class Bitstream(unittest.TestCase):
    def setUp(self):
        self.bit = os.path.join(BUILD, "fifo.bit")
        for path in (self.bit, self.bit + ".tmp"):
            if os.path.exists(path):
                os.remove(path)

    def test_written_when_the_clock_is_met(self):
        run = bitstream("--top", "rt_fifo", "--mhz", "100", "--bit", self.bit)
        self.assertEqual(run.returncode, 0, run.stderr)
        self.assertGreater(os.path.getsize(self.bit), 100000)

    def test_settings_reach_the_router(self):
        for search, margin, estimate in (("near", "8", "1.25"), ("wide", "12", "1.0")):
            run = bitstream("--top", "rt_fifo", "--mhz", "100", "--router", "router2", "--search", search, "--floorplan", os.path.join(BUILD, "fifo.png"))
            self.assertEqual(run.returncode, 0, run.stderr)
            with open(os.path.join(BUILD, "rt_fifo/seed1.placed.json")) as file:
                settings = [module["settings"] for module in json.load(file)["modules"].values() if "settings" in module]
            names = ("router2/bbMargin/x", "router2/bbMargin/y", "router2/estimateWeight")
            self.assertEqual([[group.get(name) for name in names] for group in settings], [[margin, margin, estimate]])

    def test_refused_with_negative_slack(self):
        run = bitstream("--top", "rt_fifo", "--mhz", "999", "--bit", self.bit)
        self.assertEqual(run.returncode, 1)
        self.assertRegex(run.stderr, r"slack is -\d.*no bitstream is written")
        self.assertFalse(os.path.exists(self.bit))

    def test_no_bitstream_without_routing(self):
        run = bitstream("--top", "rt_fifo", "--bit", self.bit, "--no-route")
        self.assertEqual(run.returncode, 2)
        self.assertIn("--no-route", run.stderr)

    def test_search_needs_router2(self):
        run = bitstream("--top", "rt_fifo", "--search", "wide")
        self.assertEqual(run.returncode, 2)
        self.assertIn("--search wide is for router2", run.stderr)

    def test_unknown_module(self):
        run = bitstream("--top", "rt_nothing")
        self.assertEqual(run.returncode, 2)
        self.assertIn("no module rt_nothing", run.stderr)


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--build", default="build/pnr_test")
    arguments, rest = parser.parse_known_args()
    BUILD = os.path.abspath(arguments.build)
    os.makedirs(BUILD, exist_ok=True)
    unittest.main(argv=[sys.argv[0], *rest])
