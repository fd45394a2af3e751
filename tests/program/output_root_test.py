#!/usr/bin/env python3
"""Output files on file systems that only root can make. Usage: output_root_test.py RETRACE

Needs root and the right to mount (as in a privileged container); elsewhere it says so and is skipped (77). A full disk, a read-only
one, a folder without write permission, a single file that is mounted, a device, a link to another file system, a run that is killed in a
container where every process has the same number, two runs on one file. Always: the old file or the new one, whole; one line that
names the file and the reason; nothing left over."""
import contextlib
import os
import pathlib
import signal
import stat
import subprocess
import sys
import tempfile
import time

FORMATS = ["png", "jpg", "tif", "gif", "jp2", "sgi", "heic", "bmp", "tga", "exr", "hdr"]
RAYS = (b"\x93NUMPY\x01\0\x3c\0" + b"{'descr':'<f8','fortran_order':False,'shape':(0,8)}".ljust(59) + b"\n")
NOBODY = 65534


def check(condition, message):
    if not condition:
        sys.exit(f"output_root_test: {message}")


def mount(*arguments):
    subprocess.run(["mount", *map(str, arguments)], check=True)


@contextlib.contextmanager
def mounted(*arguments):
    mount(*arguments)
    try:
        yield pathlib.Path(arguments[-1])
    finally:
        subprocess.run(["umount", str(arguments[-1])], check=True)


def is_png(data):
    return data.startswith(b"\x89PNG\r\n\x1a\n") and data.endswith(b"IEND\xaeB`\x82")


