#!/usr/bin/env python3
"""retrace render --animation end to end. Usage: render_animation_test.py RETRACE

Numbered frames and their times, the video (where ffmpeg is installed), the same pictures byte for byte from the two-level structure and
from one tree rebuilt every frame; a million instanced triangles followed by the top level alone, at least FASTER times cheaper than a full
rebuild; one clear line and exit code 1 for every kind of bad animation, 2 for wrong usage. Prints the figures."""
import json
import os
import pathlib
import shutil
import struct
import subprocess
import sys
import tempfile

FASTER = 50  # a full rebuild's cost over that of following a frame


def check(condition, message):
    if not condition:
        sys.exit(f"render_animation_test: {message}")


class Glb:
    """A binary glTF file taken apart."""

    def __init__(self, data):
        length = struct.unpack_from("<I", data, 12)[0]
        self.root = json.loads(data[20:20 + length])
        self.bin = bytearray(data[28 + length:])

    def pack(self):
        text = json.dumps(self.root).encode()
        text += b" " * (-len(text) % 4)
        body = struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(self.bin), 0x004E4942) + bytes(self.bin)
        return struct.pack("<III", 0x46546C67, 2, 12 + len(body)) + body

    def accessor(self, path, which):
        animation = self.root["animations"][0]
        sampler = next(c["sampler"] for c in animation["channels"] if c["target"]["path"] == path)
        return self.root["accessors"][animation["samplers"][sampler][which]]

    def put(self, path, which, floats):
        offset = self.root["bufferViews"][self.accessor(path, which)["bufferView"]]["byteOffset"]
        self.bin[offset:offset + 4 * len(floats)] = struct.pack(f"<{len(floats)}f", *floats)

    def node(self, name):
        return next(n for n in self.root["nodes"] if n.get("name") == name)


def no_keys(glb):
    glb.accessor("rotation", "input")["count"] = 0


def missing_keys(glb):
    glb.accessor("rotation", "output")["count"] = 5


def missing_input(glb):
    del glb.root["animations"][0]["samplers"][0]["input"]


def unsorted_keys(glb):
    glb.put("rotation", "input", [0, 1, 0.5])


def few_joints(glb):
    del glb.root["skins"][0]["joints"][3]


def few_matrices(glb):
    glb.root["accessors"][glb.root["skins"][0]["inverseBindMatrices"]]["count"] = 2


def singular_instance(glb):
    glb.node("ball 2")["scale"] = [1, 0, 1]


def still(glb):
    del glb.root["animations"]


BAD = [(no_keys, "has no keys"), (missing_keys, "has 5 values, but 9 keys need 9"), (missing_input, "'input' is missing"),
       (unsorted_keys, "keys are not in ascending order: key 2 at 0.5 s follows one at 1 s"), (few_joints, "has only 3 joints"),
       (few_matrices, "has 4 joints, but only 2 inverse bind matrices"),
       (singular_instance, "'ball 2': the instance's matrix is singular"), (still, "holds no animation")]


