#!/usr/bin/env python3
"""Run gappa on the proof scripts and keep what is quoted from them in step.

usage: certify.py [--write | --self-test] [--gappa PROGRAM]

Without an option: every script in tests/proof must be proven by gappa without a warning; the assumptions of each must
be what another script proves or what scripts/contract/contract.toml says; the generated block of docs/error-bounds.md
and golden/contract/certified_bounds.hpp must be up to date. Exit code 1 otherwise.
--write brings the two generated places up to date (and proves everything first). --self-test damages copies of the
scripts one by one and fails unless each damage is noticed. Standard library only.

Annotations in the scripts, each about the number on its own line:
  #: proves NAME      a goal; NAME is what it is quoted as
  #: uses NAME        an assumption; at least the bound that the script of NAME proves
  #: contract NAME    a constant of the contract
  #: format TYPE      a rounding operator: fraction bits and direction of TYPE
  #: half_ulp TYPE    2^-(fraction bits + 1) and 2^-47 for what a host in double precision adds
  #: max TYPE         the largest code of TYPE
  #: lsb TYPE         minus the fraction bits of TYPE
  #: row NAME | TEXT  a line of the table in the documentation
"""
import argparse
import math
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import textwrap
import tomllib
from concurrent.futures import ThreadPoolExecutor
from fractions import Fraction

ROOT = pathlib.Path(__file__).resolve().parents[2]
SCRIPTS = ROOT / "tests/proof"
HEADER = ROOT / "golden/contract/certified_bounds.hpp"
DOC = ROOT / "docs/error-bounds.md"
CONTRACT = ROOT / "scripts/contract/contract.toml"
BEGIN, END = "<!-- certified: begin -->", "<!-- certified: end -->"
HOST_SLACK = Fraction(1, 1 << 47)
# Tolerance of the contract, what it is compared with, where it is used. It must exceed the bound.
TOLERANCES = [("eps_uv", "edge_uv", "lower ends of U and V"), ("eps_uv", "edge_top", "upper ends of U and V"),
              ("eps_w", "edge_w", "W"), ("widen", "t_plane_position", "cells of a triangle"),
              ("slab_pad", "instance_early", "slabs of an object's box")]
ORDER = ["t_plane", "row_origin", "row_direction", "edge_uv", "edge_top", "edge_w", "false_uv", "false_top", "false_w",
         "false_reach", "depth_exact", "depth_computed", "barycentric", "instance_direction", "instance_length",
         "instance_origin", "instance_ray", "instance_slab", "instance_inside", "instance_depth", "instance_row"]  # of the table in the documentation
SECONDS = 60  # for one script; the slowest takes about two
DIRECTIONS = {"nearest, ties up": "nu", "toward minus infinity": "dn", "toward zero": "zr"}
NUMBER = re.compile(r"(?<![\w.])-?\d+(?:b-?\d+|\.\d+)?(?![\w.])")


class Problem(Exception):
    pass


def value(text):
    mantissa, _, exponent = text.partition("b")
    return Fraction(mantissa) * Fraction(2) ** int(exponent or 0)


class Script:
    """The annotations of one script."""

    def __init__(self, path):
        self.path, self.notes, self.rows = path, [], []
        for number, line in enumerate(path.read_text().splitlines(), 1):
            code, mark, notes = line.partition("#:")
            if not mark:
                continue
            if not code.strip():
                kind, name, text = re.fullmatch(r" (row) (\w+) \| (.+)", notes).groups()
                self.rows.append((name, text))
                continue
            for note in notes.split(";"):
                kind, name = note.split()
                self.notes.append((kind, name, code, number))

    def last(self, code):
        return NUMBER.findall(code)[-1]


def scripts(folder):
    rank = {name: i for i, name in enumerate(ORDER)}
    paths = sorted(folder.glob("*.g"), key=lambda path: (rank.get(path.stem, len(ORDER)), path.stem))
    return [Script(path) for path in paths]


