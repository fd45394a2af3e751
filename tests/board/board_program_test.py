#!/usr/bin/env python3
"""retrace over a pseudo-terminal against the simulated board, and what it says when there is no board or it goes away.

usage: tests/board/board_program_test.py --retrace PROGRAM --board-sim PROGRAM [--work DIR] [NAME...]
"""
import argparse
import os
import pty
import signal
import struct
import subprocess
import sys
import time

CASES = []
SEED = os.environ.get("RETRACE_SEED", "20070701")


def case(function):
    CASES.append(function)
    return function


class Board:
    """A simulated board; `with` gives the path of its line."""

    def __init__(self, *options):
        self.command = [arguments.board_sim, "--seed", SEED, *options]

    def __enter__(self):
        self.process = subprocess.Popen(self.command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.path = self.process.stdout.readline().strip()
        check(self.path.startswith("/dev/"), "the board prints its path, not %r" % self.path)
        return self

    def __exit__(self, kind, *_):
        self.process.send_signal(signal.SIGTERM)
        _, self.report = self.process.communicate(timeout=30)
        if kind is None:
            check(self.process.returncode in (0, -signal.SIGKILL), "the board ends with %d: %s" % (self.process.returncode, self.report))


def check(condition, message):
    if not condition:
        raise AssertionError(message)


def retrace(*words, seconds=240):
    return subprocess.run([arguments.retrace, *words], capture_output=True, text=True, timeout=seconds, check=False)


def agrees(board, size):
    run = retrace("compare", "scenes/box.glb", "--engines", "csim,serial:" + board.path, "--size", size, "-q")
    check(run.returncode == 0 and "0 violations" in run.stdout, "%d\n%s%s" % (run.returncode, run.stdout, run.stderr))
    check(run.stdout.count("bit for bit") == 2, run.stdout)
    return run


def refuses(run, *parts, code=1):
    lines = [line for line in run.stderr.splitlines() if line.startswith("retrace: error:")]
    check(run.returncode == code, "exit code %d instead of %d: %s" % (run.returncode, code, run.stderr))
    check(len(lines) == 1, "%d error lines: %s" % (len(lines), run.stderr))
    for part in parts:
        check(part in lines[0], "%r is not in %r" % (part, lines[0]))


@case
def compare_equals_csim():
    with Board() as board:
        agrees(board, "16x12")
        # A second program begins a session of its own.
        picture = os.path.join(arguments.work, "board.png")
        run = retrace("render", "scenes/one.glb", "--engine", "serial:" + board.path, "-s", "8x6", "--no-shadows", "-o", picture, "-q")
        check(run.returncode == 0 and os.path.getsize(picture) > 0, run.stderr)
        check("clocks a ray at 80 MHz" in run.stdout, run.stdout)


def write_rays(path, rays):
    """A NumPy file of float64, shape (N, 8)."""
    header = "{'descr': '<f8', 'fortran_order': False, 'shape': (%d, 8), }" % len(rays)
    header += " " * (-(len(header) + 11) % 64) + "\n"
    with open(path, "wb") as file:
        file.write(b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header.encode() + b"".join(struct.pack("<8d", *ray) for ray in rays))


@case
def trace_writes_the_same_file():
    rays = os.path.join(arguments.work, "rays.npy")
    write_rays(rays, [(x / 10, y / 10, -3, 0, x / 50, 0.1, 1, 1e9) for x in range(-10, 11, 5) for y in range(0, 21, 5)])
    with Board() as board:
        for name, engine in (("csim", "csim"), ("serial", "serial:" + board.path)):
            run = retrace("trace", "scenes/box.glb", "-i", rays, "-o", os.path.join(arguments.work, name + ".npy"), "--engine", engine, "-q")
            check(run.returncode == 0, run.stderr)
    with open(os.path.join(arguments.work, "csim.npy"), "rb") as first, open(os.path.join(arguments.work, "serial.npy"), "rb") as second:
        check(first.read() == second.read(), "the files differ")


@case
def compare_equals_csim_on_a_bad_line():
    with Board("--damage", "1") as board:
        agrees(board, "12x9")
    damaged = int(board.report.split(" damaged")[0].split()[-1])
    check(damaged > 100, "only %d bytes were damaged" % damaged)


@case
def an_image_that_is_too_large():
    with Board() as board:
        run = retrace("render", "scenes/coincident.glb", "--engine", "serial:" + board.path, "-o", os.path.join(arguments.work, "none.png"), "-q")
        refuses(run, "34880 bytes", "32768 bytes")
        check(not os.path.exists(os.path.join(arguments.work, "none.png")), "a picture was written")


@case
def paths_that_are_no_board():
    output = ["-o", os.path.join(arguments.work, "none.png"), "-q"]
    refuses(retrace("render", "box", "--engine", "serial:/dev/no-such-line", *output), "/dev/no-such-line", "No such file")
    refuses(retrace("render", "box", "--engine", "serial:README.md", *output), "README.md is no device")
    refuses(retrace("render", "box", "--engine", "serial:/dev/null", *output), "/dev/null")
    refuses(retrace("render", "box", "--engine", "serial", *output), "serial:/dev/ttyUSB0", code=2)
    with Board() as board:
        refuses(retrace("render", "box", "--engine", "serial:" + board.path, "--baud", "12345", *output), "12345 baud")


@case
def a_line_where_nothing_answers():
    master, slave = pty.openpty()
    begin = time.monotonic()
    run = retrace("render", "box", "--engine", "serial:" + os.ttyname(slave), "--link-patience", "1", "-o", os.path.join(arguments.work, "none.png"), "-q")
    refuses(run, "nothing answers")
    check(time.monotonic() - begin < 30, "took %.0f s" % (time.monotonic() - begin))
    os.close(master)
    os.close(slave)


@case
def a_board_that_goes_away():
    with Board() as board:
        program = subprocess.Popen([arguments.retrace, "render", "scenes/box.glb", "--engine", "serial:" + board.path, "-s", "64x48", "-o",
                                    os.path.join(arguments.work, "none.png"), "-q"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        time.sleep(2)
        board.process.kill()
        out, error = program.communicate(timeout=60)
    refuses(subprocess.CompletedProcess([], program.returncode, out, error), "is gone")


parser = argparse.ArgumentParser()
parser.add_argument("--retrace", required=True)
parser.add_argument("--board-sim", required=True)
parser.add_argument("--work", default=".")
parser.add_argument("names", nargs="*")
arguments = parser.parse_args()
os.makedirs(arguments.work, exist_ok=True)
failed = 0
for function in CASES:
    if arguments.names and function.__name__ not in arguments.names:
        continue
    started = time.monotonic()
    try:
        function()
        print("ok      %s (%.1f s)" % (function.__name__, time.monotonic() - started))
    except (AssertionError, subprocess.TimeoutExpired) as error:
        failed += 1
        print("FAILED  %s (RETRACE_SEED=%s): %s" % (function.__name__, SEED, error))
sys.exit(1 if failed else 0)
