"""Simulation after synthesis: the netlist that scripts/bitstream places and routes, verilated with models of the ECP5's cells, in the benches of
the RTL.

A stage: netlist, RTL and HLS function get the same vectors without stalls, with random stalls and under full back-pressure; every output bit
and tag, the latency and the interval must be equal. The core (configuration small): a frame through a memory with random latency, reordering
and stalls; every byte of every hit must be csim's.

Benches and libraries come from an existing Ninja build; only the file that names the model's class is compiled again, against the netlist's.
The netlist's ports are split into bits for the simulator (a port whose bits feed each other would look like a loop) and a wrapper with the
ports of the module is put around it.

--mutate breaks one cell of the netlist, the N-th of its kind modulo their number, and expects a difference: exit code 0 if the bench notices.
  lut:N   a LUT4 gives the complement    ff:N    a register never loads
  mul:N   a multiplier takes A as signed where it was unsigned and the other way round
"""
import argparse
import collections
import hashlib
import importlib.machinery
import importlib.util
import json
import os
import re
import shlex
import shutil
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor

import placed_netlist

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
STAGES = ["ray_setup", "kd_descend", "leaf_exit", "kd_backtrack", "tri_test", "hit_finish", "instance_enter"]
CELLS = "testbench/sim/netlist"
CORE_CONFIG = "small"
KINDS = {"lut": "LUT4", "ff": "TRELLIS_FF", "mul": "MULT18X18D"}


class Failure(Exception):
    pass


def load_bitstream():
    path = os.path.join(ROOT, "scripts/bitstream")
    loader = importlib.machinery.SourceFileLoader("bitstream", path)
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader("bitstream", loader))
    sys.dont_write_bytecode = True
    loader.exec_module(module)
    return module


bitstream = load_bitstream()


def run(command, what, **options):
    step = subprocess.run(command, capture_output=True, text=True, check=False, **options)
    if step.returncode != 0:
        lines = (step.stderr.strip() or step.stdout.strip()).splitlines()
        raise Failure("%s failed:\n%s" % (what, "\n".join(lines[-20:])))
    return step.stdout


def yosys(passes, what):
    program = "from pyosys import libyosys as ys\nd = ys.Design()\nfor c in %r:\n    ys.run_pass(c, d)\n" % passes
    run([bitstream.TOOLS, "-c", program], what, cwd=ROOT)


# ------------------------------------------------------------------------------------------------------------------------ the netlist

def source_key(top, config):
    """Changes when anything does that the netlist depends on."""
    digest = hashlib.sha256(("%s %s %s" % (top, config, bitstream.importlib_version("pyosys"))).encode())
    files = [os.path.join(ROOT, "scripts/bitstream"), os.path.join(ROOT, "scripts/synthesis.py")]
    for folder, _, names in os.walk(os.path.join(ROOT, "rtl")):
        files += [os.path.join(folder, name) for name in names if name.endswith((".sv", ".svh", ".v"))]
    for path in sorted(files):
        with open(path, "rb") as file:
            digest.update(file.read())
    return digest.hexdigest()


def synthesize(top, config, work):
    """The netlist of scripts/bitstream, from its own function; kept while the sources are the same."""
    netlist, key_file = os.path.join(work, "netlist.json"), os.path.join(work, "netlist.key")
    key = source_key(top, config)
    if os.path.exists(netlist) and os.path.exists(key_file):
        with open(key_file) as file:
            if file.read() == key:
                return netlist
    bitstream.synthesize(argparse.Namespace(top=top, config=config, mhz=80), work)
    with open(key_file, "w") as file:
        file.write(key)
    return netlist


def mutate(design, kind, number):
    """Breaks one cell and says which."""
    _, module = placed_netlist.top_of(design, "the netlist")
    cells = sorted(name for name, cell in module["cells"].items() if cell["type"] == KINDS[kind])
    if not cells:
        raise Failure("the netlist has no %s" % KINDS[kind])
    name = cells[number % len(cells)]
    cell = module["cells"][name]
    if kind == "lut":
        old = cell["parameters"]["INIT"]
        cell["parameters"]["INIT"] = "".join({"0": "1", "1": "0"}.get(bit, bit) for bit in old)
        change = "INIT %04x to %04x" % (int(old, 2), int(cell["parameters"]["INIT"], 2))
    elif kind == "ff":
        change = "CEMUX %s to 0" % cell["parameters"]["CEMUX"].strip()
        cell["parameters"]["CEMUX"] = "0 "  # Yosys reads "0" without the space as a number
    else:
        old = cell["connections"]["SIGNEDA"]
        cell["connections"]["SIGNEDA"] = ["0" if old == ["1"] else "1"]
        change = "SIGNEDA %s to %s" % (old[0], cell["connections"]["SIGNEDA"][0])
    return "%s %s: %s" % (cell["type"], name, change)


