"""The HLS package as a user meets it: exported twice, unpacked into an empty folder, compiled and run there, and refusals.

usage: export_test.py GROUP --ap-types DIR [--vectors PROGRAM] [--thorough]
GROUP   package   same bytes every time, checksums, contents, refusals, nothing half done
        csim      C simulation with g++ and clang++; wrong data and a wrong kernel are noticed
        compile   every top alone, from any folder, as C++14 and C++17, as Bambu's and the vendor's front ends see it; another integer library
        scripts   hls_config*.cfg and the Tcl scripts, with stand-ins for the vendor's commands; register map
        subset    scripts/hls_subset.py over the exported sources
        vectors   the committed data are what vendor_vectors writes
csim runs every bench, several of them as one program; compile repeats what one compiler, standard and integer library has shown with the others only where it
can differ: all sources together instead of each alone. With --thorough (scripts/nightly) every bench in a program of its own, and every source again.
"""
import argparse
import glob
import hashlib
import os
import re
import shutil
import subprocess
import sys
import tempfile

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
sys.path.insert(0, os.path.join(ROOT, "scripts"))
from rtl_rooms import rtl_rooms  # noqa: E402
EXPORT = os.path.join(ROOT, "scripts", "export_hls.sh")
STUB = os.path.join(ROOT, "tests", "hls", "vendor_stub.tcl")
STAGES = ["ray_setup", "kd_descend", "leaf_exit", "kd_backtrack", "tri_test", "hit_finish", "instance_enter"]
TASKS = ["ray_reader", "ray_setup", "launch", "node_fetch", "step", "leaf_fetch", "leaf_exit", "list_fetch", "mailbox", "triangle_fetch", "tri_test", "result", "hit_finish",
         "hit_writer", "work_writer", "summary_writer"]
RING = ["hls/ring/%s.cpp" % task for task in TASKS + ["ring", "region"]]
STREAMING = ["generate", "setup", "traverse", "intersect", "finish", "shade", "trace"]
STAGE_SOURCES = ["hls/stages/%s.cpp" % stage for stage in STAGES]
SOURCES = STAGE_SOURCES + ["hls/top/pixels.cpp", "hls/top/trace.cpp"] + ["hls/streaming/%s.cpp" % kernel for kernel in STREAMING]
failures = []


def check(good, what, detail=""):
    print("%-72s %s" % (what, "ok" if good else "WRONG"), flush=True)
    if not good:
        failures.append(what)
        print(detail, flush=True)


def run(command, cwd, **environment):
    return subprocess.run(command, cwd=cwd, capture_output=True, text=True, timeout=900, env={**os.environ, **environment})


def text_of(result):
    return result.stdout + result.stderr


def export(folder, **environment):
    return run([EXPORT, "--output", folder], "/", **environment)


def read(path, mode="r"):
    with open(path, mode, encoding=None if "b" in mode else "utf-8") as file:
        return file.read()


def write(path, text):
    os.makedirs(os.path.dirname(path), exist_ok=True)
    with open(path, "w", encoding="utf-8") as file:
        file.write(text)


def unpacked(work):
    """The package out of its archive, in a folder that holds nothing else and is nowhere near the sources."""
    result = export(os.path.join(work, "export"))
    if result.returncode != 0:
        sys.exit(text_of(result))
    empty = os.path.join(work, "empty")
    os.mkdir(empty)
    subprocess.run(["tar", "xzf", os.path.join(work, "export", "retrace-hls.tar.gz")], cwd=empty, check=True)
    shutil.rmtree(os.path.join(work, "export"))
    return os.path.join(empty, "retrace-hls")


def files_below(folder):
    return sorted(os.path.relpath(os.path.join(where, name), folder) for where, _, names in os.walk(folder) for name in names)


