"""The rooms of the code base and who may use whom: every #include of C++ in golden/, hls/, scenes/ and testbench/ and every
target_link_libraries() between libraries of the project must be an arrow that rooms.toml permits, and rooms.toml must permit no more.

usage: tests/layering/layering_test.py [--root FOLDER] [--bites]

--bites adds arrows that are not permitted to a copy of the sources and expects each to be named. Exit code 1 on any fault.
"""
import argparse
import pathlib
import re
import shutil
import sys
import tempfile
import tomllib

HERE = pathlib.Path(__file__).resolve().parent
FOLDERS = ("golden", "hls", "scenes", "testbench")
SOURCES = {".cpp", ".hpp", ".h", ".in"}
INCLUDE = re.compile(r'^\s*#\s*include\s*(["<])([^">]+)[">]')
COMMAND = re.compile(r"(?<![\w-])(add_library|target_link_libraries)\s*\(\s*([\w-]+)([^)]*)\)")


class Faults(list):
    def add(self, file, line, text):
        self.append("%s:%d: %s" % (file, line, text))


def room_of(rooms, path):
    """The room that a path from the root lies in: the longest one that is a folder above it. None outside of all rooms."""
    folders = [path.parents[i].as_posix() for i in range(len(path.parents) - 1)]
    return next((folder for folder in folders if folder in rooms), None)


def target_of(root, file, name):
    """The file of the project that an include names, from the root, or None: generated and foreign headers."""
    for candidate in ((root / file).parent / name, root / name):
        if candidate.is_file() and candidate.resolve().is_relative_to(root):
            return candidate.resolve().relative_to(root)
    return None


def check(root):
    table = tomllib.loads((root / "tests/layering/rooms.toml").read_text(encoding="utf-8"))
    rooms, libraries = table["uses"], table["libraries"]
    faults, taken = Faults(), set()

    def arrow(file, line, source, target, what):
        if source == target:
            return
        taken.add((source, target))
        if target not in rooms[source]:
            faults.add(file, line, "%s: %s may not use %s (tests/layering/rooms.toml)" % (what, source, target))

    order = list(rooms)
    for room, uses in rooms.items():
        for other in uses:
            if other not in order[: order.index(room)]:
                faults.add("tests/layering/rooms.toml", 1, "%s uses '%s', which does not stand above it in the table" % (room, other))

    cmake, count = [], 0
    for folder in FOLDERS:
        for path in sorted((root / folder).rglob("*")):
            file = path.relative_to(root)
            if path.name == "CMakeLists.txt":
                cmake.append(file)
            if path.suffix not in SOURCES or not path.is_file():
                continue
            source = room_of(rooms, file)
            for number, text in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
                match = INCLUDE.match(text)
                if not match:
                    continue
                count += 1
                if source is None:
                    faults.add(file, number, "the file lies in no room of tests/layering/rooms.toml")
                    break
                target = target_of(root, file, match[2])
                if target is None:
                    # What the build generates has no folder in its name; what has one is meant to be here.
                    if match[1] == '"' and "/" in match[2]:
                        faults.add(file, number, "there is no '%s'" % match[2])
                    continue
                room = room_of(rooms, target)
                if room is None:
                    faults.add(file, number, "'%s' lies in no room of tests/layering/rooms.toml" % target)
                else:
                    arrow(file, number, source, room, '#include "%s"' % match[2])

    # Libraries: where add_library() stands says whose it is.
    commands = []
    for file in cmake:
        text = re.sub(r"#[^\n]*", lambda m: " " * len(m[0]), (root / file).read_text(encoding="utf-8"))
        commands += [(file, text.count("\n", 0, m.start()) + 1, m[1], m[2], m[3].split()) for m in COMMAND.finditer(text)]
    owner = {name: libraries.get(name) or room_of(rooms, file) for file, _, command, name, _ in commands if command == "add_library"}
    links = 0
    for file, line, command, name, arguments in commands:
        source = owner.get(name) or room_of(rooms, file)
        for other in arguments if command == "target_link_libraries" and source else ():
            if owner.get(other):
                links += 1
                arrow(file, line, source, owner[other], "target_link_libraries(%s %s)" % (name, other))

    for room, uses in rooms.items():
        for other in uses:
            if (room, other) not in taken:
                faults.add("tests/layering/rooms.toml", 1, "%s is permitted to use %s and does not: take it out" % (room, other))
    return faults, "%d includes and %d links between %d rooms, %d arrows" % (count, links, len(rooms), len(taken))