def write_netlist(design, folder):
    """netlist.v, its cells enumerated (names are long), and wrapper.v with the ports as they were."""
    top, module = placed_netlist.top_of(design, "the netlist")
    source, target = os.path.join(folder, "simulated.json"), os.path.join(folder, "netlist.v")
    with open(source, "w") as file:
        json.dump(design, file)
    yosys(["read_json " + source, "splitnets -ports", "opt_clean -purge", "rename %s netlist" % top, "rename -enumerate -pattern c% c:*",
           "rename -enumerate -pattern w% w:* x:* %d", "write_verilog -noattr " + target], "write_verilog")
    ports, pins = [], []
    for name, port in module["ports"].items():
        width = len(port["bits"])
        ports.append("%s %s%s" % (port["direction"], "[%d:0] " % (width - 1) if width > 1 else "", name))
        pins += [".\\%s[%d] (%s[%d])" % (name, bit, name, bit) for bit in range(width)] if width > 1 else [".%s(%s)" % (name, name)]
    with open(os.path.join(folder, "wrapper.v"), "w") as file:
        file.write("module %s (\n  %s\n);\n  netlist u_netlist (\n    %s\n  );\nendmodule\n" % (top, ",\n  ".join(ports), ",\n    ".join(pins)))
    return collections.Counter(cell["type"] for cell in module["cells"].values())


# -------------------------------------------------------------------------------------------------------------------------- the model

def verilate(top, prefix, folder, split):
    share = run([bitstream.TOOLS, "-c", "import os, pyosys; print(os.path.join(os.path.dirname(pyosys.__file__), 'share/ecp5'))"], "pyosys").strip()
    objects = os.path.join(folder, "obj")
    shutil.rmtree(objects, ignore_errors=True)  # what an earlier netlist left there would be compiled as well
    run(["verilator", "--cc", "--assert", "-O3", "--x-assign", "unique", "--x-initial", "unique", "-Wno-lint", "-Wno-INITIALDLY", "-Wno-TIMESCALEMOD",
         "+define+NO_INCLUDES", "+incdir+" + share, "-y", CELLS, "--Mdir", objects, "--prefix", prefix, "--top-module", top,
         "--output-split", str(split), CELLS + "/ecp5_cells.sv", os.path.join(folder, "wrapper.v"), os.path.join(folder, "netlist.v")],
        "verilator", cwd=ROOT)
    return objects


def compile_model(objects, level, whole, pool):
    include = run(["verilator", "--getenv", "VERILATOR_ROOT"], "verilator").strip() + "/include"

    def compile_one(source):
        # Code that runs once is not worth an optimiser.
        run(["c++", "-std=c++20", "-w", "-O0" if "Slow" in source or "Syms" in source else level, "-I" + objects, "-I" + include,
             "-I" + include + "/vltstd", "-DVL_TIME_CONTEXT", "-c", source, "-o", os.path.splitext(source)[0] + ".o"], "compiler")
        return os.path.splitext(source)[0] + ".o"

    sources = sorted((os.path.join(objects, name) for name in os.listdir(objects) if name.endswith(".cpp")), key=os.path.getsize, reverse=True)
    if whole:
        # Headers cost more than code here, so all is compiled at once.
        with open(os.path.join(objects, "whole.cc"), "w") as file:
            file.writelines('#include "%s"\n' % os.path.basename(source) for source in sources)
        sources = [os.path.join(objects, "whole.cc")]
    return list(pool.map(compile_one, sources))


def ninja_command(build, target, pattern):
    lines = run(["ninja", "-C", build, "-t", "commands", target], "ninja").strip().splitlines()
    found = [line for line in lines if re.search(pattern, line)]
    if not found:
        raise Failure("%s does not build %s" % (build, target))
    return found[-1]


