"""Whole sweeps with Snakemake in a small clone made for the purpose, whose program is a script: resumed after a kill without repeating what is done and with the
same table, failing jobs named while the others run, rows of another commit or program never taken; nights and their page. Exit code 77 without Snakemake.
"""
import json
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
ENVIRONMENT = pathlib.Path(os.environ.get("RETRACE_SWEEPS", ROOT / ".env/sweeps"))
PROGRAM = """#!/bin/sh
echo "$3 $2" >>runs.txt
%s
echo "$3 $1 vectors, seed $2, 0 differ"
"""


NIGHT = """[run.one]
what = "one"
command = "echo one $RETRACE_SEED >>runs.txt"
[run.two]
what = "two"
command = "echo two $RETRACE_SEED >>runs.txt; test -e build/good || { echo broken >&2; exit 3; }"
[run.stages]
what = "vectors"
sweep = "stages"
"""


class Clone:
    def __init__(self, folder):
        self.folder = folder
        for part in ("scripts/sweep", "scripts/nightly", "scripts/requirements.txt", "rtl/targets/core.toml", *(str(p.relative_to(ROOT)) for p in (ROOT / "scripts/sweeps").iterdir() if p.is_file())):
            (folder / part).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(ROOT / part, folder / part)
        (folder / ".gitignore").write_text("build/\nout/\nruns.txt\n__pycache__/\n")
        self.git("init", "-q")
        self.commit()

    def git(self, *arguments):
        subprocess.run(["git", "-c", "user.name=t", "-c", "user.email=t", *arguments], cwd=self.folder, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)

    def commit(self):
        self.git("add", "-A")
        self.git("commit", "-q", "--allow-empty", "-m", "x")

    def program(self, body="", path="testbench/csim/tb_stages"):
        path = self.folder / "build/release" / path
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(PROGRAM % body)
        path.chmod(0o755)

    def start(self, *more):
        return subprocess.Popen([sys.executable, "scripts/sweep", "stages", "--engine", "csim", "--size", "quick", "--seed", "1", "--seeds", "1", "--jobs", "2", *more], cwd=self.folder, start_new_session=True,
                                env={**os.environ, "RETRACE_SWEEPS": str(ENVIRONMENT)}, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)

    def run(self, *more):
        process = self.start(*more)
        out, errors = process.communicate(timeout=300)
        return process.returncode, out, errors

    def night(self, *arguments):
        step = subprocess.run([sys.executable, "scripts/nightly", "--build", "build/release", "--size", "quick", "--jobs", "2", *arguments], cwd=self.folder, stdout=subprocess.PIPE,
                              stderr=subprocess.PIPE, env={**os.environ, "RETRACE_SWEEPS": str(ENVIRONMENT)}, text=True, timeout=600, check=False)
        return step.returncode, step.stdout, step.stderr

    def runs(self):
        path = self.folder / "runs.txt"
        lines = path.read_text().splitlines() if path.exists() else []
        path.unlink(missing_ok=True)
        return lines

    def rows(self):
        return list(self.folder.glob("out/sweeps/*/*/rows/*.json"))

    def tables(self):
        return sorted(self.folder.glob("out/sweeps/*/*/table.md"))


def expect(condition, *what):
    if not condition:
        sys.exit("sweep_test: " + " ".join(map(str, what)))


def nights(clone):
    """A run fails in two nights, the others pass; what passed is not repeated; the page says since when."""
    (clone.folder / "scripts/sweeps/night.toml").write_text(NIGHT)
    clone.commit()
    # As rtl_stages: --stage NAME --vectors N --seed N.
    clone.program('set -- "$4" "$6" "$2"', "testbench/stages/rtl_stages")
    page = clone.folder / "out/nightly/report.html"
    code, out, errors = clone.night("--seed", "5")
    expect(code == 1 and "2 of 3 runs passed" in out and "night-two-seed5 FAILED, exit code 3" in errors and "    broken" in errors, "a night:", code, out, errors)
    expect(sorted(clone.runs())[-2:] == ["one 5", "two 5"], "runs of a night")
    text = page.read_text()
    expect("22 of 23 jobs passed" in text and "broken" in text and "image/svg" in text, "the page:", text)
    first = text.split("Fails since the night of ")[1].split(".")[0]
    code, out, errors = clone.night("--seed", "5")
    expect(code == 1 and clone.runs() == ["two 5"], "what had passed ran again, or the failed run did not")
    expect(clone.night("--seed", "6")[0] == 1 and "Fails since the night of " + first in page.read_text(), "since when it fails:", first, page.read_text())
    (clone.folder / "build/good").touch()
    clone.runs()
    code, out, errors = clone.night("--seed", "6", "two")
    expect(code == 0 and clone.runs() == ["two 6"] and "23 of 23 jobs passed" in page.read_text(), "mended:", code, out, errors)