# ------------------------------------------------------------------------------------------------ package
def package(work, _):
    first, second = os.path.join(work, "a"), os.path.join(work, "b")
    check(export(first).returncode == 0, "exports into a folder that does not exist")
    os.mkdir(second)
    old = os.umask(0o077)
    result = export(second, TZ="Asia/Tokyo", LC_ALL="C.UTF-8")
    os.umask(old)
    check(result.returncode == 0, "exports into an empty folder", text_of(result))
    same = read(os.path.join(first, "retrace-hls.tar.gz"), "rb") == read(os.path.join(second, "retrace-hls.tar.gz"), "rb")
    check(same, "the archive has the same bytes with another umask and time zone")
    result = run(["sha256sum", "--check", "--quiet", "SHA256SUMS"], first)
    check(result.returncode == 0, "checksums of the folder", text_of(result))
    shutil.rmtree(second)
    where = unpacked(work)
    result = run(["make", "check"], where)
    check(result.returncode == 0, "checksums of the unpacked archive", text_of(result))
    files = files_below(where)
    check(files == sorted(set(files_below(first)) - {"retrace-hls.tar.gz"}), "archive and folder hold the same files")
    listed = sorted(line[66:] for line in read(os.path.join(where, "SHA256SUMS")).splitlines())
    check(listed == sorted(set(files) - {"SHA256SUMS"}), "every file has a checksum")
    listing = read(os.path.join(where, "README.md"))
    wanted = SOURCES + RING + ["testbench/vendor/tb_%s.cpp" % top for top in STAGES + ["trace"] + ["stream_" + kernel for kernel in STREAMING]] + ["hls_config.cfg", "vitis_hls.tcl", "host/retrace_kernel.h", "LICENSE"]
    check(set(wanted) <= set(files), "kernels, testbenches, configurations, register map", str(set(wanted) - set(files)))
    simulation = [name for name in files if re.match(r"(ap_|hls_|ac_).*\.h$", os.path.basename(name))]
    check(simulation == ["testbench/csim/include/hls_stream.h", "testbench/csim/include/hls_tasks.h"], "no ap_types; the only stream headers are the testbench's", str(simulation))
    here = [path for path in (ROOT, os.path.expanduser("~"), work) if len(path) > 2]
    leaks = [name for name in files if any(path in read(os.path.join(where, name)) for path in here)]
    check(not leaks, "no path of this machine", str(leaks))
    outside = [(name, include) for name in files if name.endswith((".cpp", ".hpp", ".h")) for include in re.findall(r'#include "([^"]+)"', read(os.path.join(where, name)))
               if not os.path.isfile(os.path.join(where, os.path.dirname(name), include))]
    check(not outside, "every file that is included is in the package", str(outside))
    named = [path for path in re.findall(r"`((?:hls|testbench|host|constraints)/[\w/.-]+\.\w+)`", listing) if not os.path.exists(os.path.join(where, path.replace("TOP", "tri_test")))]
    check(not named, "the README names files that are there", str(named))

    print("refusals")
    result = export(first)
    check(result.returncode == 0, "an earlier package is replaced", text_of(result))
    write(os.path.join(first, "hls/stages/mine.cpp"), "int mine;\n")
    result = export(first)
    check(result.returncode != 0 and "hls/stages/mine.cpp" in result.stderr and os.path.exists(os.path.join(first, "hls/stages/mine.cpp")), "but not with a file of the user in it",
          text_of(result))
    os.remove(os.path.join(first, "hls/stages/mine.cpp"))
    with open(os.path.join(first, "hls/top/trace.cpp"), "a", encoding="utf-8") as file:
        file.write("// mine\n")
    result = export(first)
    check(result.returncode != 0 and "hls/top/trace.cpp" in result.stderr and read(os.path.join(first, "hls/top/trace.cpp")).endswith("// mine\n"), "nor with a changed file",
          text_of(result))
    foreign = os.path.join(work, "foreign")
    write(os.path.join(foreign, "letter.txt"), "dear\n")
    result = export(foreign)
    check(result.returncode != 0 and "letter.txt" in result.stderr and files_below(foreign) == ["letter.txt"], "a folder with other things", text_of(result))
    result = export(os.path.join(foreign, "letter.txt"))
    check(result.returncode != 0 and "letter.txt" in result.stderr, "a file", text_of(result))
    result = export(os.path.join(work, "no", "such"))
    check(result.returncode != 0 and os.path.join(work, "no") in result.stderr, "a folder whose parent is not there", text_of(result))
    for arguments in ([], ["--output"], ["--output", ""], ["--out", "x"]):
        result = run([EXPORT] + arguments, work)
        check(result.returncode == 2 and result.stderr, "arguments %s" % arguments, text_of(result))

    print("nothing half done")
    tools = os.path.join(work, "tools")
    before = {name: read(os.path.join(first, name), "rb") for name in files_below(first) if name != "hls/top/trace.cpp"}
    shutil.rmtree(first)
    check(export(first).returncode == 0, "exports again")
    for tool in ("tar", "gzip", "sha256sum", "cp"):
        write(os.path.join(tools, tool), "#!/bin/sh\nexit 3\n")
        os.chmod(os.path.join(tools, tool), 0o755)
        path = tools + ":" + os.environ["PATH"]
        new = os.path.join(work, "half")
        result = export(new, PATH=path)
        left = [name for name in os.listdir(work) if name.startswith(".retrace")]
        check(result.returncode != 0 and not os.path.exists(new) and not left, "where %s fails, nothing is left" % tool, text_of(result) + str(left))
        os.remove(os.path.join(tools, tool))
    write(os.path.join(tools, "mv"), '#!/bin/sh\ncase "$1" in */retrace-hls) exit 3 ;; esac\nexec /bin/mv "$@"\n')
    os.chmod(os.path.join(tools, "mv"), 0o755)
    result = export(first, PATH=tools + ":" + os.environ["PATH"])
    same = all(read(os.path.join(first, name), "rb") == content for name, content in before.items()) if os.path.isdir(first) else False
    check(result.returncode != 0 and same, "where the last step fails, the earlier package is still there", text_of(result))