def link(build, program, unit, folder, objects, compiled):
    """`program` of the build with the netlist's model in the place of the RTL's: `unit` is the source that names the model's class."""
    command = ninja_command(build, program, r" -c \S*%s( |$)" % re.escape(unit))
    own = os.path.join(folder, "bench.o")
    command = re.sub(r" -M\S+( \S+\.(o|d))?", "", re.sub(r" -o \S+", "", command))
    # Among equal names, the first folder wins. Optimising the bench costs more than it saves.
    command = re.sub(r" -O\d", " -O1", re.sub(r" -I", lambda _: " -I%s -I" % shlex.quote(objects), command, count=1))
    run(["sh", "-c", "%s -w -o %s" % (command, shlex.quote(own))], "compiler", cwd=build)
    command = ninja_command(build, program, r" -o \S*%s( |$)" % re.escape(program)).split("&&")[1].strip()
    binary = os.path.join(folder, program)
    # Libraries are searched for what is missing, so the RTL's model in the library is not taken; two of them would be an error.
    command = re.sub(r" -o \S+", lambda _: " -o %s %s" % (shlex.quote(binary), " ".join(map(shlex.quote, [own, *compiled]))), command, count=1)
    run(["sh", "-c", command], "linker", cwd=build)
    return binary


def make_model(top, config, prefix, program, unit, arguments, pool):
    """Returns (binary with the netlist, number of cells of each kind, what was broken)."""
    work = os.path.join(os.path.abspath(arguments.build), top)
    os.makedirs(work, exist_ok=True)
    with open(synthesize(top, config, work)) as file:
        design = json.load(file)
    broken = ""
    folder = work
    if arguments.mutate:
        kind, number = arguments.mutate
        broken = mutate(design, kind, number)
        folder = os.path.join(work, "%s%d" % (kind, number))
        os.makedirs(folder, exist_ok=True)
    cells = write_netlist(design, folder)
    objects = verilate(top, prefix, folder, arguments.split)
    compiled = compile_model(objects, arguments.level, arguments.whole, pool)
    return link(arguments.objects, program, unit, folder, objects, compiled), cells, broken


def cells_text(cells):
    return ", ".join("%d %s" % (count, name) for name, count in cells.most_common())


# ----------------------------------------------------------------------------------------------------------------------------- benches

def bench_stage(binary, stage, arguments):
    """(figures by mode, text of a difference)"""
    figures, failure = [], ""
    for mode in ("none", "random", "back-pressure"):
        share = arguments.vectors // 3 + 1
        step = subprocess.run([binary, "--json", "--stage", stage, "--mode", mode, "--vectors", str(share), "--seed", str(arguments.seed), "--threads", "1"],
                              capture_output=True, text=True, check=False, timeout=3600)
        if step.returncode != 0:
            return figures, "%s\n%s" % (mode, step.stderr.strip())
        report = json.loads(step.stdout)[0]
        figures.append({key: report[key] for key in ("vectors", "latency", "interval")})
    return figures, failure


def check_stage(stage, arguments, pool):
    start = time.monotonic()
    binary, cells, broken = make_model("rt_" + stage, CORE_CONFIG, "Vrt_" + stage, "rtl_stages", "testbench/stages/stage_bench.cpp", arguments, pool)
    have, failure = bench_stage(binary, stage, arguments)
    if broken:
        print("%s %s: %s" % ("caught  " if failure else "SURVIVED", stage, broken), flush=True)
        if failure and arguments.verbose:
            print(failure)
        return bool(failure)
    want, rtl_failure = bench_stage(os.path.join(arguments.objects, "testbench/stages/rtl_stages"), stage, arguments)
    if rtl_failure:
        failure = "the RTL itself differs: " + rtl_failure
    if not failure and have != want:
        failure = "latency or interval differ: netlist %s, RTL %s" % (have, want)
    vectors = sum(item["vectors"] for item in have)
    if failure:
        print("DIFFERS  %-12s seed %d: %s" % (stage, arguments.seed, failure), flush=True)
        return False
    print("equal    %-12s %d vectors in each of netlist, RTL, HLS without stalls, with random stalls, under back-pressure, seed %d: 0 differing bits, "
          "latency %d, interval %g; %.0f s\n         cells: %s" % (stage, vectors, arguments.seed, have[0]["latency"], want[0]["interval"],
                                                                  time.monotonic() - start, cells_text(cells)), flush=True)
    return True


