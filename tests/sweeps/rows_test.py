"""Targets of scripts/sweep without Snakemake: their jobs, what they make of outputs, job.py, which runs one, and the report of a night."""
import argparse
import json
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
sys.path.insert(0, str(ROOT / "scripts/sweeps"))
import report  # noqa: E402
import targets  # noqa: E402


def options(**given):
    return argparse.Namespace(**{"size": "quick", "engine": "rtl", "seed": 5, "build": pathlib.Path("build/release"), "folder": pathlib.Path("/nowhere"), "scene": None, "seeds": None, "list": True, **given})


class Jobs(unittest.TestCase):
    def test_names_are_unique_and_hold_the_seed(self):
        for name, target in targets.TARGETS.items():
            for size in targets.SIZES:
                for engine in ("rtl", "csim"):
                    jobs = target.jobs(options(size=size, engine=engine))
                    names = [job["name"] for job in jobs]
                    self.assertTrue(names, name)
                    self.assertEqual(len(names), len(set(names)), name)
                    for job in jobs:
                        self.assertRegex(job["name"], r"^[\w.=-]+-seed%d$" % job["seed"])
                        self.assertTrue(all(isinstance(word, str) for word in job["command"]))

    def test_folders_that_jobs_write_to_are_made(self):
        seen = set()
        for target in targets.TARGETS.values():
            for size in targets.SIZES:
                for job in target.jobs(options(size=size)):
                    for word in job["command"]:
                        if word.startswith("/nowhere/"):
                            *folders, _ = pathlib.Path(word).relative_to("/nowhere").parts if word != "/nowhere/synthesis" else ("synthesis", "")
                            self.assertIn(tuple(folders[:1]), {(), *((folder,) for folder in target.folders)}, word)
                            seen.update(folders[:1])
        self.assertEqual(seen, {"reports", "routed", "pictures", "synthesis"})

    def test_a_night_has_enough(self):
        self.assertGreaterEqual(sum(int(job["command"][job["command"].index("--vectors") + 1]) for job in targets.TARGETS["stages"].jobs(options(size="night"))), 10**9)
        explore = targets.TARGETS["explore"]
        self.assertGreaterEqual(len(explore.KB) * len(explore.CONTEXTS) * 2, 24)