def main():
    if not (ENVIRONMENT / "bin/snakemake").exists():
        print("sweep_test: no Snakemake in %s (scripts/setup.sh --sweeps): skipped" % ENVIRONMENT)
        return 77
    with tempfile.TemporaryDirectory() as name:
        clone = Clone(pathlib.Path(name))
        code, _, errors = clone.run()
        expect(code == 1 and "build it first" in errors, "without a program:", code, errors)

        # Killed in the middle, all of it, as by the end of a machine; then once more.
        clone.program("sleep 0.5")
        process = clone.start()
        while len(clone.rows()) < 2:
            expect(process.poll() is None, "ended too early:", process.stderr.read() if process.poll() is not None else "")
            time.sleep(0.02)
        os.killpg(process.pid, signal.SIGKILL)
        process.communicate()
        time.sleep(1)  # commands that ran have a session of their own
        before, done = clone.runs(), len(clone.rows())
        code, out, errors = clone.run()
        after = clone.runs()
        expect(code == 0 and "7 of 7 jobs" in out, "resumed:", code, out, errors)
        expect(2 <= done < 7 and len(after) == 7 - done, "%d rows before, %d runs before and %d after the kill" % (done, len(before), len(after)))
        resumed = clone.tables()[0].read_bytes()
        code, out, _ = clone.run()
        expect(code == 0 and not clone.runs(), "finished jobs ran again")

        # From nothing: the same table.
        shutil.rmtree(clone.folder / "out")
        expect(clone.run()[0] == 0 and clone.tables()[0].read_bytes() == resumed, "the table of a sweep that was killed differs from the whole one's")
        clone.runs()

        # A row that says another commit is an error, not a line of the table.
        row = clone.rows()[0]
        held = row.read_text()
        other = json.loads(held)
        other["identity"]["commit"] = "0" * 40
        row.write_text(json.dumps(other))
        code, _, errors = clone.run()
        expect(code == 1 and "another commit" in errors and str(row) in errors, "a foreign row:", code, errors)
        row.write_text(held)

        # Another commit, another program, a file that is not committed: nothing is taken over.
        clone.commit()
        expect(clone.run()[0] == 0 and len(clone.runs()) == 7 and len(clone.tables()) == 2, "rows of the last commit were taken")
        (clone.folder / "new.txt").write_text("x")
        expect(clone.run()[0] == 0 and len(clone.runs()) == 7 and len(clone.tables()) == 3, "rows from before a change were taken")
        (clone.folder / "new.txt").unlink()

        # Two jobs fail: both are named with their commands, the others run, and only they run the next time.
        clone.program('[ "$3" != tri_test ] && [ "$3" != hit_finish ] || { echo broken >&2; exit 4; }')
        code, out, errors = clone.run()
        expect(code == 1 and "5 of 7 jobs done" in out, "failing jobs:", code, out, errors)
        for seed, stage in ((1, "tri_test"), (1, "hit_finish")):
            expect("stages-csim-%s-seed%d FAILED, exit code 4: %s" % (stage, seed, "build/release/testbench/csim/tb_stages 20000 %d %s" % (seed, stage)) in errors, "not named:", errors)
        expect("    broken" in errors, "the log is not shown:", errors)
        clone.runs()
        clone.run()
        expect(sorted(clone.runs()) == ["hit_finish 1", "tri_test 1"], "other jobs ran again")
        nights(clone)
    print("sweep_test: killed after %d of 7 jobs and resumed, failing jobs, other commits and programs, nights" % done)
    return 0


if __name__ == "__main__":
    sys.exit(main())