def main():
    retrace = pathlib.Path(sys.argv[1]).resolve()
    ffmpeg = shutil.which("ffmpeg")
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)

        def run(*arguments, code=0, **more):
            result = subprocess.run([retrace, *arguments], cwd=folder, capture_output=True, text=True, **more)
            check(result.returncode == code, f"{' '.join(map(str, arguments))}: exit code {result.returncode}, not {code}: {result.stderr}")
            return result

        run("make-scene", "creatures", "--set", "detail=2", "--set", "bones=4", "-o", "creatures.glb")
        small = ["--animation", "--size", "64x48", "--spp", "1", "--quiet"]

        # Both structures, every frame of the animation (4 s), beside the full rebuild.
        run("render", "creatures.glb", "-o", "two.png", *small, "--fps", "2", "--full-rebuild", "every", "--stats", "two.json")
        stats = json.loads((folder / "two.json").read_text())
        frames = stats["frames"]
        check([f["time"] for f in frames] == [0.5 * i for i in range(8)], f"times: {[f['time'] for f in frames]}")
        check(all(f["different_pixels"] == 0 and f["camera"]["rays"] == 64 * 48 for f in frames), f"frames: {frames}")
        check(all(f["update"]["objects_rebuilt"] == 2 and f["full_rebuild"]["total_s"] > 0 for f in frames), f"costs: {frames}")
        run("render", "creatures.glb", "-o", "one-###.png", *small, "--fps", "2", "--structure", "one-tree", "--no-video")
        pictures = set()
        for i in range(8):
            two = (folder / f"two-{i:04}.png").read_bytes()
            check(two == (folder / f"one-{i:03}.png").read_bytes(), f"frame {i} depends on the structure")
            pictures.add(two)
        check(len(pictures) == 8, f"only {len(pictures)} of 8 frames differ from each other")
        # A fixed-point engine walks either; of two levels, an image that is written over is one made from nothing.
        run("render", "creatures.glb", "-o", "kernel.png", *small, "--fps", "1", "--engine", "csim", "--full-rebuild", "every", "--no-video",
            "--stats", "kernel.json")
        stats_kernel = json.loads((folder / "kernel.json").read_text())
        for f in stats_kernel["frames"]:
            check(f["different_pixels"] == 0 and f["update"]["objects_rebuilt"] == 2, f"frame of csim: {f}")
            check(f["update"]["bytes"] * 2 > stats_kernel["image_bytes"], f"objects deform, so all is written: {f}")
        run("render", "creatures.glb", "-o", "csim.png", *small, "--frames", "1", "--engine", "csim", "--structure", "one-tree", "--no-video")
        check((folder / "csim-0000.png").exists(), "no frame of csim")

        # How a walk goes up and the mailbox count where there is one tree, and are refused where there is not.
        for way, mailbox in (("parent", 8), ("face", 0)):
            run("render", "creatures.glb", "-o", "way.png", *small, "--frames", "1", "--structure", "one-tree", "--no-video", "--stats", "way.json",
                "--way-up", way, *([f"--mailbox={mailbox}"] if mailbox else []))
            stats_way = json.loads((folder / "way.json").read_text())
            work = stats_way["frames"][0]["camera"]
            check((stats_way["way_up"], stats_way["mailbox"]) == (way, mailbox), f"{stats_way['way_up']}, {stats_way['mailbox']}")
            check((work["up"] > 0) == (way == "parent") and (work["skipped"] > 0) == (mailbox > 0), f"{way}, {mailbox}: {work}")
        # Of two levels golden then walks the memory image.
        images = set()
        for i, walk in enumerate((["--way-up", "face"], ["--way-up", "stack"], ["--way-up", "parent", "--mailbox"])):
            run("render", "creatures.glb", "-o", f"walk{i}.png", *small, "--frames", "1", "--no-video", *walk)
            images.add((folder / f"walk{i}-0000.png").read_bytes())
        check(len(images) == 1, "golden's walks over instances differ")

        check((folder / "two.mp4").exists() == bool(ffmpeg), "a video exactly where ffmpeg is installed")
        if ffmpeg:
            check(stats["video"] == "two.mp4", f"video: {stats['video']}")
            probe = subprocess.run([shutil.which("ffprobe"), "-v", "error", "-count_frames", "-show_entries", "stream=width,height,nb_read_frames,duration",
                                    "-of", "json", folder / "two.mp4"], check=True, stdout=subprocess.PIPE)
            stream = json.loads(probe.stdout)["streams"][0]
            check((stream["width"], stream["height"], stream["nb_read_frames"], float(stream["duration"])) == (64, 48, "8", 4.0), f"video: {stream}")
        alone = dict(os.environ, PATH=str(folder))
        quiet = run("render", "creatures.glb", "-o", "alone.png", *small[:-1], "--frames", "1", env=alone)
        check("ffmpeg is not installed" in quiet.stderr and not (folder / "alone.mp4").exists(), "without ffmpeg: a note and no video")
        refused = run("render", "creatures.glb", "-o", "x.png", *small, "--video", "x.mp4", code=1, env=alone)
        check("ffmpeg" in refused.stderr, refused.stderr)

        # Bad input: one line that says what is wrong, exit code 1, nothing written.
        good = (folder / "creatures.glb").read_bytes()
        for break_it, message in BAD:
            glb = Glb(good)
            break_it(glb)
            (folder / "bad.glb").write_bytes(glb.pack())
            for command in (["render", "bad.glb", "-o", "bad.png", *small], ["lab", "bad.glb", "--animation-only", "--size", "16x16", "-q"]):
                result = run(*command, code=1)
                check(message in result.stderr and result.stderr.count("\n") == 1 and "bad.glb" in result.stderr,
                      f"{break_it.__name__}, {command[0]}: {result.stderr}")
            check(not list(folder.glob("bad-*.png")), f"{break_it.__name__}: frames were written")
            print(f"{break_it.__name__}: {result.stderr.strip()}")
        for wrong in (["--fps", "0"], ["--structure", "three"], ["--engine", "csim", "--way-up", "stack"], ["--video", "a.mp4", "--no-video"]):
            run("render", "creatures.glb", "-o", "x.png", "--animation", *wrong, code=2)
        run("render", "creatures.glb", "-o", "x.png", "--fps", "2", code=2)  # needs --animation
        run("render", "none.glb", "-o", "x.png", *small, code=1)
        check(not list(folder.glob("x*")) and not list(folder.glob(".*tmp*")), "something was left behind")

        # A million instanced triangles.
        run("make-scene", "carousel", "-o", "carousel.glb")
        run("render", "carousel.glb", "-o", "carousel.png", *small, "--start", "1.3", "--frames", "1", "--full-rebuild", "every", "--no-video",
            "--stats", "carousel.json")
        stats = json.loads((folder / "carousel.json").read_text())
        frame = stats["frames"][0]
        check(stats["instances"] >= 100 and stats["instanced_triangles"] >= 1_000_000, f"{stats['instances']} instances")
        check(stats["triangles"] * 20 < stats["instanced_triangles"], "instanced meshes are copied")
        check(frame["update"]["objects_rebuilt"] == 0 and frame["different_pixels"] == 0, f"frame: {frame}")
        faster = frame["full_rebuild"]["total_s"] / frame["update"]["total_s"]
        print(f"carousel: {stats['instances']} instances, {stats['instanced_triangles']} triangles: following a frame {frame['update']['total_s'] * 1e3:.3f} ms, "
              f"full rebuild {frame['full_rebuild']['total_s']:.2f} s, {faster:.0f} times as much")
        check(faster >= FASTER, f"only {faster:.0f} times cheaper")
        # The memory image: at most a tenth of the flat one, of which a frame writes a small part.
        run("make-scene", "carousel", "--set", "count=100", "--set", "detail=5", "-o", "small.glb")
        run("render", "small.glb", "-o", "kernel.png", *small, "--start", "1.3", "--fps", "2", "--frames", "2", "--engine", "csim", "--no-video",
            "--stats", "carousel.json")
        stats = json.loads((folder / "carousel.json").read_text())
        check(stats["image_bytes"] * 10 <= stats["flat_image_bytes"], f"{stats['image_bytes']} against {stats['flat_image_bytes']} bytes")
        check(all(f["update"]["objects_rebuilt"] == 0 and f["update"]["bytes"] * 5 < stats["image_bytes"] for f in stats["frames"]),
              f"bytes a frame: {stats['frames']}")
        print(f"100 instances: image {stats['image_bytes']} bytes, flat {stats['flat_image_bytes']}, a frame writes {stats['bytes_a_frame']:.0f}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