# ------------------------------------------------------------------------------------------------ csim
def check_csim(where, make, each, what):
    """Every bench, in three programs; with `each` also every top in a program of its own."""
    streams = ["ring_" + task for task in TASKS]
    for target, ring, stages, streaming, tasks in (("csim", 3, len(STAGES), len(STREAMING), len(TASKS) + 2), ("csim-each", 0, len(STAGES), len(STREAMING), len(TASKS)))[:2 if each else 1]:
        result = run(make + ["-j2", target], where)
        text = result.stdout
        good = result.returncode == 0 and "WRONG" not in text and text.count("128 vectors, 0 differ") == stages and text.count(" 0 words differ") == streaming
        # Names in a run of all tasks: node_fetch and step stand in the ring twice.
        good = good and text.count(" words, 0 differ") == tasks and all(name in text for name in streams) and text.count(" ok\n") == 9 + ring
        check(good, "%s: make %s" % (what, target), text_of(result))


def csim(work, arguments):
    where = unpacked(work)
    make = ["make", "-s", "AP_TYPES=" + arguments.ap_types, "CXXFLAGS=-O0 -fno-strict-aliasing"]
    check_csim(where, make + ["CXX=g++"], arguments.thorough, "csim with g++")
    check_csim(where, make + ["CXX=clang++"], arguments.thorough, "csim with clang++")
    result = run(["make", "csim"], where, AP_TYPES="/nowhere")
    check(result.returncode != 0 and "ap_int.h" in result.stderr and "/nowhere" in result.stderr, "a missing ap_types folder is named", text_of(result))

    line = re.search(r"^    (g\+\+ -std=c\+\+17 .*)$", read(os.path.join(where, "README.md")), re.M).group(1)
    result = run(["sh", "-c", line.replace("FOLDER", arguments.ap_types)], where)
    check(result.returncode == 0 and "tri_test     128 vectors, 0 differ" in result.stdout, "the README's plain line", text_of(result))
    os.remove(os.path.join(where, "a.out"))

    # The host example, with a stand-in for XRT.
    stand_in = ["g++", "-std=c++17", "-O0", "-fno-strict-aliasing", "-I", os.path.join(ROOT, "tests/hls/xrt"), "-I", where, "-I", arguments.ap_types, "hls/top/trace.cpp", "-o", "xrt"]
    result = run(stand_in + ["host/retrace_xrt.cpp"], where)
    check(result.returncode == 0, "the host example compiles with a stand-in for XRT", text_of(result))
    result = run(["./xrt", "Makefile"], where)
    check(result.returncode == 0 and "96 rays, 0 hits differ" in result.stdout, "and gets the hits", text_of(result))
    for words, complaint in ((["nowhere.xclbin"], "nowhere.xclbin"), (["Makefile", "7"], "device"), ([], "usage")):
        result = run(["./xrt"] + words, where)
        check(result.returncode != 0 and complaint in result.stderr, "it says what is wrong: %s" % words, text_of(result))
    forgetful = read(os.path.join(where, "host/retrace_xrt.cpp")).replace("memory.sync(XCL_BO_SYNC_BO_TO_DEVICE);", "")
    write(os.path.join(where, "host/forgetful.cpp"), forgetful)
    result = run(stand_in + ["host/forgetful.cpp"], where)
    result = run(["./xrt", "Makefile"], where)
    check(result.returncode != 0, "the stand-in notices a transfer that is left out", text_of(result))
    for name in ("xrt", "host/forgetful.cpp"):
        os.remove(os.path.join(where, name))

    def spoilt(what, path, old, new, target, complaint):
        text = read(os.path.join(where, path))
        spoiled = re.sub(old, new, text, count=1)
        assert spoiled != text, path
        write(os.path.join(where, path), spoiled)
        result = run(make + [target], where)
        check(result.returncode != 0 and complaint in result.stdout, "noticed: %s in %s" % (what, path), text_of(result))
        write(os.path.join(where, path), text)

    spoilt("a bit of an output", "testbench/vendor/data/kd_backtrack.inc", r"(0x[0-9a-f]{15})([0-9a-f])\},\n\{", lambda m: m.group(1) + "%x" % (int(m.group(2), 16) ^ 1) + "},\n{", "csim-kd_backtrack",
           "kd_backtrack: vector 0 differs")
    spoilt("a bit of a hit", "testbench/vendor/data/hits.inc", r"(0x[0-9a-f]{15})([0-9a-f]),\n", lambda m: m.group(1) + "%x" % (int(m.group(2), 16) ^ 8) + ",\n", "csim-trace", "ray 0 differs")
    spoilt("<= for <", "hls/stages/kd_descend.hpp", r"in\.t < plane", "in.t <= plane", "csim-kd_descend", "kd_descend: vector")
    spoilt("a bit of a token", "testbench/vendor/data/ring_stepped.inc", r"\{(0x[0-9a-f]{15})([0-9a-f]),", lambda m: "{" + m.group(1) + "%x" % (int(m.group(2), 16) ^ 1) + ",", "csim-ring_step",
           "ring_step: a word of stepped differs")
    spoilt("a walk that goes on behind its hit", "hls/streaming/steps.hpp", r"last \|\| state\.t <= nearest", "last", "csim-stream_traverse", "stream_traverse: record")
    result = run(["make", "check"], where)
    check(result.returncode == 0, "checksums still verify with the build folder there", text_of(result))


