"""Each bad example is caught where its comment says so, by the rule it names, and nowhere else; the good one passes. usage: hls_subset_test.py [AP_TYPES]"""
import glob
import os
import re
import subprocess
import sys

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.dirname(os.path.dirname(HERE))
CHECK = [sys.executable, os.path.join(ROOT, "scripts", "hls_subset.py")]
RULES = {"recursion", "heap", "virtual", "loop", "float", "std", "library", "stream", "macro", "pragma", "narrow", "width"}


def main():
    options = ["--ap-types", sys.argv[1]] if len(sys.argv) > 1 else []
    failed, caught = 0, set()
    for path in sorted(glob.glob(os.path.join(HERE, "subset", "*.cpp"))):
        with open(path, encoding="utf-8") as file:
            expected = {(number, rule) for number, line in enumerate(file, 1) for rule in re.findall(r"// expect: (\w+)", line)}
        run = subprocess.run(CHECK + options + [path], capture_output=True, text=True, cwd=ROOT)
        found = {(int(line), rule) for line, rule in re.findall(r"^[^:]+:(\d+):\d+: (\w+):", run.stdout, re.M)}
        caught |= {rule for _, rule in found}
        good = found == expected and run.returncode == (1 if expected else 0)
        print("%-16s %2d findings: %s" % (os.path.basename(path), len(found), "as expected" if good else "NOT as expected"))
        if not good:
            failed += 1
            print("  missed: %s\n  not expected: %s\n  exit code %d\n%s" % (sorted(expected - found), sorted(found - expected), run.returncode, run.stdout + run.stderr))
    if caught != RULES:
        failed += 1
        print("rules that no example breaks: %s" % ", ".join(sorted(RULES - caught)))
    # Nothing may pass because nothing was looked at.
    for what, arguments in (("a source that does not compile", ["--define", "good=9"] + [os.path.join(HERE, "subset", "good.cpp")]),
                            ("a folder without sources", [os.path.join(ROOT, "docs")]), ("a file that is not there", ["no_such.cpp"])):
        run = subprocess.run(CHECK + options + arguments, capture_output=True, text=True, cwd=ROOT)
        good = run.returncode not in (0,) and "hls_subset:" in run.stderr
        print("%-34s %s" % (what, "refused" if good else "NOT refused:\n" + run.stdout + run.stderr))
        failed += not good
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