def run_gappa(gappa, script):
    try:
        run = subprocess.run([gappa, str(script.path)], capture_output=True, text=True, timeout=SECONDS)
    except subprocess.TimeoutExpired:
        return f"{script.path.name}: not proven within {SECONDS} s"
    output = (run.stdout + run.stderr).strip()
    if run.returncode != 0 or output:
        return f"{script.path.name}: gappa says:\n{output[:2000]}"
    return None


def proven_bounds(all_scripts):
    """Name -> (magnitude of the bound, script). The goals of scripts that gappa has accepted."""
    proven = {}
    for script in all_scripts:
        goals = [note for note in script.notes if note[0] == "proves"]
        if not goals:
            raise Problem(f"{script.path.name}: proves nothing")
        for _, name, code, number in goals:
            if name in proven:
                raise Problem(f"{script.path.name}:{number}: {name} is proven twice")
            interval = re.search(r"in \[(-?\w+), (-?\w+)\]", code)
            bounds = [abs(value(x)) for x in interval.groups()] if interval else [abs(value(script.last(code)))]
            proven[name] = (max(bounds), script.path.name)
        for name, _ in script.rows:
            if name not in proven:
                raise Problem(f"{script.path.name}: row {name}: not a goal")
    return proven


def check_assumptions(all_scripts, proven, contract):
    """Every annotated number is what the annotation says."""
    types = contract["type"]
    needs = {}
    for script in all_scripts:
        for kind, name, code, number in script.notes:
            where = f"{script.path.name}:{number}: {kind} {name}"
            if kind == "proves":
                continue
            if kind == "uses":
                if name not in proven:
                    raise Problem(f"{where}: nobody proves it")
                bound = re.search(r"in \[(-?\w+), ", code)
                assumed = abs(value(bound.group(1) if bound else script.last(code)))
                if assumed < proven[name][0]:
                    raise Problem(f"{where}: assumes less than is proven")
                needs.setdefault(script.path.name, set()).add(proven[name][1])
            elif kind == "contract":
                const = contract["const"][name]
                wanted = Fraction(const["value"], 1 << types[const["type"]]["frac_bits"])
                if wanted not in [abs(value(x)) for x in NUMBER.findall(code)]:
                    raise Problem(f"{where}: the contract says {float(wanted)}")
            elif kind == "format":
                rounding = re.split(r" \(", types[name]["round"])[0]
                if f"fixed<-{types[name]['frac_bits']},{DIRECTIONS[rounding]}>" not in code:
                    raise Problem(f"{where}: the contract says {types[name]['frac_bits']} bits, {rounding}")
            elif kind == "half_ulp":
                if value(script.last(code)) != Fraction(1, 1 << types[name]["frac_bits"] + 1) + HOST_SLACK:
                    raise Problem(f"{where}: not half a unit")
            elif kind == "max":
                bits = types[name]["int_bits"] + types[name]["frac_bits"]
                if value(script.last(code.split("]")[0])) != (1 << bits - 1) - 1:
                    raise Problem(f"{where}: not the largest code")
            elif kind == "lsb":
                if value(script.last(code)) != -types[name]["frac_bits"]:
                    raise Problem(f"{where}: not the last bit")
            else:
                raise Problem(f"{where}: unknown annotation")
    done = set()
    while len(done) < len(all_scripts):  # assumptions must not go round in a circle
        ready = {s.path.name for s in all_scripts if needs.get(s.path.name, set()) <= done} - done
        if not ready:
            raise Problem("the scripts assume each other in a circle")
        done |= ready


def power(bound):
    return f"2^{math.log2(bound):.2f}"


def code_of(bound, frac_bits):
    return math.ceil(bound * (1 << frac_bits))