# ------------------------------------------------------------------------------------------------ compile
def compile_(work, arguments):
    where = unpacked(work)
    elsewhere = os.path.join(work, "elsewhere")
    os.mkdir(elsewhere)
    together = os.path.join(work, "all.cpp")
    write(together, "".join('#include "%s"\n' % os.path.join(where, source) for source in SOURCES + RING))
    alone = [os.path.join(where, source) for source in SOURCES + RING]

    def compiles(flags, files, what):
        results = [run(flags + ["-fsyntax-only", file], elsewhere) for file in files]
        bad = "".join(text_of(result) for result in results if result.returncode)
        check(not bad, "%s, %s, %s" % ("every top alone, from another folder" if files is alone else "all tops together", what, " ".join(flags[:2])), bad)

    for compiler, standard in (("g++", "c++17"), ("clang++", "c++17"), ("clang++", "c++14")):
        compiles([compiler, "-std=" + standard, "-I", arguments.ap_types, "-I", os.path.join(where, "testbench/csim/include")], [together], "on ap_types")
        if arguments.thorough:
            compiles([compiler, "-std=" + standard, "-I", arguments.ap_types], alone, "on ap_types")

    # Stream headers: what a front end finds. Words of ap_types do not matter here, so theirs is empty.
    vendor = os.path.join(work, "vendor")
    write(os.path.join(vendor, "ap_int.h"), "")
    types_only = os.path.join(work, "types")
    write(os.path.join(types_only, "ap_int.h"), "")
    write(os.path.join(vendor, "hls_stream.h"), "")
    for name, flags in (("C simulation", []), ("the vendor's compiler", ["-D__SYNTHESIS__"]), ("Bambu", ["-D__BAMBU__"])):
        used = [run(["clang++", "-std=c++17", "-M", "-I", vendor] + flags + [os.path.join(where, source)], elsewhere).stdout for source in STAGE_SOURCES]
        check(all(os.path.join(vendor, "hls_stream.h") in text and "testbench" not in text for text in used), "%s takes the stream header of its include path" % name, str(used))
    for name, flag in (("the vendor's compiler", "-D__SYNTHESIS__"), ("Bambu", "-D__BAMBU__")):
        result = run(["clang++", "-std=c++17", "-M", "-I", types_only, flag, os.path.join(where, SOURCES[0])], elsewhere)
        check(result.returncode != 0 and "hls_stream.h" in result.stderr, "%s never takes the testbench's" % name, text_of(result))

    # Directives as each front end sees them.
    def directives(flag):
        text = run(["clang++", "-std=c++17", "-E", "-P", "-I", vendor, flag, os.path.join(where, "hls/top/trace.cpp")], elsewhere).stdout
        return re.findall(r"^#pragma HLS (.*)$", text, re.M)

    # The interfaces of the stages stand in the source as they are, also for Bambu.
    literal = [re.findall(r"^#pragma HLS (.*)$", read(os.path.join(where, source)), re.M) for source in STAGE_SOURCES]
    check(all(lines == ["interface mode=axis port=in", "interface mode=axis port=out"] for lines in literal), "the stages' interfaces are literal directives", str(literal))
    # Tasks of the ring have one master at most, kernels of the streaming machine one for each kind of read.
    tops = [("hls/ring/%s.cpp" % task, "ring_" + task, 1) for task in TASKS] + [("hls/streaming/%s.cpp" % kernel, "stream_" + kernel, 5) for kernel in STREAMING]
    for path, top, most in tops:
        arguments_of = re.search(r'extern "C" void %s\((.*?)\) \{' % top, read(os.path.join(where, path)), re.S).group(1)
        streams, pointers = re.findall(r"hls::stream<[\w:]+>& (\w+)", arguments_of), re.findall(r"\* ?(\w+)", arguments_of)
        seen = re.findall(r"^#pragma HLS (.*)$", run(["clang++", "-std=c++17", "-E", "-P", "-I", vendor, "-D__BAMBU__", os.path.join(where, path)], elsewhere).stdout, re.M)
        expected = ["interface mode=axis port=" + name for name in streams] + ["interface mode=m_axi port=%s offset=direct bundle=bus_%s" % (name, name) for name in pointers]
        if seen != expected or len(pointers) > most:
            check(False, "%s: Bambu sees its ports" % top, "%s\n%s" % (seen, expected))
    masters = "pairs leaves list triangles rays hits work summary".split()
    bambu, synthesis = directives("-D__BAMBU__"), directives("-D__SYNTHESIS__")
    check(bambu == ["interface mode=m_axi port=%s offset=direct bundle=bus_%s" % (port, port) for port in masters], "Bambu sees the masters, offset=direct, and nothing else", str(bambu))
    slaves = [re.search(r"port=(\w+)", line).group(1) for line in synthesis if "mode=s_axilite" in line and "bundle=control" in line]
    depths = [line for line in synthesis if "mode=m_axi" in line and re.search(r"offset=slave .*depth=\d+$", line)]
    check(slaves == masters + ["image_lines", "ray_count", "options", "return"] and len(depths) == len(masters), "the vendor's compiler sees masters with depths and one slave", str(synthesis))

    # An ap_int.h on another integer library (Bambu's is made in this way): the same bits.
    other = os.path.join(os.path.dirname(arguments.ap_types.rstrip("/")), "ac_types")
    if not os.path.isfile(os.path.join(other, "ac_int.h")):
        print("no %s/ac_int.h: csim with ac_types is skipped (scripts/setup.sh fetches it)" % other)
        if not arguments.thorough:
            compiles(["clang++", "-std=c++14", "-I", arguments.ap_types], alone, "on ap_types")
        return
    shim = os.path.join(work, "shim")
    write(os.path.join(shim, "ap_int.h"), '#pragma once\n#include "%s/ac_int.h"\ntemplate <int kBits>\nusing ap_int = ac_int<kBits, true>;\ntemplate <int kBits>\n'
          "using ap_uint = ac_int<kBits, false>;\n" % os.path.abspath(other))
    for standard in ("c++14", "c++17"):
        # Its header takes a third of the time to read: here every source shows that it includes what it uses.
        compiles(["clang++", "-std=" + standard, "-D__BAMBU__", "-I", shim, "-I", os.path.join(where, "testbench/csim/include")],
                 alone if standard == "c++14" or arguments.thorough else [together], "as Bambu's front end reads it, on ac_types")
    make = ["make", "-s", "CXX=clang++", "CXXFLAGS=-O0", "AP_TYPES=" + shim]
    check_csim(where, make, arguments.thorough, "csim on ac_types: the same bits")


