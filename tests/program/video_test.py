#!/usr/bin/env python3
"""Videos and the program that makes them. Usage: video_test.py RETRACE

With an ffmpeg of the test's own: it gets every frame of this run and none of an earlier one, it ends when the program is ended, whatever
ends it, and nothing is left over; what it says is the error. With the real one, where it is installed: a rerun with fewer frames."""
import json
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import tempfile
import time

SIZE = (48, 32)
COUNTS = """#!/bin/sh
for last; do :; done
bytes=$(wc -c)
echo "$bytes" > "${last#file:}"
"""
SLEEPS = """#!/bin/sh
echo $$ > "$PIDS/own"
sleep 60 & echo $! > "$PIDS/child"
wait
"""
REFUSES = """#!/bin/sh
echo "no such codec" >&2
echo "more words" >&2
exit 3
"""


def check(condition, message):
    if not condition:
        sys.exit(f"video_test: {message}")


def runs(pid):
    try:
        return pathlib.Path(f"/proc/{pid}/stat").read_text().split(")")[-1].split()[0] != "Z"
    except FileNotFoundError:
        return False


def until(condition, message):
    end = time.monotonic() + 120
    while not condition():
        check(time.monotonic() < end, message)
        time.sleep(0.01)


def main():
    retrace = pathlib.Path(sys.argv[1]).resolve()
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        tools = folder / "tools"
        work = folder / "work"
        tools.mkdir()
        work.mkdir()
        environment = dict(os.environ, PATH=f"{tools}:{os.environ['PATH']}", PIDS=str(folder))

        def ffmpeg(script):
            (tools / "ffmpeg").write_text(script)
            (tools / "ffmpeg").chmod(0o755)

        def run(*arguments, code=0, env=environment):
            result = subprocess.run([retrace, *arguments], cwd=work, capture_output=True, text=True, env=env, check=False)
            check(result.returncode == code, f"{' '.join(arguments)}: exit code {result.returncode}, not {code}: {result.stderr}")
            return result

        def render(*arguments, **more):
            return run("render", "creatures.glb", "-o", "v.png", "--animation", "--size", f"{SIZE[0]}x{SIZE[1]}", "--spp", "1", "--fps", "4",
                       "--full-rebuild", "never", *arguments, **more)

        run("make-scene", "creatures", "--set", "detail=2", "-o", "creatures.glb")

        # Every frame of this run and no other: by the number of bytes.
        ffmpeg(COUNTS)
        render("--frames", "5")
        check(int((work / "v.mp4").read_text()) == 5 * 3 * SIZE[0] * SIZE[1], f"video of {(work / 'v.mp4').read_text()} bytes")
        old = (work / "v-0004.png").read_bytes()
        shorter = render("--frames", "2", "--stats", "v.json")
        check(int((work / "v.mp4").read_text()) == 2 * 3 * SIZE[0] * SIZE[1], "frames of an earlier run are in the video")
        check((work / "v-0004.png").read_bytes() == old, "a frame of an earlier run was touched")
        check("v-0002.png and what follows are older" in shorter.stderr, f"no word about older frames: {shorter.stderr}")
        check(json.loads((work / "v.json").read_text())["video"] == "v.mp4", "the video is not in the statistics")
        names = sorted(os.listdir(work))

        # Files that are meant twice, and containers that are not known.
        for wrong in (["--video", "creatures.glb"], ["--video", "v-0001.png"], ["--stats", "v-0001.png"], ["--video", "a.mp4", "--stats", "./a.mp4"],
                      ["--video", "a.xyz"], ["--video", "a"]):
            before = {n: (work / n).read_bytes() for n in names}
            result = render("--frames", "2", "--quiet", *wrong, code=2)
            check(result.stderr.count("\n") == 1, result.stderr)
            check(before == {n: (work / n).read_bytes() for n in sorted(os.listdir(work))}, f"{wrong}: files have changed")

        # Told how to walk, golden takes the image of two levels that the others take.
        for walk in (["--way-up", "stack"], ["--way-up", "parent"], ["--mailbox"]):
            render("--frames", "2", "--quiet", *walk)
        check(sorted(os.listdir(work)) == names, f"left over: {os.listdir(work)}")

        # What it says is the error; the video of before stays.
        ffmpeg(REFUSES)
        result = render("--frames", "2", "--quiet", code=1)
        check(result.stderr.endswith("failed: no such codec\n") and result.stderr.count("\n") == 1, result.stderr)
        check(int((work / "v.mp4").read_text()) == 2 * 3 * SIZE[0] * SIZE[1], "the old video is gone")
        check(sorted(os.listdir(work)) == names, f"left over: {os.listdir(work)}")

        # The program ends, by whatever signal: so does the child with its own children (SIGKILL: the child alone).
        ffmpeg(SLEEPS)
        for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP, signal.SIGKILL):
            for name in ("own", "child"):
                (folder / name).unlink(missing_ok=True)
            program = subprocess.Popen([retrace, "render", "creatures.glb", "-o", "v.png", "--animation", "--size", "48x32", "--spp", "1", "--frames", "2"],
                                       cwd=work, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            until(lambda: (folder / "child").exists() and (folder / "child").read_text().endswith("\n"), "ffmpeg was not started")
            own, child = (int((folder / n).read_text()) for n in ("own", "child"))
            program.send_signal(number)
            code = program.wait()
            check(code == (-9 if number == signal.SIGKILL else 128 + number), f"signal {number}: exit code {code}")
            until(lambda: not runs(own), f"ffmpeg outlives signal {number}")
            if number == signal.SIGKILL:
                os.kill(child, signal.SIGKILL)
            until(lambda: not runs(child), f"a child of ffmpeg outlives signal {number}")
            check(sorted(os.listdir(work)) == names, f"left over after signal {number}: {os.listdir(work)}")

        (tools / "ffmpeg").unlink()
        if shutil.which("ffmpeg") and shutil.which("ffprobe"):
            for frames, name in ((5, "v.mp4"), (2, "v.mp4"), (3, "v.mkv"), (3, "v.webm"), (3, "v.gif")):
                render("--frames", str(frames), "--video", name, env=dict(os.environ))
                probe = subprocess.run(["ffprobe", "-v", "error", "-count_frames", "-show_entries", "stream=width,height,nb_read_frames", "-of", "json",
                                        work / name], check=True, stdout=subprocess.PIPE)
                stream = json.loads(probe.stdout)["streams"][0]
                check((stream["width"], stream["height"], stream["nb_read_frames"]) == (*SIZE, str(frames)), f"{name}: {stream}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