def emit_block(all_scripts, proven, contract):
    lines = [BEGIN, "<!-- Generated by scripts/proof/certify.py --write from tests/proof/*.g. Do not edit. -->", "",
             "| quantity | certified bound | in units of 2^-27 | about | script |", "| --- | --- | --- | --- | --- |"]
    for script in all_scripts:
        for name, text in script.rows:
            bound = proven[name][0]
            scale = max(35, bound.denominator.bit_length() - 1)  # the scripts count in 2^-35
            exact = f"{bound * (1 << scale)} * 2^-{scale}"
            lines.append(f"| {text} | {exact} | {float(bound * (1 << 27)):.2f} | {power(bound)} | "
                         f"[{script.path.name}](../tests/proof/{script.path.name}) |")
    lines += ["", "| tolerance | of | code | certified error, code | tolerance / error |",
              "| --- | --- | --- | --- | --- |"]
    for const, name, where in TOLERANCES:
        body = contract["const"][const]
        code = code_of(proven[name][0], contract["type"][body["type"]]["frac_bits"])
        lines.append(f"| `{const}` | {where} | {body['value']} | {code} | {body['value'] / code:.3f} |")
    return "\n".join(lines + ["", END])


def camel(name):
    return "".join(part.capitalize() for part in name.split("_"))


def emit_header(all_scripts, proven):
    out = ["// Generated by scripts/proof/certify.py --write from tests/proof/*.g. Do not edit.",
           "// Bounds that gappa has certified, in units of the scene box [-1, 1]; docs/error-bounds.md says what of.",
           "#pragma once", "",
           "namespace retrace::certified {", ""]
    for script in all_scripts:
        for name, text in script.rows:
            out += textwrap.wrap(text, 112, initial_indent="/// ", subsequent_indent="/// ")
            out.append(f"inline constexpr double k{camel(name)} = {float(proven[name][0]).hex()};")
    return "\n".join(out + ["", "}  // namespace retrace::certified", ""])


def certify(folder, contract, gappa):
    """All proofs and cross checks of one folder. Returns the scripts and what they prove; raises Problem."""
    all_scripts = scripts(folder)
    if not all_scripts:
        raise Problem(f"{folder}: no scripts")
    with ThreadPoolExecutor(2) as pool:
        failures = [text for text in pool.map(lambda s: run_gappa(gappa, s), all_scripts) if text]
    if failures:
        raise Problem("\n".join(failures))
    proven = proven_bounds(all_scripts)
    check_assumptions(all_scripts, proven, contract)
    return all_scripts, proven


# Script, text in it, damaged text. Each must make certify() fail, and for a different reason.
DAMAGES = [
    ("edge_uv.g", "<= 6013b-35", "<= 6000b-35"),        # the goal is false
    ("edge_top.g", "<= 6013b-35", "<= 6000b-35"),
    ("edge_top.g", "p in [0, 2]", "p in [0, 4]"),       # eu below -1
    ("edge_w.g", "<= 12026b-35", "<= 12020b-35"),
    ("edge_w.g", "fixed<-50,dn>", "fixed<-30,dn>"),     # another datapath
    ("row_origin.g", "fixed<-24,nu>", "fixed<-24,dn>"),  # another rounding
    ("row_direction.g", "fixed<-26,nu>", "fixed<-25,nu>"),
    ("false_top.g", "<= 25890b-35", "<= 25800b-35"),
    ("false_top.g", "code in [-32, 1b-22]", "code in [-32, 1b-23]"),
    ("false_w.g", "<= 50296b-35", "<= 49000b-35"),
    ("false_reach.g", "|top| <= 25890b-35", "|top| <= 25880b-35"),
    ("depth_exact.g", "<= 4251b-35", "<= 4200b-35"),
    ("t_plane.g", "<= 1b-23", "<= 4b-26"),
    ("t_plane.g", "r in [-1, 0]", "r in [-0.5, 0]"),    # assumes more than is proven
    ("edge_uv.g", "Ed = 700b-35", "Ed = 699b-35"),
    ("false_uv.g", "code in [-1b-22", "code in [-1b-23"),  # not the contract's eps
    ("instance_direction.g", "<= 16777217b-51", "<= 16777215b-51"),
    ("instance_direction.g", "fixed<-26,nu>", "fixed<-26,dn>"),
    ("instance_length.g", "N in [1,", "N in [0.99,"),
    ("instance_origin.g", "<= 129b-32", "<= 128b-32"),
    ("instance_origin.g", "t in [0, 1b19]", "t in [0, 1b20]"),
    ("instance_slab.g", "pad = 8b-24", "pad = 7b-24"),    # neither enough nor the contract's
    ("instance_slab.g", "|early| <= 40b-28", "|early| <= 37b-28"),
    ("instance_inside.g", "scale in [1, 1b16]", "scale in [1, 1b17]"),  # exponents up to 16
    ("instance_ray.g", "<= 2825b-35", "<= 2820b-35"),
    ("instance_depth.g", "t in [0, 7]", "t in [0, 8]"),
    ("instance_row.g", "<= 32769b-47", "<= 32768b-47"),   # less than half a unit
    ("barycentric.g", "uses edge_uv", "uses edge_vu"),  # assumes what nobody proves
]