# ------------------------------------------------------------------------------------------------ scripts
KEYS = {"part", "flow_target", "clock", "clock_uncertainty", "syn.top", "syn.file", "syn.cflags", "syn.interface.m_axi_addr64", "tb.file", "tb.cflags", "csim.clean", "cosim.rtl",
        "package.output.format", "package.output.syn", "package.ip.vendor", "package.ip.library", "package.ip.name", "package.ip.version", "package.ip.display_name"}


def check_config(where, path):
    section, values, wrong = "", {}, []
    for line in read(path).splitlines():
        if not line or line.startswith("#"):
            continue
        if line.startswith("["):
            section = line
            continue
        key, _, value = line.partition("=")
        if key not in KEYS or not value or key in values or (key == "part") != (section == "") or section not in ("", "[hls]"):
            wrong.append(line)
        values[key] = value
    for key in ("syn.file", "tb.file"):
        if not os.path.isfile(os.path.join(where, values[key])):
            wrong.append("%s=%s is not there" % (key, values[key]))
    if not re.search(r'^extern "C" void %s\(' % values["syn.top"], read(os.path.join(where, values["syn.file"])), re.M):
        wrong.append("%s does not define %s" % (values["syn.file"], values["syn.top"]))
    if values["syn.top"] + "(" not in read(os.path.join(where, values["tb.file"])):
        wrong.append("%s does not call %s" % (values["tb.file"], values["syn.top"]))
    if (values["package.output.format"], values["flow_target"]) not in (("ip_catalog", "vivado"), ("xo", "vitis")):
        wrong.append("flow and format do not belong together")
    check(not wrong, os.path.basename(path), "\n".join(wrong))


