#!/usr/bin/env python3
"""retrace over UDP against a simulated board with a DRAM, over a network that loses, doubles, reorders and damages datagrams; a host that is killed in
the middle of a frame and started again; and what the program says when there is no board.

usage: tests/board/udp_program_test.py --retrace PROGRAM --udp-board PROGRAM [--work DIR] [NAME...]
"""
import argparse
import os
import signal
import socket
import subprocess
import sys
import time

CASES = []
SEED = os.environ.get("RETRACE_SEED", "20070701")


def case(function):
    CASES.append(function)
    return function


class Board:
    """A simulated board; `with` gives its address."""

    def __init__(self, *options):
        self.command = [arguments.udp_board, "--seed", SEED, *options]

    def __enter__(self):
        self.process = subprocess.Popen(self.command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.address = self.process.stdout.readline().strip()
        check(self.address.startswith("udp://"), "the board prints its address, not %r" % self.address)
        return self

    def __exit__(self, kind, *_):
        self.process.send_signal(signal.SIGTERM)
        _, self.report = self.process.communicate(timeout=60)
        if kind is None:
            check(self.process.returncode == 0, "the board ends with %d: %s" % (self.process.returncode, self.report))


def check(condition, message):
    if not condition:
        raise AssertionError(message)


def retrace(*words, seconds=240):
    return subprocess.run([arguments.retrace, *words], capture_output=True, text=True, timeout=seconds, check=False)


def agrees(board, size):
    run = retrace("compare", "scenes/box.glb", "--engines", "csim,board:" + board.address, "--size", size, "-q")
    check(run.returncode == 0 and "0 violations" in run.stdout, "%d\n%s%s" % (run.returncode, run.stdout, run.stderr))
    check(run.stdout.count("bit for bit") == 2, run.stdout)


def refuses(run, *parts, code=1):
    lines = [line for line in run.stderr.splitlines() if line.startswith("retrace: error:")]
    check(run.returncode == code and len(lines) == 1, "one error and exit %d, not %d:\n%s" % (code, run.returncode, run.stderr))
    for part in parts:
        check(part in lines[0], "%r in %r" % (part, lines[0]))


@case
def every_hit_over_a_bad_network():
    """5 % of the datagrams each way lost, 5 % doubled, 5 % reordered, 1 % damaged."""
    with Board("--noise", "5", "--damage", "1", "--memory", "sdr") as board:
        agrees(board, "24x18")
    check(" 0 lost" not in board.report, board.report)


@case
def a_host_that_is_killed_and_one_that_follows():
    with Board("--noise", "5", "--damage", "1") as board:
        victim = subprocess.Popen([arguments.retrace, "render", "scenes/box.glb", "--engine", "board:" + board.address, "--size", "64x48", "-q",
                                   "-o", os.path.join(arguments.work, "victim.png")], stderr=subprocess.DEVNULL)
        time.sleep(0.6)
        check(victim.poll() is None, "the host was to be killed in the middle of its frame")
        victim.kill()
        victim.wait()
        check(not os.path.exists(os.path.join(arguments.work, "victim.png")), "a killed host has written a picture")
        agrees(board, "16x12")


@case
def an_image_larger_than_the_memory():
    with Board("--memory", "model", "--megabytes", "1") as board:
        run = retrace("render", "room:detail=0.3", "--engine", "board:" + board.address, "--size", "8x6", "-q", "-o",
                      os.path.join(arguments.work, "large.png"))
        refuses(run, "do not fit the board's memory of 1048576 bytes")


@case
def memory_that_does_not_answer():
    with Board("--memory", "model", "--megabytes", "1", "--memory-state", "2") as board:
        refuses(retrace("render", "box", "--engine", "board:" + board.address, "-o", "/dev/null"), "memory does not answer")


@case
def nobody_listens():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", 0))
        port = taken.getsockname()[1]
        # It is there, and says nothing.
        refuses(retrace("render", "box", "--engine", "board:udp://127.0.0.1:%d" % port, "--link-patience", "0.3", "-o", "/dev/null"),
                "udp link: 127.0.0.1:%d" % port, "nothing answers")
    refuses(retrace("render", "box", "--engine", "board:udp://127.0.0.1:%d" % port, "-o", "/dev/null"), "nobody listens there")


@case
def wrong_ways_to_a_board():
    for way in ("", "udp://", "udp://host", "udp://host:0", "udp://host:99999", "tcp://host:1"):
        refuses(retrace("render", "box", "--engine", "board:" + way, "-o", "/dev/null"), "HOST:PORT" if way else "takes", code=2)
    refuses(retrace("render", "box", "--engine", "board:serial:/dev/null", "-o", "/dev/null"), "/dev/null")


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--retrace", required=True)
    parser.add_argument("--udp-board", required=True)
    parser.add_argument("--work", default="out/udp_program_test")
    parser.add_argument("names", nargs="*")
    arguments = parser.parse_args()
    os.makedirs(arguments.work, exist_ok=True)
    bad = 0
    for each in CASES:
        if arguments.names and each.__name__ not in arguments.names:
            continue
        for left in os.listdir(arguments.work):
            os.remove(os.path.join(arguments.work, left))
        begin = time.monotonic()
        try:
            each()
            print("ok    %-45s %5.1f s" % (each.__name__, time.monotonic() - begin), flush=True)
        except (AssertionError, subprocess.TimeoutExpired) as error:
            bad += 1
            print("FAILED %s (RETRACE_SEED=%s): %s" % (each.__name__, SEED, error), flush=True)
    sys.exit(1 if bad else 0)
