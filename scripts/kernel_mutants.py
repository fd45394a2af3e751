#!/usr/bin/env python3
"""Mutants of the C++: each breaks one rule of a kernel or of a machine's model in a copy, and a bench or a test has to notice. Exit code 1 if one survives.

usage: kernel_mutants.py [--build build/release] [--only TEXT] [--list] [--ap-types .env/ap_types]

Kernels (hls/) are broken in an exported package and run through its benches; models (testbench/) are compiled with the command of the build, which has to
have their test, and linked against the rest of it.
"""
import argparse
import os
import re
import shlex
import subprocess
import sys
import tempfile

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
STEPS, LIGHT, VIEW = "hls/streaming/steps.hpp", "hls/streaming/light.hpp", "hls/streaming/grid_view.hpp"
PACKETS = "testbench/packets/packet_engine.cpp"

# (what is broken, file, old text, new text, bench of the package)
KERNELS = [
    ("the highest axis wins a tie of planes", STEPS, "state.leave[a] < nearest", "state.leave[a] <= nearest", "stream_traverse"),
    ("a walk goes on behind its hit", STEPS, "last || state.t <= nearest", "last", "stream_traverse"),
    ("a hit near the plane is not in the voxel", STEPS, "last || state.t <= nearest", "last || state.t + (1 << 21) <= nearest", "stream_traverse"),
    ("a ray leaves through the plane behind it", STEPS, "if (!ray.negative[axis]) planes += 1;", "if (ray.negative[axis]) planes += 1;", "stream_setup"),
    ("a ray goes the other way", STEPS, "state.voxel[a] -= 1;", "state.voxel[a] += 1;", "stream_traverse"),
    ("the plane ahead stays that of the last voxel", STEPS, "    state.leave[a] = leave_t(ray, view, state.voxel[a], a);\n", "", "stream_traverse"),
    ("steps are not counted", STEPS, "  state.steps += 1;\n", "", "stream_traverse"),
    ("a list ends with its first triangle", STEPS, "if (last) state.kernel", "if (true) state.kernel", "stream_intersect"),
    ("a list does not end", STEPS, "  if (last) state.kernel = contract::kKernelTraverse;\n", "", "stream_intersect"),
    ("an any-hit ray goes on", STEPS, "    if (ray.any) state.kernel = contract::kKernelDone;\n", "", "stream_intersect"),
    ("the farthest hit stays", STEPS, "is_nearer(candidate.t, candidate.id, state.t, state.id)", "is_nearer(state.t, state.id, candidate.t, candidate.id)",
     "stream_intersect"),
    ("a hit is reported as a miss", STEPS, "state.status == contract::kStatusMiss && state.found", "false", "stream_finish"),
    ("an entry is the first of its word", VIEW, "place <<= 5;", "place = 0;", "stream_traverse"),
    ("an axis of the voxel's number is left out", STEPS, "  number += state.voxel[1];\n", "", "stream_traverse"),
    ("a normal shows away from the ray", LIGHT, "if (along > 0) normal[a] = -normal[a];", "if (along < 0) normal[a] = -normal[a];", "stream_shade"),
    ("a shadow ray begins on the surface", LIGHT, "    point[a] += normal[a] >> 1;\n", "", "stream_shade"),
    ("a light behind the surface shines", LIGHT, "facing <= 0 || root == 0", "root == 0", "stream_shade"),
    ("a shadow ray ends behind its light", LIGHT, "ap_uint<32> end = 1u << 26;", "ap_uint<32> end = 1u << 27;", "stream_shade"),
    ("a token that was launched keeps the constants of the last ray", "hls/ring/step.cpp", "      rays[t.id.to_uint()] = ray;\n", "", "ring_step"),
    ("a cache takes any line for the wanted one", "hls/ring/leaf_fetch.cpp", "if (held != wanted)", "if (held == 0)", "ring_leaf_fetch"),
    ("the mailbox knows no triangle", "hls/ring/mailbox.cpp", "t.skipped = 1;", "t.skipped = 0;", "ring_mailbox"),
    ("the end is not handed on", "hls/ring/hit_finish.cpp", "kRingEndBit", "kRingEndBit - 1", "ring_hit_finish"),
]
# (what is broken, file, old text, new text, test of the build)
MODELS = [
    ("the far child is forgotten", PACKETS, "if (any(far)) stack.push_back", "if (false) stack.push_back", "packets_test"),
    ("the nearer part ends in front of the plane", PACKETS, "first.end = std::min(first.end, t);", "first.end = std::min(first.end, t / 2);", "packets_test"),
    ("the farther part begins behind the plane", PACKETS, "second.begin = std::max(second.begin, t);", "second.begin = std::max(second.begin, 2 * t);", "packets_test"),
    ("a ray beside the plane goes to the other side", PACKETS, "if (ray.origin[walked.axis] < walked.split) right = {};", "if (ray.origin[walked.axis] < walked.split) left = {};",
     "packets_test"),
    ("the farther hit stays", PACKETS, "hit.t < r.best.t ||", "hit.t > r.best.t ||", "packets_test"),
    ("a hit is reported as a miss", PACKETS, "if (r.found) r.best.status = contract::kStatusHit;", "", "packets_test"),
    ("a triangle is read for each ray", PACKETS, "      ++totals_.triangles;\n", "      totals_.triangles += tested;\n", "packets_test"),
    ("a node is read for each ray", PACKETS, "        ++totals_.nodes;\n", "        totals_.nodes += active;\n", "packets_test"),
    ("memory answers at once", PACKETS, "data = transfer(event.at, kBytes[step.section]) + MachineMemory::kLatency;", "data = transfer(event.at, kBytes[step.section]);", "packets_test"),
    ("a unit has no depth", PACKETS, "free[step.unit] + kDepth[step.unit]", "free[step.unit]", "packets_test"),
    ("a miss moves nothing", PACKETS, "          totals_.bytes += kBytes[step.section];\n", "", "packets_test"),
]