def calls(result):
    """Commands of the vendor's tool that a script has called, as lists of words."""
    found = []
    for line in result.stdout.splitlines():
        if line.startswith("CALL "):
            words = re.findall(r"\{([^{}]*)\}|(\S+)", line[5:])
            found.append([a or b for a, b in words])
    return found


def argument_order(where):
    prototype = re.search(r'extern "C" void retrace_trace\((.*?)\);', read(os.path.join(where, "hls/top/trace.hpp")), re.S).group(1)
    return [(re.search(r"(\w+)$", part.strip()).group(1), "*" in part) for part in prototype.split(",")]


def registers(where):
    """Offsets by the vendor's rule: 0x10, then the value in whole 32-bit words and one reserved word an argument."""
    offset, result = 0x10, {}
    for name, pointer in argument_order(where):
        result[name] = offset
        offset += 12 if pointer else 8
    return result


def scripts(work, _):
    where = unpacked(work)
    configs = sorted(glob.glob(os.path.join(where, "hls_config*.cfg")))
    check(len(configs) == 2 + len(STAGES), "%d configurations" % len(configs))
    for path in configs:
        check_config(where, path)

    for top in STAGES + ["trace", "trace_xo"]:
        lines = "".join(run(["make", "-n", "vitis-%s-%s" % (step, top)], where).stdout for step in ("csim", "csynth", "cosim", "package"))
        used = re.findall(r"--config (\S+)", lines)
        check(len(used) == 6 and all(os.path.join(where, name) in configs for name in used), "make vitis-STEP-%s" % top, lines)
    kernels = ["stream_" + kernel for kernel in STREAMING]
    for top in STAGES + ["trace"] + kernels:
        line = run(["make", "-s", "bambu-" + top, "BAMBU=echo"], where).stdout
        paths = re.findall(r"(?:^|=)(\S+\.cpp)", line)
        function = (re.findall(r"--top-fname=(\w+)", line) or ["?"])[0]
        there = [os.path.join(where, "build/bambu_" + top, path) for path in paths]
        good = len(there) == 2 and all(os.path.isfile(path) for path in there) and re.search(r'^extern "C" void %s\(' % function, read(there[0]), re.M)
        check(bool(good), "make bambu-%s" % top, line)

    every = run(["make", "-s", "bambu", "BAMBU=echo"], where).stdout
    check(re.findall(r"--top-fname=(\w+)", every) == [stage + "_top" for stage in STAGES] + ["retrace_trace"] + kernels, "make bambu: every top", every)
    every = run(["make", "-s", "bambu-ring", "BAMBU=echo"], where).stdout
    check(re.findall(r"(\S+\.cpp) --top-fname=(\w+)", every) == [("../../hls/ring/%s.cpp" % task, "ring_" + task) for task in TASKS], "make bambu-ring: every task", every)
    benches = [os.path.join(where, "build/bambu_ring_" + task, "tb.cpp") for task in TASKS]
    check(all("RETRACE_RING_TASK %s\n" % task in read(path) for task, path in zip(TASKS, benches)) and every.count("--generate-tb=tb.cpp") == len(TASKS), "with a bench each", every)

    host = {name.lower(): int(value, 16) for name, value in re.findall(r"^#define RETRACE_KERNEL_(\w+) (0x[0-9a-f]+)", read(os.path.join(where, "host/retrace_kernel.h")), re.M)}
    rule = registers(where)
    check(all(host.get(name) == offset for name, offset in rule.items()), "host/retrace_kernel.h follows from the kernel's arguments", "%s\n%s" % (host, rule))
    write(os.path.join(work, "host.c"), '#include "host/retrace_kernel.h"\nint main(void) { return RETRACE_KERNEL_CTRL; }\n')
    result = run(["g++", "-x", "c", "-std=c99", "-Wall", "-pedantic", "-Werror", "-fsyntax-only", "-I", where, os.path.join(work, "host.c")], work)
    check(result.returncode == 0, "host/retrace_kernel.h is C", text_of(result))

    if not shutil.which("tclsh"):
        sys.exit("tclsh is not installed; scripts/setup.sh installs it")
    script = os.path.join(where, "vitis_hls.tcl")

    def vitis(expect=0, **environment):
        result = run(["tclsh", STUB, script], work, **environment)
        if (result.returncode == 0) != (expect == 0):
            check(False, "vitis_hls.tcl %s" % environment, text_of(result))
        return result

    header = os.path.join(work, "hw.h")
    write(header, "".join("#define XRETRACE_TRACE_CONTROL_ADDR_%s_DATA 0x%02x\n" % (name.upper() + ("_r" if name == "list" else "").upper(), offset) for name, offset in rule.items()))
    for top in ["trace"] + STAGES:
        for target, steps in (("zynq", "csim csynth cosim ip"), ("alveo", "csynth xo")):
            result = vitis(RETRACE_TOP=top, RETRACE_TARGET=target, RETRACE_STEPS=steps, STUB_HW_H=header, STUB_PROJECT="%s_%s" % (top, target))
            called = calls(result)
            names = [call[0] for call in called]
            added = [word for call in called if call[0] == "add_files" for word in call[1:] if word.endswith(".cpp")]
            function = next((call[1] for call in called if call[0] == "set_top"), "")
            good = len(added) == 2 and all(os.path.isfile(path) for path in added) and re.search(r'extern "C" void %s\(' % function, read(added[0]))
            order = [name for name in names if name in ("csim_design", "csynth_design", "cosim_design", "export_design")]
            wanted = {"csim": "csim_design", "csynth": "csynth_design", "cosim": "cosim_design", "ip": "export_design", "xo": "export_design"}
            good = good and order == [wanted[step] for step in steps.split()]
            good = good and ("vitis" if "xo" in steps else "vivado") in next(call for call in called if call[0] == "open_solution")
            good = good and (top != "trace" or "the registers are where" in result.stdout)
            check(bool(good), "vitis_hls.tcl: %s on %s, %s" % (top, target, steps), text_of(result))
    result = vitis(expect=1, RETRACE_TOP="sphere")
    check("RETRACE_TOP is 'sphere'" in result.stderr, "vitis_hls.tcl names a wrong top", text_of(result))
    result = vitis(expect=1, RETRACE_STEPS="csim burn")
    check("'burn'" in result.stderr, "vitis_hls.tcl names a wrong step", text_of(result))
    moved = os.path.join(work, "moved.h")
    write(moved, read(header).replace("RAYS_DATA 0x40", "RAYS_DATA 0x44"))
    result = vitis(expect=1, STUB_HW_H=moved, STUB_PROJECT="trace_zynq")
    check("register of 'rays' is at 0x44" in result.stderr, "vitis_hls.tcl stops where the registers are not those of the host's header", text_of(result))

    verilog = os.path.join(work, "verilog")
    write(os.path.join(verilog, "retrace_trace.v"), "")
    for part in ("zynq-xczu3eg", "alveo-xcu50"):
        arguments = ["retrace_trace", os.path.join(where, "constraints", part + ".xdc"), verilog]
        result = run(["tclsh", STUB, os.path.join(where, "vivado_ooc.tcl")] + arguments, work)
        made = next((call for call in calls(result) if call[0] == "create_project"), [])
        check(result.returncode == 0 and part.split("-")[1] in " ".join(made), "vivado_ooc.tcl on " + part, text_of(result))
        result = run(["tclsh", STUB, os.path.join(where, "vivado_ooc.tcl")] + arguments, work, STUB_SLACK="-0.003")
        check(result.returncode != 0 and "timing is not met" in result.stderr, "vivado_ooc.tcl fails on negative slack", text_of(result))
    result = run(["tclsh", STUB, os.path.join(where, "vivado_ooc.tcl"), "x", os.path.join(where, "constraints/zynq-xczu3eg.xdc"), os.path.join(work, "none")], work)
    check(result.returncode != 0 and "no Verilog in" in result.stderr, "vivado_ooc.tcl names a folder without Verilog", text_of(result))

    # The core: as an IP, and placed by itself. Packages are read before those who use them, and the tools see the files that FuseSoC lists.
    # The board around the core is a file set of its own, which the IP does not take.
    listed = [path for path in re.findall(r"^      - (rtl/\S+\.s?v)$", read(os.path.join(ROOT, "retrace.core")), re.M) if not path.startswith("rtl/board/")]
    folders = [os.path.join(ROOT, "rtl", name) for name in rtl_rooms("board")]
    ip = os.path.join(work, "ip")
    for name, result in (("vivado_ip.tcl", run(["tclsh", STUB, os.path.join(ROOT, "scripts/vivado_ip.tcl"), ip, "ConfigWide"], work)),
                         ("vivado_ooc.tcl on rt_axi",
                          run(["tclsh", STUB, os.path.join(ROOT, "scripts/export/vivado_ooc.tcl"), "rt_axi", os.path.join(ROOT, "constraints/zynq-xczu3eg.xdc")] + folders, work))):
        files = [os.path.relpath(word, ROOT) for call in calls(result) if call[0] == "read_verilog" for word in " ".join(call[1:]).split() if word != "-sv"]
        packages = [path for path in files if path.endswith("_pkg.sv")]
        position = {re.search(r"(\w+)\.sv$", path).group(1): i for i, path in enumerate(packages)}
        late = [(path, used) for path in packages for used in re.findall(r"\b(rt_\w+_pkg)::", read(os.path.join(ROOT, path)))
                if used != os.path.basename(path)[:-3] and position[used] > position[os.path.basename(path)[:-3]]]
        good = result.returncode == 0 and sorted(files) == sorted(listed) and files[:len(packages)] == packages and not late
        check(good, name + " reads the files of retrace.core, packages first", "%s\nonly here: %s\nonly in retrace.core: %s\n%s"
              % (late, sorted(set(files) - set(listed)), sorted(set(listed) - set(files)), text_of(result)))
        if name == "vivado_ip.tcl":
            check("`define RT_CONFIG ConfigWide" in read(os.path.join(ip, "retrace_config.vh")), "vivado_ip.tcl: the configuration travels with the IP")
            widths = {call[2] for call in calls(result) if call[:2] == ["set_property", "value"]}
            check(widths == {"128"}, "vivado_ip.tcl: the wrapper's bus has the configuration's width", str(widths))
    result = run(["tclsh", STUB, os.path.join(ROOT, "scripts/vivado_ip.tcl")], work, STUB_OPEN_PROJECT="1")
    called = calls(result)
    includes = [call[2] for call in called if call[:2] == ["set_property", "include_dirs"]]
    check(result.returncode == 0 and not any(call[0] in ("create_project", "read_verilog") for call in called) and len(includes) == 1
          and os.path.isfile(os.path.join(includes[0], "rt_assert.svh")), "vivado_ip.tcl in FuseSoC's project: its files, and the include folder", text_of(result))
    result = run(["tclsh", STUB, os.path.join(ROOT, "scripts/vivado_ip.tcl"), ip, "ConfigHuge"], work)
    check(result.returncode != 0 and "ConfigHuge" in result.stderr, "vivado_ip.tcl names a wrong configuration", text_of(result))
    stated = dict(re.findall(r"config_t (Config\w+) = '\{.*?data_bits: *(\d+)", read(os.path.join(ROOT, "rtl/pkg/rt_config_pkg.sv")), re.S))
    taken = {}
    for name in stated:
        result = run(["tclsh", STUB, os.path.join(ROOT, "scripts/vivado_ip.tcl"), ip, name], work)
        taken[name] = next((call[2] for call in calls(result) if call[:2] == ["set_property", "value"]), text_of(result))
    check(stated == taken and stated, "vivado_ip.tcl knows the configurations of rt_config_pkg", "%s %s" % (stated, taken))