class Runs:
    def __init__(self, program, folder):
        self.program, self.folder = program, folder

    def run(self, *arguments, code=0, **more):
        result = subprocess.run([self.program, *map(str, arguments)], cwd=self.folder, capture_output=True, text=True, timeout=300, **more)
        line = " ".join(map(str, arguments))
        check(result.returncode == code, f"{line}: exit code {result.returncode}, not {code}: {result.stderr}")
        return result

    def refused(self, path, reason, *arguments, **more):
        result = self.run(*arguments, "-q", code=1, **more)
        check(result.stderr == f"retrace: error: cannot write {path}: {reason}\n", f"{path}: '{result.stderr}', expected '{reason}'")

    def full_disk(self):
        disk = self.folder / "disk"
        disk.mkdir()
        with mounted("-t", "tmpfs", "-o", "size=64k", "none", disk):
            for extension in FORMATS:
                (disk / f"a.{extension}").write_bytes(b"old")
            (disk / "a.npy").write_bytes(b"old")
            (disk / "mounted.png").write_bytes(b"old")
            with open(disk / "fill", "wb", buffering=0) as fill:
                with contextlib.suppress(OSError):
                    while fill.write(bytes(1024)):
                        pass
            names = sorted(os.listdir(disk))
            for extension in FORMATS:
                path = disk / f"a.{extension}"
                self.refused(path, "No space left on device", "render", "box", "-o", path, "--size", "320x240", "--spp", "1")
                check(path.read_bytes() == b"old", f"{path}: the old file is gone")
            self.refused(disk / "new.glb", "No space left on device", "make-scene", "knot", "-o", disk / "new.glb")
            self.refused(disk / "new.rtkd", "No space left on device", "pack", "knot:along=60", "-o", disk / "new.rtkd")
            # A picture that fits and statistics that do not: neither.
            (self.folder / "kept.png").write_bytes(b"old")
            self.refused(disk / "a.json", "No space left on device", "render", "box", "-o", "kept.png", "--stats", disk / "a.json", "--size", "32x24")
            check((self.folder / "kept.png").read_bytes() == b"old", "a picture was replaced although the statistics failed")
            with mounted("--bind", disk / "mounted.png", disk / "mounted.png"):
                self.refused(disk / "mounted.png", "No space left on device", "render", "box", "-o", disk / "mounted.png", "--size", "320x240", "--spp", "1")
                check((disk / "mounted.png").read_bytes() == b"old", "a mounted file was destroyed on a full disk")
            check(sorted(os.listdir(disk)) == names, f"left over: {set(os.listdir(disk)) - set(names)}")

    def read_only(self):
        disk = self.folder / "read-only"
        disk.mkdir()
        with mounted("-t", "tmpfs", "none", disk):
            (disk / "a.png").write_bytes(b"old")
            mount("-o", "remount,ro", disk)
            before = time.monotonic()
            for name in ("a.png", "b.png"):
                self.refused(disk / name, "Read-only file system", "render", "room", "-o", disk / name, "--size", "4000x4000", "--spp", "64")
            check(time.monotonic() - before < 30, "found out after the work only")
        # A folder that a user may not write to, with a file in it that he may.
        folder = self.folder / "theirs"
        folder.mkdir()
        for name, mode in (("mine.png", 0o666), ("theirs.png", 0o644)):
            (folder / name).write_bytes(b"old")
            (folder / name).chmod(mode)
        user = {"user": NOBODY, "group": NOBODY, "extra_groups": []}
        for name in ("theirs.png", "new.png"):
            self.refused(folder / name, "Permission denied", "render", "box", "-o", folder / name, "--size", "32x24", **user)
        self.run("render", "box", "-q", "-o", folder / "mine.png", "--size", "32x24", **user)
        check(is_png((folder / "mine.png").read_bytes()), "a file that may be written was not")
        check((folder / "theirs.png").read_bytes() == b"old" and len(os.listdir(folder)) == 2, f"{os.listdir(folder)}")
        # Root leaves a user's file to the user.
        (self.folder / "users.png").write_bytes(b"old")
        (self.folder / "users.png").chmod(0o640)
        os.chown(self.folder / "users.png", NOBODY, NOBODY)
        self.run("render", "box", "-q", "-o", "users.png", "--size", "32x24")
        info = (self.folder / "users.png").stat()
        check((info.st_uid, info.st_gid, stat.S_IMODE(info.st_mode)) == (NOBODY, NOBODY, 0o640), f"owner and mode: {info}")

    def mounted_file(self):
        (self.folder / "host.png").write_bytes(b"x" * 100000)
        inside = self.folder / "container"
        inside.mkdir()
        (inside / "a.png").write_bytes(b"")
        with mounted("--bind", self.folder / "host.png", inside / "a.png"):
            self.run("render", "box", "-q", "-o", inside / "a.png", "--size", "32x24")
        check(is_png((self.folder / "host.png").read_bytes()), "the mounted file does not hold the picture")
        check((inside / "a.png").read_bytes() == b"" and os.listdir(inside) == ["a.png"], f"{os.listdir(inside)}")

    def devices_and_links(self):
        os.mknod(self.folder / "null", stat.S_IFCHR | 0o666, os.makedev(1, 3))
        (self.folder / "rays.npy").write_bytes(RAYS)
        self.run("trace", "box", "-q", "-i", "rays.npy", "-o", "null", "--stats", "null")
        self.run("render", "box", "-q", "-o", "null", "--stats", "null", "--size", "32x24")
        check(stat.S_ISCHR((self.folder / "null").stat().st_mode), "the device was replaced")
        os.mknod(self.folder / "full", stat.S_IFCHR | 0o666, os.makedev(1, 7))
        self.refused("full", "No space left on device", "trace", "box", "-i", "rays.npy", "-o", "full")
        os.mkfifo(self.folder / "fifo")
        with subprocess.Popen(["cat", self.folder / "fifo"], stdout=subprocess.PIPE) as reader:
            self.run("render", "box", "-q", "-o", "fifo", "--size", "32x24")
            check(is_png(reader.stdout.read()), "no picture through the FIFO")
        check(stat.S_ISFIFO((self.folder / "fifo").stat().st_mode), "the FIFO was replaced")
        disk = self.folder / "other"
        disk.mkdir()
        with mounted("-t", "tmpfs", "none", disk):
            (self.folder / "link.png").symlink_to("other/a.png")
            for _ in range(2):  # the file is made, then replaced
                self.run("render", "box", "-q", "-o", "link.png", "--size", "32x24")
            check((self.folder / "link.png").is_symlink() and is_png((disk / "a.png").read_bytes()), "the link was not followed")
            check(os.listdir(disk) == ["a.png"], f"{os.listdir(disk)}")

    def killed(self):
        # As in a container: the program is process 1 in every run.
        alone = ["unshare", "--pid", "--fork", "--kill-child=KILL", self.program]
        folder = self.folder / "killed"
        folder.mkdir()
        for wait in (0.3, 1.0, 2.0):
            run = subprocess.Popen([*alone, "render", "knot", "-q", "-o", folder / "a.png", "--size", "1600x1200", "--spp", "64"],
                                   start_new_session=True)
            time.sleep(wait)
            os.killpg(run.pid, signal.SIGKILL)
            run.wait()
            check(os.listdir(folder) == [], f"left over after SIGKILL: {os.listdir(folder)}")
        subprocess.run([*alone, "render", "box", "-q", "-o", folder / "a.png", "--size", "32x24"], check=True, stdout=subprocess.DEVNULL)
        check(is_png((folder / "a.png").read_bytes()), "no picture after runs that were killed")

    def two_runs(self):
        alone = ["unshare", "--pid", "--fork", self.program]
        pictures = set()
        for seed in range(2):
            self.run("render", "box", "-q", "-o", "one.png", "--size", "320x240", "--seed", seed)
            pictures.add((self.folder / "one.png").read_bytes())
        check(len(pictures) == 2, "the seeds do not matter")
        for _ in range(5):
            runs = [subprocess.Popen([*alone, "render", "box", "-q", "-o", "both.png", "--size", "320x240", "--seed", str(seed)],
                                     cwd=self.folder, stdout=subprocess.DEVNULL) for seed in range(2)]
            check([run.wait() for run in runs] == [0, 0], "two runs on one file: an error")
            check((self.folder / "both.png").read_bytes() in pictures, "two runs on one file: a mixture")


def main():
    program = pathlib.Path(sys.argv[1]).resolve()
    if os.geteuid() != 0:
        print("output_root_test: needs root (mounts, devices, users); skipped")
        return 77
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        folder.chmod(0o755)
        (folder / "try").mkdir()
        if subprocess.run(["mount", "-t", "tmpfs", "none", folder / "try"], capture_output=True, check=False).returncode != 0:
            print("output_root_test: root may not mount here; skipped")
            return 77
        subprocess.run(["umount", folder / "try"], check=True)
        runs = Runs(program, folder)
        for test in (runs.full_disk, runs.read_only, runs.mounted_file, runs.devices_and_links, runs.killed, runs.two_runs):
            test()
            print(f"{test.__name__}: passed")
        hidden = [p for p in folder.rglob(".*")]
        check(not hidden, f"left over: {hidden}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
