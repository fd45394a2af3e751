#!/usr/bin/env python3
"""Writes docs/what-proves-what.md, the table of claims and tests, from tests/descriptions.toml.

usage: scripts/what_proves_what.py [--check BUILD]

--check BUILD writes nothing. It asks ctest for the tests of that build and fails if one has no description, if a description has no test (those of
folders that were not built are passed over), or if the page is not current.
"""
import argparse
import fnmatch
import json
import pathlib
import subprocess
import sys
import tomllib

ROOT = pathlib.Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs/what-proves-what.md"
HEAD = """# What proves what

<!-- Written by scripts/what_proves_what.py from tests/descriptions.toml. Do not edit. -->

Every test of the project under the claim that it proves. All of them: `scripts/test.sh`; one: `ctest --preset release -R NAME`. A test prints its seed when
it fails, and `RETRACE_SEED` chooses another. A name that ends in `*` stands for several tests, and
that of a program for all tests in it: `ctest --preset release -N -R NAME` lists them.
"""
TAIL = """
## Tests of the tests

| command | what it shows |
| --- | --- |
| `scripts/mutants.sh` | breaks one rule of the RTL at a time; each break must be caught by a test that is named beside it |
| `scripts/coverage.sh` | lines and signals of the RTL that the tests exercise ([coverage](coverage.md)) |
| `scripts/proof/certify.py --self-test` | damages each proof, and each must fail |
| `scripts/netlist_sim.sh` | the netlist of a stage or of the core in the benches of its source ([netlists](netlist-simulation.md)) |
| `scripts/test.sh`, last step | a minute of fuzzing of the glTF loader and of the memory image, under sanitizers |
| `scripts/lint.sh`, `scripts/rtl_lint.sh` | format, spelling and style; Verilator `-Wall` and Yosys with slang |
| `scripts/whole_frames.sh` | whole frames of every kind of scene, core against kernel ([whole frames](whole-frames.md)) |

What no test here can show: the core has not run on silicon, and no vendor's HLS compiler was at hand.
"""


def read_claims():
    with open(ROOT / "tests/descriptions.toml", "rb") as file:
        return tomllib.load(file)


def page(claims):
    parts = [HEAD]
    for claim, tests in claims.items():
        parts.append("\n## %s\n\n| test | what it proves |\n| --- | --- |\n" % claim)
        parts += ["| `%s` | %s |\n" % (name, what) for name, what in tests.items()]
    return "".join(parts) + TAIL


def tests_of(build):
    """Names of the tests, and for each the folder below tests/ that registers it. A test found inside a program goes by the program's name too."""
    listing = subprocess.run(["ctest", "--test-dir", build, "--show-only=json-v1"], check=True, stdout=subprocess.PIPE, text=True)
    description = json.loads(listing.stdout)
    graph = description["backtraceGraph"]
    tests = []
    for test in description["tests"]:
        node = graph["nodes"][test["backtrace"]] if "backtrace" in test else {}
        folder = ""
        while node:  # the outermost place that is a folder of tests
            file = pathlib.Path(graph["files"][node["file"]])
            if file.parent.parent.name == "tests":
                folder = file.parent.name
            node = graph["nodes"][node["parent"]] if "parent" in node else {}
        names = [test["name"].removesuffix("_NOT_BUILT")]
        if "command" in test:
            names.append(pathlib.Path(test["command"][0]).name)
        tests.append((names, folder))
    return tests


def matches(name, pattern):
    return fnmatch.fnmatchcase(name, pattern)


def faults(claims, tests, folders):
    patterns = [pattern for lines in claims.values() for pattern in lines]
    used = set()
    found = []
    for names, _ in tests:
        own = [pattern for pattern in patterns if any(matches(name, pattern) for name in names)]
        if not own:
            found.append("the test %s has no line in tests/descriptions.toml" % names[0])
        used.update(own)
    built = {folder for _, folder in tests}
    for pattern in patterns:
        if patterns.count(pattern) > 1:
            found.append("%s stands twice in tests/descriptions.toml" % pattern)
        # A folder that was not built names its tests in its CMakeLists.txt.
        stem = pattern.rstrip("*")
        elsewhere = any(stem in text for folder, text in folders.items() if folder not in built)
        if pattern not in used and not elsewhere:
            found.append("no test is called %s" % pattern)
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", metavar="BUILD")
    arguments = parser.parse_args()
    claims = read_claims()
    if not arguments.check:
        PAGE.write_text(page(claims), encoding="utf-8")
        print("what_proves_what: wrote docs/what-proves-what.md")
        return
    tests = tests_of(arguments.check)
    folders = {path.parent.name: path.read_text(encoding="utf-8") for path in (ROOT / "tests").glob("*/CMakeLists.txt")}
    found = faults(claims, tests, folders)
    if not PAGE.exists() or PAGE.read_text(encoding="utf-8") != page(claims):
        found.append("docs/what-proves-what.md is not current; run scripts/what_proves_what.py")
    for fault in found:
        print("what_proves_what: " + fault, file=sys.stderr)
    if found:
        sys.exit(1)
    print("what_proves_what: %d tests, each with what it proves" % len(tests))


if __name__ == "__main__":
    main()