def copy_of(root, folder):
    copy = pathlib.Path(folder).resolve()
    for part in (*FOLDERS, "rtl/shell"):
        shutil.copytree(root / part, copy / part, ignore=shutil.ignore_patterns("*.glb", "*.hex"))
    (copy / "tests/layering").mkdir(parents=True)
    shutil.copy(root / "tests/layering/rooms.toml", copy / "tests/layering")
    return copy


def bites(root):
    """Arrows that are not permitted, each by itself in a copy, and what must be said of it."""
    cases = [
        ("hls/stages/tri_test.hpp", '#include "testbench/kit/random.hpp"', "hls/stages may not use testbench/kit"),
        ("golden/scene/geometry.hpp", '#include "golden/engine/engine.hpp"', "golden/scene may not use golden/engine"),
        ("golden/scene/geometry.hpp", '#include "../engine/engine.hpp"', "golden/scene may not use golden/engine"),
        ("testbench/driver/core_driver.hpp", "#include <testbench/program/workspace.hpp>", "testbench/driver may not use testbench/program"),
        ("golden/tree/memory_image.hpp", '#include "golden/tree/missing.hpp"', "there is no 'golden/tree/missing.hpp'"),
        ("golden/base/CMakeLists.txt", "target_link_libraries(retrace_base PUBLIC\n  retrace_render)", "golden/base may not use golden/render"),
        ("scenes/CMakeLists.txt", "target_link_libraries(retrace_generators PRIVATE retrace_testkit)", "scenes may not use testbench/kit"),
    ]
    # The table itself: an arrow upwards, an arrow that nothing takes.
    table = [
        ('"golden/base" = []', '"golden/base" = ["golden/scene"]', "golden/base uses 'golden/scene', which does not stand above it"),
        ('"golden/base" = []', '"golden/base" = ["rtl/shell"]', "golden/base is permitted to use rtl/shell and does not"),
    ]
    failed, known = 0, check(root)[0]
    for old, new, wanted in table:
        with tempfile.TemporaryDirectory() as folder:
            copy = copy_of(root, folder)
            file = copy / "tests/layering/rooms.toml"
            before = file.read_text(encoding="utf-8")
            file.write_text(before.replace(old, new), encoding="utf-8")
            faults, _ = check(copy)
            if before.count(old) == 1 and any(wanted in fault for fault in faults):
                print("caught   " + next(fault for fault in faults if wanted in fault))
            else:
                failed += 1
                print("MISSED   %s: got %s" % (new, list(faults)))
    for name, line, wanted in cases:
        with tempfile.TemporaryDirectory() as folder:
            copy = copy_of(root, folder)
            before = (copy / name).read_text(encoding="utf-8")
            (copy / name).write_text(before.rstrip("\n") + "\n" + line + "\n", encoding="utf-8")
            place = "%s:%d: " % (name, before.rstrip("\n").count("\n") + 2)
            faults = [fault for fault in check(copy)[0] if fault not in known]
            if len(faults) == 1 and faults[0].startswith(place) and wanted in faults[0]:
                print("caught   " + faults[0])
            else:
                failed += 1
                print("MISSED   %s%s: got %s" % (place, line, list(faults)))
    return failed


def main():
    parser = argparse.ArgumentParser(description="Who may use whom.")
    parser.add_argument("--root", type=pathlib.Path, default=HERE.parent.parent)
    parser.add_argument("--bites", action="store_true")
    arguments = parser.parse_args()
    root = arguments.root.resolve()
    if arguments.bites:
        sys.exit(1 if bites(root) else 0)
    faults, summary = check(root)
    for fault in faults:
        print(fault)
    print(summary)
    sys.exit(1 if faults else 0)


if __name__ == "__main__":
    main()