def run(command, where):
    try:
        return subprocess.run(command, cwd=where, capture_output=True, text=True, timeout=3600)
    except subprocess.TimeoutExpired:  # a mutant that never ends is noticed
        return subprocess.CompletedProcess(command, 1, "", "no end within an hour")


def broken(text, old, new, name):
    if text.count(old) == 0:
        sys.exit("kernel_mutants: %s has no '%s'" % (name, old.strip()))
    return text.replace(old, new)


def kernel(package, arguments, name, old, new, bench):
    path = os.path.join(package, name)
    with open(path, encoding="utf-8") as file:
        text = file.read()
    try:
        with open(path, "w", encoding="utf-8") as file:
            file.write(broken(text, old, new, name))
        result = run(["make", "-s", "csim-" + bench, "AP_TYPES=" + os.path.abspath(arguments.ap_types), "CXXFLAGS=-O0 -fno-strict-aliasing"], package)
    finally:
        with open(path, "w", encoding="utf-8") as file:
            file.write(text)
    return result, "error:" in result.stderr


def model(work, arguments, name, old, new, test):
    commands = run(["ninja", "-t", "commands", "tests/%s/%s" % (test.rsplit("_", 1)[0], test)], arguments.build)
    if commands.returncode != 0:
        sys.exit("kernel_mutants: %s" % (commands.stderr or commands.stdout).strip())
    lines = commands.stdout.splitlines()
    compiler = next(line for line in lines if re.search(r" -c \S*%s$" % re.escape(name), line))
    linker = next(part for line in lines for part in line.split(" && ") if re.search(r" -o tests/\S*%s " % test, part))
    source, thing, program = (os.path.join(work, file) for file in ("broken.cpp", "broken.o", "broken"))
    with open(os.path.join(ROOT, name), encoding="utf-8") as file:
        text = broken(file.read(), old, new, name)
    with open(source, "w", encoding="utf-8") as file:
        # Its own header stands beside it.
        file.write(re.sub(r'#include "(\w+\.hpp)"', lambda m: '#include "%s/%s"' % (os.path.dirname(name), m.group(1)), text))
    words = shlex.split(compiler)
    words[words.index("-c") + 1], words[words.index("-o") + 1] = source, thing
    built = run(words, arguments.build)
    if built.returncode != 0:
        return built, True
    # The broken object comes before the library that has the sound one.
    words = shlex.split(linker)
    words[words.index("-o") + 1] = program
    words.insert(words.index("-o"), thing)
    built = run(words, arguments.build)
    if built.returncode != 0:
        return built, True
    return run([program], arguments.build), False


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", default=os.path.join(ROOT, "build/release"))
    parser.add_argument("--ap-types", default=os.path.join(ROOT, ".env/ap_types"))
    parser.add_argument("--only", default="", help="mutants whose description, file or test has this text")
    parser.add_argument("--list", action="store_true")
    arguments = parser.parse_args()
    chosen = [(group, mutant) for group, mutants in ((kernel, KERNELS), (model, MODELS)) for mutant in mutants if any(arguments.only in word for word in (mutant[0], mutant[1], mutant[4]))]
    if not chosen:
        sys.exit("kernel_mutants: no mutant has '%s' in its description, file or test" % arguments.only)
    if arguments.list:
        for _, mutant in chosen:
            print("%s (%s, %s)" % (mutant[0], mutant[1], mutant[4]))
        return
    survived = 0
    with tempfile.TemporaryDirectory() as work:
        package = os.path.join(work, "package")
        if any(group is kernel for group, _ in chosen):
            result = run([os.path.join(ROOT, "scripts/export_hls.sh"), "--output", package], ROOT)
            if result.returncode != 0:
                sys.exit(result.stderr)
        for group, (what, name, old, new, test) in chosen:
            result, failed_to_build = group(package if group is kernel else work, arguments, name, old, new, test)
            if failed_to_build:
                sys.exit("kernel_mutants: %s: does not compile\n%s" % (what, result.stdout + result.stderr))
            caught = result.returncode != 0
            survived += not caught
            print("%-8s %s (%s, %s)" % ("caught" if caught else "SURVIVED", what, name, test), flush=True)
    print("%d mutants, %d survived" % (len(chosen), survived))
    sys.exit(1 if survived else 0)


if __name__ == "__main__":
    main()
