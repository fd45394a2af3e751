"""scripts/release: complete, reproducible, checksums hold, versions must agree; the RTL package is all that a lint needs.

usage: release_test.py --work FOLDER   (documentation is packed as well where .env/docs is installed)
"""
import argparse
import hashlib
import importlib.machinery
import importlib.util
import pathlib
import re
import shutil
import subprocess
import sys
import tarfile

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent


def check(condition, what):
    if not condition:
        sys.exit("release_test: " + what)


def load():
    loader = importlib.machinery.SourceFileLoader("release", str(ROOT / "scripts/release"))
    release = importlib.util.module_from_spec(importlib.util.spec_from_loader("release", loader))
    sys.dont_write_bytecode = True
    loader.exec_module(release)
    return release


def fails(release, call, words):
    try:
        call()
    except release.Failure as failure:
        check(words in str(failure), "the failure says '%s', not '%s'" % (failure, words))
        return
    check(False, "no failure that says '%s'" % words)


def versions(release):
    texts = {name: (ROOT / name).read_text(encoding="utf-8") for name in ("CMakeLists.txt", "retrace.core", "CITATION.cff", "CHANGELOG.md")}
    version = release.version_of(texts)
    for name in texts:
        other = {**texts, name: texts[name].replace(version, "9.8.7", 1) if name != "CMakeLists.txt" else texts[name].replace("VERSION " + version, "VERSION 9.8.7")}
        fails(release, lambda other=other: release.version_of(other), "9.8.7")
        fails(release, lambda name=name: release.version_of({**texts, name: ""}), "no version in " + name)
    check(release.notes_of(texts["CHANGELOG.md"], version).startswith("# Retrace " + version), "notes")
    fails(release, lambda: release.notes_of("## %s\n\n## 0.0.1\n- x\n" % version, version), "says nothing")
    return version


def make(output, with_docs):
    command = [sys.executable, str(ROOT / "scripts/release"), "--allow-changes", "--without-wheel", "--output", str(output)] + ([] if with_docs else ["--without-docs"])
    step = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)
    check(step.returncode == 0, step.stdout)
    again = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)
    check(again.returncode != 0 and "exists" in again.stdout, "an existing release is replaced")


def lint(folder):
    """Every file that the package description names is there, and Verilator needs no other."""
    core = (folder / "retrace.core").read_text(encoding="utf-8")
    filesets = core.split("\nfilesets:")[1].split("\nparameters:")[0]
    names = re.findall(r"^      - ([\w./-]+\.\w+)", filesets, re.MULTILINE)
    check(len(names) > 40, "only %d files in retrace.core" % len(names))
    for name in names:
        check((folder / name).is_file(), "retrace.core names %s, which the RTL package does not hold" % name)
    if shutil.which("verilator") is None:
        print("release_test: no verilator, the package is not linted")
        return
    sources = [name for name in names if name.startswith("rtl/") and name.endswith((".sv", ".v", ".vlt")) and not name.startswith("rtl/board/")]
    step = subprocess.run(["verilator", "--lint-only", "-Wall", "+define+RT_CONFIG=ConfigSmall", "+incdir+rtl/pkg", "rtl/waivers.vlt",
                           *[name for name in sources if name != "rtl/waivers.vlt"], "--top-module", "rt_axi"], cwd=folder, stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT, text=True, check=False)
    check(step.returncode == 0, "lint of the RTL package:\n" + step.stdout)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--work", required=True)
    work = pathlib.Path(parser.parse_args().work)
    release = load()
    version = versions(release)

    shutil.rmtree(work, ignore_errors=True)
    work.mkdir(parents=True)
    with_docs = (ROOT / ".env/docs/requirements.installed").exists()
    make(work / "a", with_docs)
    make(work / "b", with_docs)
    expected = {"NOTES.md", "SHA256SUMS"} | {"retrace-%s-%s.tar.gz" % (part, version) for part in ["hls", "rtl"] + (["docs"] if with_docs else [])}
    for folder in ("a", "b"):
        check({path.name for path in (work / folder).iterdir()} == expected, "files: " + str(sorted(path.name for path in (work / folder).iterdir())))
    for name in sorted(expected):
        check((work / "a" / name).read_bytes() == (work / "b" / name).read_bytes(), "%s is not the same twice" % name)
    sums = dict(reversed(line.split("  ")) for line in (work / "a/SHA256SUMS").read_text(encoding="utf-8").splitlines())
    check(set(sums) == expected - {"SHA256SUMS"}, "SHA256SUMS names other files")
    for name, digest in sums.items():
        check(hashlib.sha256((work / "a" / name).read_bytes()).hexdigest() == digest, "checksum of " + name)
    check(not [path for path in work.iterdir() if path.name not in ("a", "b")], "something is left over")

    with tarfile.open(work / "a" / ("retrace-rtl-%s.tar.gz" % version)) as tar:
        tar.extractall(work / "rtl", filter="data")
    lint(work / "rtl" / ("retrace-rtl-" + version))
    print("release_test: version %s, %d files, the same bytes twice" % (version, len(expected)))


if __name__ == "__main__":
    main()
