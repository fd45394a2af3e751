"""Each fault of the bad tasks is caught where its comment says so, by the rule it names, and nowhere else; and in the ring itself, broken once for each rule.
usage: hls_tasks_test.py [AP_TYPES]"""
import os
import re
import shutil
import subprocess
import sys
import tempfile

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.dirname(os.path.dirname(HERE))
RULES = {"master", "ends", "carried", "interval"}
BREAKS = [("step.cpp", "  RT_LAP(rays)\n", "", "carried"), ("step.cpp", "RT_PIPELINE(1)  // one node a token", "RT_PIPELINE(1)", "interval"),
          ("hit_writer.cpp", "    const ap_uint<32> index = tail;\n", "    const ap_uint<32> index = tail;\n    hits[0] = 0;\n", "master"),
          ("ring.hpp", "TASK(step, step, (nodes, step_rays, stepped))", "TASK(step, step, (nodes, exit_rays, stepped))", "ends")]


def check(options, path):
    return subprocess.run([sys.executable, os.path.join(ROOT, "scripts", "hls_tasks.py")] + options + [path], capture_output=True, text=True, cwd=ROOT)


def main():
    options = ["--ap-types", sys.argv[1]] if len(sys.argv) > 1 else []
    failed = 0
    path = os.path.join(HERE, "tasks", "bad_tasks.cpp")
    with open(path, encoding="utf-8") as file:
        expected = {(number, rule) for number, line in enumerate(file, 1) for rule in re.findall(r"/[/*] expect: (\w+)", line)}
    run = check(options, path)
    found = {(int(line), rule) for line, rule in re.findall(r"^[^:]+:(\d+):\d+: (\w+):", run.stdout, re.M)}
    good = found == expected and {rule for _, rule in found} == RULES and run.returncode == 1
    print("bad_tasks.cpp: %d findings, %s" % (len(found), "as expected" if good else "NOT as expected\n" + run.stdout + run.stderr))
    failed += not good
    with tempfile.TemporaryDirectory(prefix="retrace-tasks-") as work:
        shutil.copytree(os.path.join(ROOT, "hls"), os.path.join(work, "hls"))
        shutil.copytree(os.path.join(ROOT, "testbench", "csim", "include"), os.path.join(work, "testbench", "csim", "include"))
        for name, old, new, _ in BREAKS:
            broken = os.path.join(work, "hls", "ring", name)
            with open(broken, encoding="utf-8") as file:
                text = file.read()
            assert old in text, (name, old)
            with open(broken, "w", encoding="utf-8") as file:
                file.write(text.replace(old, new, 1))
        run = check(options, os.path.join(work, "hls", "ring"))
        found = set(re.findall(r"([\w.]+):\d+:\d+: (\w+):", run.stdout))
        for name, _, _, rule in BREAKS:
            # A break of the list of tasks shows in the region that is made of it.
            good = any(found_rule == rule and (file == name or name.endswith(".hpp")) for file, found_rule in found)
            print("%-14s %-9s %s" % (name, rule, "bites" if good else "does NOT bite\n" + run.stdout + run.stderr))
            failed += not good
        others = {rule for _, rule in found} - {rule for _, _, _, rule in BREAKS}
        good = run.returncode == 1 and len(found) == len(BREAKS) and not others
        print("nothing else is found: %s" % ("so it is" if good else "NOT so\n" + run.stdout + run.stderr))
        failed += not good
    run = check(options, os.path.join(ROOT, "hls", "stages"))
    print("a folder without tasks is %s" % ("refused" if run.returncode not in (0, 1) else "NOT refused"))
    failed += run.returncode in (0, 1)
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
