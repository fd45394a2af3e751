"""What the tests of the program with a simulated board have in common: cases, the board's process, the program, and what a refusal looks like.

main() fills `arguments`.
"""
import argparse
import os
import signal
import subprocess
import sys
import time

CASES = []
SEED = os.environ.get("RETRACE_SEED", "20070701")
arguments = argparse.Namespace()


def case(function):
    CASES.append(function)
    return function


def check(condition, message):
    if not condition:
        raise AssertionError(message)


def retrace(*words):
    return subprocess.run([arguments.retrace, *words], capture_output=True, text=True, timeout=240, check=False)


class Board:
    """A simulated board; `with` gives the place that it prints. `seconds`: to end in; `killed`: it may end that way, too."""

    def __init__(self, begins, *options, seconds, killed=False):
        self.begins, self.seconds, self.killed = begins, seconds, killed
        self.command = [arguments.board, "--seed", SEED, *options]

    def __enter__(self):
        self.process = subprocess.Popen(self.command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.place = self.process.stdout.readline().strip()
        check(self.place.startswith(self.begins), "the board prints where it is, not %r" % self.place)
        return self

    def __exit__(self, kind, *_):
        self.process.send_signal(signal.SIGTERM)
        _, self.report = self.process.communicate(timeout=self.seconds)
        if kind is None:
            ends = (0, -signal.SIGKILL) if self.killed else (0,)
            check(self.process.returncode in ends, "the board ends with %d: %s" % (self.process.returncode, self.report))


def agrees(engine, size):
    run = retrace("compare", "scenes/box.glb", "--engines", "csim," + engine, "--size", size, "-q")
    check(run.returncode == 0 and "0 violations" in run.stdout, "%d\n%s%s" % (run.returncode, run.stdout, run.stderr))
    check(run.stdout.count("bit for bit") == 2, run.stdout)


def refuses(run, *parts, code=1):
    lines = [line for line in run.stderr.splitlines() if line.startswith("retrace: error:")]
    check(run.returncode == code, "exit code %d instead of %d: %s" % (run.returncode, code, run.stderr))
    check(len(lines) == 1, "%d error lines: %s" % (len(lines), run.stderr))
    for part in parts:
        check(part in lines[0], "%r is not in %r" % (part, lines[0]))


def main(board_option, work):
    parser = argparse.ArgumentParser()
    parser.add_argument("--retrace", required=True)
    parser.add_argument(board_option, required=True, dest="board")
    parser.add_argument("--work", default=work)
    parser.add_argument("names", nargs="*")
    parser.parse_args(namespace=arguments)
    os.makedirs(arguments.work, exist_ok=True)
    failed = 0
    for function in CASES:
        if arguments.names and function.__name__ not in arguments.names:
            continue
        started = time.monotonic()
        try:
            function()
            print("ok      %s (%.1f s)" % (function.__name__, time.monotonic() - started), flush=True)
        except (AssertionError, subprocess.TimeoutExpired) as error:
            failed += 1
            print("FAILED  %s (RETRACE_SEED=%s): %s" % (function.__name__, SEED, error), flush=True)
    sys.exit(1 if failed else 0)