# ------------------------------------------------------------------------------------------------ subset, vectors
def subset(work, arguments):
    where = unpacked(work)
    command = [sys.executable, os.path.join(ROOT, "scripts/hls_subset.py"), "--ap-types", arguments.ap_types]
    result = run(command + [os.path.join(where, "hls")], work)
    check(result.returncode == 0 and "%d sources" % len(SOURCES + RING) in result.stdout, "the exported sources are in the subset", text_of(result))
    path = os.path.join(where, "hls/stages/tri_test.hpp")
    write(path, read(path).replace("namespace retrace::hls {\n", "namespace retrace::hls {\ninline int never(double x) { return never(x); }\n", 1))
    result = run(command + [os.path.join(where, "hls")], work)
    check(result.returncode == 1 and "recursion" in result.stdout and "float" in result.stdout, "and the check bites there", text_of(result))


def vectors(work, arguments):
    subprocess.run([arguments.vectors, work], check=True)
    committed = os.path.join(ROOT, "testbench/vendor/data")
    digest = lambda folder: {name: hashlib.sha256(read(os.path.join(folder, name), "rb")).hexdigest() for name in files_below(folder)}
    check(digest(work) == digest(committed), "testbench/vendor/data is what vendor_vectors writes", "write it with: vendor_vectors testbench/vendor/data")


def main():
    groups = {"package": package, "csim": csim, "compile": compile_, "scripts": scripts, "subset": subset, "vectors": vectors}
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("group", choices=groups)
    parser.add_argument("--ap-types", default=os.path.join(ROOT, ".env", "ap_types"))
    parser.add_argument("--vectors")
    parser.add_argument("--thorough", action="store_true")
    arguments = parser.parse_args()
    arguments.ap_types = os.path.abspath(arguments.ap_types)
    with tempfile.TemporaryDirectory(prefix="retrace-export-") as work:
        groups[arguments.group](work, arguments)
    sys.exit("%d checks failed: %s" % (len(failures), "; ".join(failures)) if failures else 0)


if __name__ == "__main__":
    main()