def check_core(arguments, pool):
    start = time.monotonic()
    binary, cells, broken = make_model("rt_top", CORE_CONFIG, "Vrt_" + CORE_CONFIG, "rtl_bench", "core_model_%s.cpp" % CORE_CONFIG, arguments, pool)
    made = time.monotonic() - start
    equal = True
    for scene in arguments.scene or ["knot:along=60,around=12", "needles:count=200"]:
        command = [binary, scene, CORE_CONFIG, arguments.size, "--latency=1-60", "--reorder=1", "--stall=20", "--limit=1000", "--seed=%d" % arguments.seed]
        step = subprocess.run(command, capture_output=True, text=True, check=False, timeout=7200)
        same = step.returncode == 0
        equal &= same
        if broken:
            print("%s core: %s" % ("SURVIVED" if same else "caught  ", broken), flush=True)
            if not same:
                return True
            continue
        print("%s core %s on %s %s, memory of 1 to 60 clocks, reordering, 20 %% stalls, seed %d\n%s" % (
            "equal   " if same else "DIFFERS ", CORE_CONFIG, scene, arguments.size, arguments.seed,
            "\n".join("         " + line for line in (step.stdout + step.stderr).strip().splitlines()[:6])), flush=True)
    if not broken:
        print("         cells: %s; model made in %.0f s" % (cells_text(cells), made), flush=True)
    return equal and not broken


# -------------------------------------------------------------------------------------------------------------------------------- main

def parse():
    parser = argparse.ArgumentParser(prog="scripts/netlist_sim.sh", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", nargs="?", default="stage", choices=["stage", "core", "all"])
    parser.add_argument("--stage", action="append", choices=STAGES, help="only this stage (repeats)")
    parser.add_argument("--vectors", type=int, default=30000, help="vectors a stage, over the three modes")
    parser.add_argument("--seed", type=int, default=int(os.environ.get("RETRACE_SEED", "20070701"), 0))
    parser.add_argument("--scene", action="append", help="core: scene of the frame (repeats)")
    parser.add_argument("--size", default="32x24", help="core: size of the frame")
    parser.add_argument("--mutate", action="append", default=[], help="KIND:N, see above (repeats; one model each)")
    parser.add_argument("--optimise", default="0", choices=["0", "1", "2"], help="compiler level: 0 is made soonest, others run faster")
    parser.add_argument("--build", default="build/netlist", help="where netlists and models go")
    parser.add_argument("--objects", default="build/release", help="the Ninja build that the benches come from")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--verbose", action="store_true", help="with --mutate: what the bench said")
    arguments = parser.parse_args()
    for text in arguments.mutate:
        if not re.fullmatch(r"(%s):\d+" % "|".join(KINDS), text):
            parser.error("--mutate takes KIND:N, KIND of %s, not %s" % (" ".join(KINDS), text))
    arguments.objects = os.path.abspath(os.path.join(ROOT, arguments.objects))
    arguments.mutants = [(text.split(":")[0], int(text.split(":")[1])) for text in arguments.mutate] or [None]
    arguments.level = "-O" + arguments.optimise
    arguments.seed = max(arguments.seed, 1)
    return arguments


def main():
    arguments = parse()
    os.chdir(ROOT)
    found = subprocess.run([bitstream.TOOLS, "-c", "import pyosys"], capture_output=True, check=False)
    if found.returncode != 0:
        print("netlist_sim: pyosys is not installed; run scripts/setup.sh --tools", file=sys.stderr)
        return 77
    good = True
    checks = []
    if arguments.what != "core":
        checks += [lambda pool, stage=stage: check_stage(stage, arguments, pool) for stage in arguments.stage or STAGES]
    if arguments.what != "stage":
        checks.append(lambda pool: check_core(arguments, pool))
    for number, check in enumerate(checks):
        core = arguments.what != "stage" and number == len(checks) - 1
        arguments.whole = not core
        arguments.split = 20000 if core else 100000
        for arguments.mutate in arguments.mutants:
            try:
                with ThreadPoolExecutor(arguments.jobs) as pool:
                    good &= check(pool)
            except (Failure, ValueError, subprocess.TimeoutExpired) as error:
                good = False
                print("netlist_sim: %s" % error, file=sys.stderr, flush=True)
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