def self_test(contract, gappa):
    quiet = []
    for name, old, new in DAMAGES:
        with tempfile.TemporaryDirectory() as folder:
            folder = pathlib.Path(folder)
            for path in SCRIPTS.glob("*.g"):
                shutil.copy(path, folder)  # only the damaged script is proven again: the others are known to hold
            text = (folder / name).read_text()
            if old not in text:
                raise Problem(f"self-test: {name} does not contain {old!r}")
            (folder / name).write_text(text.replace(old, new, 1))
            damaged = scripts(folder)
            try:
                failure = run_gappa(gappa, next(s for s in damaged if s.path.name == name))
                if failure is None:
                    check_assumptions(damaged, proven_bounds(damaged), contract)
                    quiet.append(f"{name}: {old} -> {new}")
            except Problem:
                pass
    if quiet:
        raise Problem("damage not noticed:\n" + "\n".join(quiet))
    print(f"{len(DAMAGES)} damaged scripts, all noticed")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--write", action="store_true")
    parser.add_argument("--self-test", action="store_true")
    parser.add_argument("--gappa", default="gappa")
    args = parser.parse_args()
    with open(CONTRACT, "rb") as stream:
        contract = tomllib.load(stream)
    if not shutil.which(args.gappa):
        raise Problem(f"{args.gappa}: not found (Debian: apt-get install gappa)")
    if args.self_test:
        self_test(contract, args.gappa)
        return
    all_scripts, proven = certify(SCRIPTS, contract, args.gappa)
    for const, name, _ in TOLERANCES:
        body = contract["const"][const]
        if Fraction(body["value"], 1 << contract["type"][body["type"]]["frac_bits"]) <= proven[name][0]:
            raise Problem(f"{const} of the contract is not above the certified {name}")
    text = DOC.read_text()
    if text.count(BEGIN) != 1 or text.count(END) != 1:
        raise Problem(f"{DOC}: lacks the marks of the generated block")
    block = emit_block(all_scripts, proven, contract)
    new_text = text[:text.index(BEGIN)] + block + text[text.index(END) + len(END):]
    for path, old, new in ((DOC, text, new_text),
                           (HEADER, HEADER.read_text() if HEADER.exists() else "", emit_header(all_scripts, proven))):
        if old != new:
            if not args.write:
                raise Problem(f"{path.relative_to(ROOT)} is out of date: run scripts/proof/certify.py --write")
            path.write_text(new)
    print(f"{len(all_scripts)} scripts, {len(proven)} goals proven")


if __name__ == "__main__":
    try:
        main()
    except Problem as problem:
        sys.exit(f"error: {problem}")
