#!/usr/bin/env python3
"""retrace over UDP against a simulated board with a DRAM, over a network that loses, doubles, reorders and damages datagrams; a host that is killed in
the middle of a frame and started again; and what the program says when there is no board.

usage: tests/board/udp_program_test.py --retrace PROGRAM --udp-board PROGRAM [--work DIR] [NAME...]
"""
import os
import socket
import subprocess
import time

from board_cases import Board, agrees, arguments, case, check, main, refuses, retrace


def board_in_the_network(*options):
    return Board("udp://", *options, seconds=60)


@case
def every_hit_over_a_bad_network():
    """5 % of the datagrams each way lost, 5 % doubled, 5 % reordered, 1 % damaged."""
    with board_in_the_network("--noise", "5", "--damage", "1", "--memory", "sdr") as board:
        agrees("board:" + board.place, "24x18")
    check(" 0 lost" not in board.report, board.report)


@case
def a_host_that_is_killed_and_one_that_follows():
    picture = os.path.join(arguments.work, "victim.png")
    if os.path.exists(picture):
        os.remove(picture)
    with board_in_the_network("--noise", "5", "--damage", "1") as board:
        victim = subprocess.Popen([arguments.retrace, "render", "scenes/box.glb", "--engine", "board:" + board.place, "--size", "64x48", "-q",
                                   "-o", picture], stderr=subprocess.DEVNULL)
        time.sleep(0.6)
        check(victim.poll() is None, "the host was to be killed in the middle of its frame")
        victim.kill()
        victim.wait()
        check(not os.path.exists(picture), "a killed host has written a picture")
        agrees("board:" + board.place, "16x12")


@case
def an_image_larger_than_the_memory():
    with board_in_the_network("--memory", "model", "--megabytes", "1") as board:
        run = retrace("render", "room:detail=0.3", "--engine", "board:" + board.place, "--size", "8x6", "-q", "-o",
                      os.path.join(arguments.work, "large.png"))
        refuses(run, "do not fit the board's memory of 1048576 bytes")


@case
def memory_that_does_not_answer():
    with board_in_the_network("--memory", "model", "--megabytes", "1", "--memory-state", "2") as board:
        refuses(retrace("render", "box", "--engine", "board:" + board.place, "-o", "/dev/null"), "memory does not answer")


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
    main("--udp-board", "out/udp_program_test")