class Options(unittest.TestCase):
    """Needs no Snakemake."""

    def test_what_is_no_option_is_refused_before_anything_runs(self):
        for arguments in (["--jobs", "0"], ["--seeds", "0"], ["--seeds", "-1"], ["--seed", "-1"], ["--seed", "2147483648"], ["--size", "huge"], ["--engine", "golden"]):
            step = subprocess.run([sys.executable, str(ROOT / "scripts/sweep"), "stages", "--list", *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, check=False)
            self.assertEqual((step.returncode, step.stdout), (2, ""), arguments)
            self.assertIn(arguments[0], step.stderr)


class Values(unittest.TestCase):
    def test_stages(self):
        stages, job = targets.TARGETS["stages"], {"name": "stages-csim-kd_descend-seed3", "seed": 3}
        self.assertEqual(stages.values(job, "kd_descend   1000 vectors, seed 3, 0 differ\n"), [{"stage": "kd_descend", "vectors": 1000, "seed": 3, "differ": 0}])
        self.assertRaises(targets.Unexpected, stages.values, job, "kd_descend\n")
        self.assertEqual(stages.table([{"stage": "kd_descend", "vectors": 1000, "seed": 3, "differ": None}]).splitlines()[2], "| kd_descend | 1000 | 3 | - |")

    def test_frames(self):
        frames = targets.TARGETS["frames"]
        job = next(job for job in frames.jobs(options()) if "-shadow-" in job["name"])
        value = frames.values(job, "room 48x36: 120 rays, 3 differ from csim\n  20.75 clocks/ray, 1.0 node steps/clock, 9 simulated clocks/s\n")[0]
        self.assertEqual((value["scene"], value["traced"], value["differ"], value["clocks"], value["rays"]), ("room", 120, 3, 20.75, "shadow"))
        self.assertEqual([targets.scene_name(scene) for scene in (targets.ENGINE, "knot:along=60,around=8.5", "one")], ["2CylinderEngine", "knot", "one"])
        self.assertRaises(targets.Unexpected, frames.values, job, "room 48x36: 120 rays, 3 differ from csim\n")
        csim = frames.jobs(options(engine="csim"))[0]
        self.assertEqual(frames.values(csim, "1,200 rays, golden against csim: 1,200\nprimary rays, golden against csim: 1,000\n0 violations\n")[0]["traced"], 2200)
        self.assertRaises(targets.Unexpected, frames.values, csim, "rays, golden against csim: 1,000\n10 violations\n")

    def test_figures_of_a_night(self):
        frames = [{"configuration": name, "clocks": clocks, "traced": rays} for name, clocks, rays in (("a", 10.0, 300), ("a", 20.0, 100), ("b", None, 5), ("c", 7.0, 0))]
        self.assertEqual(targets.TARGETS["frames"].trend(frames), {"clocks a ray, a": 12.5})
        self.assertEqual(targets.TARGETS["seeds"].trend([{"configuration": "a", "mhz": 60.5}, {"configuration": "a", "mhz": 61.0}]), {"MHz, best of a": 61.0})
        night = targets.TARGETS["night"]
        self.assertEqual([night.values(job, "")[0]["run"] for job in night.jobs(options(size="night"))], list(night.runs))

    def test_mutants(self):
        mutants = targets.TARGETS["mutants"]
        value = mutants.values({}, "caught    a tie goes near                                    1.2 s  Stages.KdDescend\nmutants: 1 of 1 caught\n")
        self.assertEqual(value, [{"mutant": "a tie goes near", "verdict": "caught", "tests": "Stages.KdDescend"}])
        self.assertRaises(targets.Unexpected, mutants.values, {}, "mutants: 0 of 0 caught\n")

    def test_seeds_marks_the_best(self):
        table = targets.TARGETS["seeds"].table([{"configuration": "a", "seed": s, "mhz": m, "luts": 1, "brams": 2} for s, m in ((1, 80.0), (2, 90.5), (3, 70.0))])
        self.assertEqual([line.endswith("| best |") for line in table.splitlines()[2:]], [False, True, False])

    def test_front(self):
        points = [(1, 9), (2, 9), (2, 5), (3, 5), (3, 4), (9, 4), (1, 9)]
        front = targets.pareto([{"block_rams": b, "clocks": c} for b, c in points], "block_rams")
        self.assertEqual([(r["block_rams"], r["clocks"]) for r in front], [(1, 9), (2, 5), (3, 4), (1, 9)])

    def test_explore_refuses_differences(self):
        self.assertRaises(targets.Unexpected, targets.TARGETS["explore"].values, {}, '{"differences": 2, "scenes": []}')
        self.assertRaises(targets.Unexpected, targets.TARGETS["explore"].values, {}, "no")

    def test_cores_join_clocks_and_cells(self):
        cores = targets.TARGETS["cores"]
        jobs = cores.jobs(options(size="default", build=pathlib.Path("a folder without a build")))
        self.assertNotIn("saarcor", " ".join(job["name"] for job in jobs))  # two levels
        printed = "room 48x36: 120 rays, 0 differ from csim\n  %.2f clocks/ray, 1.0 node steps/clock\n  bytes/ray read 370.4 written 16.6; hit rate node 0.9\n"
        records = []
        for job in jobs:
            name = job["command"][2]
            if job["name"].endswith("-cells-seed5"):
                if name in ("small", "ecp5", "wide"):
                    records += cores.values(job, json.dumps({"sites": {"small": 30000, "ecp5": 50000, "wide": 90000}[name], "cells": {"block_rams": 100}}))
                self.assertRaises(targets.Unexpected, cores.values, job, "no")
                self.assertRaises(targets.Unexpected, cores.values, job, '{"sites": 1}')
            else:
                records += cores.values(job, printed % {"small": 50, "ecp5": 20, "wide": 21}.get(name, 30))
                self.assertRaises(targets.Unexpected, cores.values, job, printed.replace(" 0 differ", " 10 differ") % 5)
        of_room = {record["configuration"]: record for record in cores.joined(records) if record["scene"] == "room"}
        self.assertEqual([of_room[name]["front"] for name in ("small", "ecp5", "wide", "ecp5l1")], ["front", "front", "", ""])
        self.assertIn("| room | ecp5 | 4 | 128 | 100 | 50000 | 20.00 | 370.4 | 16.6 | front |", cores.table(records))
        self.assertIn("| room | ecp5l1 | 1 | 32 | - | - | 30.00 | 370.4 | 16.6 |  |", cores.table(records))
        self.assertTrue(cores.drawn(records))
        self.assertFalse(cores.drawn([record for record in records if "clocks" in record]))

    def test_clocks_are_the_largest_bound(self):
        explore = targets.TARGETS["explore"]
        self.assertEqual(explore.clocks(30, 1, 64), {"clocks": 30, "limit": "steps"})
        self.assertEqual(explore.clocks(30, 10, 64), {"clocks": 80.0, "limit": "bus"})
        self.assertEqual(explore.clocks(30, 10, 4), {"clocks": 100.0, "limit": "latency"})


class Job(unittest.TestCase):
    def run_job(self, command, minutes=1):
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            job = {"name": "stages-csim-x-seed3", "command": command, "seed": 3, "minutes": minutes, "environment": {"SHOWN": "x 5 vectors, seed 3, 0 differ"}}
            (folder / "plan.json").write_text(json.dumps({"target": "stages", "root": str(ROOT), "identity": {"commit": "c"}, "jobs": [job]}), encoding="utf-8")
            step = subprocess.run([sys.executable, str(ROOT / "scripts/sweeps/job.py"), str(folder / "plan.json"), job["name"]], stderr=subprocess.PIPE, text=True, check=False)
            read = lambda path: json.loads(path.read_text(encoding="utf-8")) if path.exists() else None
            return step, read(folder / "rows" / (job["name"] + ".json")), read(folder / "failed" / (job["name"] + ".json"))

    def test_row(self):
        step, row, failed = self.run_job(["sh", "-c", 'echo "$SHOWN"'])
        self.assertEqual((step.returncode, failed), (0, None), step.stderr)
        self.assertEqual((row["values"][0]["vectors"], row["identity"], row["seed"]), (5, {"commit": "c"}, 3))

    def test_failures(self):
        for command, fault in ((["sh", "-c", "echo why >&2; exit 3"], "exit code 3"), (["true"], "no line about the stage"), (["./nosuch"], "No such file"),
                               (["sh", "-c", 'echo "$SHOWN"; kill -9 $$'], "exit code -9")):
            step, row, failed = self.run_job(command)
            self.assertEqual((step.returncode, row), (1, None))
            self.assertIn(fault, failed["fault"])
            self.assertEqual(failed["command"], command)
            self.assertIn("FAILED", step.stderr)
        self.assertIn("still ran after 0 minutes", self.run_job(["sleep", "60"], 0)[2]["fault"])


class Nights(unittest.TestCase):
    @staticmethod
    def failure(name, ended, fault="exit code 3"):
        return {"name": name, "fault": fault, "command": ["sh", "-c", "a <b>"], "tail": ["why & where"], "ended": ended}

    @staticmethod
    def night(began, runs, trend=None):
        """runs: name -> failures, of two jobs."""
        return {"began": began, "seconds": 60, "commit": "%040d" % began, "changes": "", "seed": began, "host": "h", "trend": trend or {},
                "runs": [{"name": name, "what": "of " + name, "passed": 2 - len(failed), "seconds": 90, "failed": failed} for name, failed in runs.items()]}

    def test_what_failed_first_and_since_when(self):
        early = self.failure("x-seed1", 1), self.failure("x-seed2", 2), self.failure("x-seed3", 30)
        nights = [self.night(1, {"a": [early[0]], "b": []}), self.night(2, {"a": []}), self.night(3, {"a": [early[1]], "b": [self.failure("y-seed3", 5)]}), self.night(4, {"b": []}),
                  self.night(5, {"a": [early[2]], "b": [self.failure("z-seed5", 20), self.failure("w-seed5", None, "did not run")]})]
        found = report.failures(nights)
        self.assertEqual([(run, failure["name"], since["began"]) for run, failure, since in found], [("b", "z-seed5", 5), ("a", "x-seed3", 3), ("b", "w-seed5", 5)])

    def test_page(self):
        nights = [self.night(1, {"a": []}, {"clocks a ray, small": 50.0}), self.night(2, {"a": [self.failure("x-seed2", 1)], "b": []}, {"clocks a ray, small": 51.5})]
        page = report.page(nights, b"<svg/>")
        for text in ("3 of 4 jobs passed", "1 of 2 FAILED", "a &lt;b&gt;", "why &amp; where", "Fails since the night of %s, commit %012d" % (report.day(nights[1]), 0), "51.50", "50.00", "data:image/svg+xml;base64,PHN2Zy8+"):
            self.assertIn(text, page)
        self.assertNotIn("<b>\n", page.split("<pre>")[1])
        self.assertNotIn("What failed", report.page(nights[:1]))

    def test_every_run_is_a_command_or_a_sweep(self):
        for name, run in targets.NIGHT["run"].items():
            self.assertEqual(set(run) - {"what", "threads", "minutes"}, {"sweep"} if "sweep" in run else {"command"}, name)
            self.assertIn(run.get("sweep", "stages"), targets.TARGETS)
            step = subprocess.run(["bash", "-n", "-c", run.get("command", "")], stderr=subprocess.PIPE, text=True, check=False)
            self.assertEqual(step.stderr, "", name)
            self.assertNotIn("build/release", run.get("command", ""), name)
        programs = targets.TARGETS["night"].programs(options())
        self.assertTrue({"testbench/sim/core/rtl_bench", "tests/shader/float_test"} <= set(programs), programs)
        self.assertEqual({run["sweep"] for run in targets.NIGHT["run"].values() if "sweep" in run}, set(targets.TARGETS) - {"night"})

    def test_what_the_documentation_names_is_there(self):
        files = subprocess.run(["git", "ls-files", "-z", "*.md", "*.sh", "*.py", "*.txt", "*.toml"], cwd=ROOT, stdout=subprocess.PIPE, text=True, check=True).stdout.split("\0")
        named = 0
        for name in filter(None, files):
            text = (ROOT / name).read_text(encoding="utf-8")
            self.assertNotIn("nightly" + ".sh", text, name)
            for run in re.findall(r"scripts/nightly ([a-z_]+)(?:`|$)", text, re.MULTILINE):
                self.assertIn(run, list(targets.NIGHT["run"]), name)
                named += 1
        self.assertGreater(named, 3)

    def test_arguments(self):
        for arguments in (["nosuch"], ["--jobs", "0"], ["--seed", "-1"], ["--size", "huge"]):
            step = subprocess.run([sys.executable, str(ROOT / "scripts/nightly"), "--list", *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, check=False)
            self.assertEqual((step.returncode, step.stdout), (2, ""), arguments)
            self.assertIn(arguments[0], step.stderr)


if __name__ == "__main__":
    unittest.main()
