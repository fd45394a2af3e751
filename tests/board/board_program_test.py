#!/usr/bin/env python3
"""retrace over a pseudo-terminal against the simulated board, and what it says when there is no board or it goes away.

usage: tests/board/board_program_test.py --retrace PROGRAM --board-sim PROGRAM [--work DIR] [NAME...]
"""
import os
import pty
import struct
import subprocess
import time

from board_cases import Board, agrees, arguments, case, check, main, refuses, retrace


def board_on_a_line(*options):
    return Board("/dev/", *options, seconds=30, killed=True)


@case
def compare_equals_csim():
    with board_on_a_line() as board:
        agrees("serial:" + board.place, "16x12")
        # A second program begins a session of its own.
        picture = os.path.join(arguments.work, "board.png")
        run = retrace("render", "scenes/one.glb", "--engine", "serial:" + board.place, "-s", "8x6", "--no-shadows", "-o", picture, "-q")
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
    with board_on_a_line() as board:
        for name, engine in (("csim", "csim"), ("serial", "serial:" + board.place)):
            run = retrace("trace", "scenes/box.glb", "-i", rays, "-o", os.path.join(arguments.work, name + ".npy"), "--engine", engine, "-q")
            check(run.returncode == 0, run.stderr)
    with open(os.path.join(arguments.work, "csim.npy"), "rb") as first, open(os.path.join(arguments.work, "serial.npy"), "rb") as second:
        check(first.read() == second.read(), "the files differ")


@case
def compare_equals_csim_on_a_bad_line():
    with board_on_a_line("--damage", "1") as board:
        agrees("serial:" + board.place, "12x9")
    damaged = int(board.report.split(" damaged")[0].split()[-1])
    check(damaged > 100, "only %d bytes were damaged" % damaged)


@case
def an_image_that_is_too_large():
    with board_on_a_line() as board:
        run = retrace("render", "scenes/coincident.glb", "--engine", "serial:" + board.place, "-o", os.path.join(arguments.work, "none.png"), "-q")
        refuses(run, "34880 bytes", "32768 bytes")
        check(not os.path.exists(os.path.join(arguments.work, "none.png")), "a picture was written")


@case
def paths_that_are_no_board():
    output = ["-o", os.path.join(arguments.work, "none.png"), "-q"]
    refuses(retrace("render", "box", "--engine", "serial:/dev/no-such-line", *output), "/dev/no-such-line", "No such file")
    refuses(retrace("render", "box", "--engine", "serial:README.md", *output), "README.md is no device")
    refuses(retrace("render", "box", "--engine", "serial:/dev/null", *output), "/dev/null")
    refuses(retrace("render", "box", "--engine", "serial", *output), "serial:/dev/ttyUSB0", code=2)
    with board_on_a_line() as board:
        refuses(retrace("render", "box", "--engine", "serial:" + board.place, "--baud", "12345", *output), "12345 baud")


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
    with board_on_a_line() as board:
        program = subprocess.Popen([arguments.retrace, "render", "scenes/box.glb", "--engine", "serial:" + board.place, "-s", "64x48", "-o",
                                    os.path.join(arguments.work, "none.png"), "-q"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        time.sleep(2)
        board.process.kill()
        out, error = program.communicate(timeout=60)
    refuses(subprocess.CompletedProcess([], program.returncode, out, error), "is gone")


if __name__ == "__main__":
    main("--board-sim", ".")
