#!/usr/bin/env python3
"""Checks the tasks of a ring and the region that wires them (hls/ring), on clang's syntax tree, for what an HLS compiler needs to run each at its rate.

usage: hls_tasks.py [--ap-types DIR] [--include DIR]... FOLDER|FILE...

A task is an `extern "C"` function with a stream among its parameters; a region is a function with local streams. One finding a line,
`file:line:column: rule: what`; exit code 1 if there are any, 2 if something could not be parsed or there was no task. Rules:
  master     more than one access to memory in a task, or one that is not in the loop: a task makes at most one an iteration
  ends       a stream with more or fewer than one task that writes it and one that reads it; a task that does both
  carried    an array of a task that outlives an iteration, is written and read in a loop, and has no RT_LAP or RT_STALE that says why a later
             iteration may read it without forwarding
  interval   a loop with neither RT_PIPELINE(interval) nor RT_UNROLL as its first statement, or a pipeline without a reason in a comment behind it
"""
import argparse
import os
import re
import sys

import hls_subset
from hls_subset import K, ROOT, T, cindex, strip

CARRIED = {"RT_LAP", "RT_STALE"}


def is_stream(kind):
    spelling = kind.get_canonical().spelling
    return "hls::stream<" in spelling


class Tasks:
    def __init__(self, roots):
        self.roots = [os.path.realpath(root) for root in roots]
        self.findings, self.tasks, self.regions, self.macros = set(), {}, [], []
        self.known = {}  # name of a file -> is it one of the sources?

    def inside(self, cursor):
        file = cursor.location.file
        name = file.name if file else ""
        if name not in self.known:
            path = os.path.realpath(name) if name else ""
            self.known[name] = any(path == root or path.startswith(root + os.sep) for root in self.roots)
        return self.known[name]

    def report(self, cursor, rule, what):
        place = cursor.location
        self.findings.add((os.path.relpath(place.file.name), place.line, place.column, rule, what))

    def read(self, unit):
        cursors = [cursor for cursor in unit.cursor.get_children() if self.inside(cursor)]
        self.macros = [c for c in cursors if c.kind == K.MACRO_INSTANTIATION and c.spelling.startswith("RT_")]
        todo = cursors
        while todo:
            cursor = todo.pop(0)
            if cursor.kind in (K.NAMESPACE, K.LINKAGE_SPEC, K.UNEXPOSED_DECL):
                todo += [c for c in cursor.get_children() if self.inside(c)]
            elif cursor.kind == K.FUNCTION_DECL and cursor.is_definition():
                if any(is_stream(p.type) for p in cursor.get_arguments()):
                    self.task(cursor)
                elif any(c.kind == K.VAR_DECL and is_stream(c.type) for c in cursor.walk_preorder()):
                    self.regions.append(cursor)

    def task(self, function):
        uses = {}  # name of a stream -> operations
        accesses, loops, arrays = [], [], {}
        pointers = {p.hash for p in function.get_arguments() if p.type.get_canonical().kind == T.POINTER}

        def walk(cursor, inside_loop, assigned):
            if cursor.kind == K.FOR_STMT:
                loops.append(cursor)
            if cursor.kind == K.VAR_DECL and not inside_loop and cursor.type.get_canonical().kind == T.CONSTANTARRAY:
                arrays[cursor.hash] = (cursor, set())
            if cursor.kind == K.CALL_EXPR and cursor.spelling in ("read", "write"):
                for c in cursor.walk_preorder():
                    if c.kind == K.DECL_REF_EXPR and is_stream(c.type) and c.referenced.kind == K.PARM_DECL:
                        uses.setdefault(c.spelling, []).append((cursor.spelling, cursor))
                        break
            children = list(cursor.get_children())
            if cursor.kind in (K.ARRAY_SUBSCRIPT_EXPR, K.UNARY_OPERATOR) and children:
                base = strip(children[0])
                target = base.referenced if base.kind == K.DECL_REF_EXPR else None
                if target is not None and target.hash in pointers:
                    accesses.append((cursor, inside_loop))
                if target is not None and target.hash in arrays and inside_loop:
                    arrays[target.hash][1].add("write" if assigned else "read")
            writes = cursor.kind == K.CALL_EXPR and re.fullmatch(r"operator([-+*/|&^]|<<|>>)?=", cursor.spelling or "") \
                or cursor.kind in (K.COMPOUND_ASSIGNMENT_OPERATOR,) \
                or cursor.kind == K.BINARY_OPERATOR and len(children) == 2 and hls_subset.operator_between(cursor, *children) == "="
            for number, child in enumerate(children):
                walk(child, inside_loop or cursor.kind == K.FOR_STMT, number == 0 if writes else assigned and cursor.kind in (K.UNEXPOSED_EXPR, K.PAREN_EXPR))

        walk(function, False, False)
        self.tasks[function.spelling] = (function, uses)
        for name, operations in uses.items():
            if len({kind for kind, _ in operations}) > 1:
                self.report(operations[-1][1], "ends", "'%s' is read and written by one task" % name)
        for cursor, inside_loop in accesses[1:]:
            self.report(cursor, "master", "a second access to memory; a task makes one an iteration")
        for cursor, inside_loop in accesses[:1]:
            if not inside_loop:
                self.report(cursor, "master", "an access to memory outside the loop")
        first, last = function.extent.start.offset, function.extent.end.offset
        mine = [m for m in self.macros if m.location.file.name == function.location.file.name and first <= m.extent.start.offset < last]
        named = {token.spelling for m in mine if m.spelling in CARRIED for token in m.get_tokens()}
        for cursor, kinds in arrays.values():
            if kinds == {"read", "write"} and cursor.spelling not in named:
                self.report(cursor, "carried", "'%s' is carried from iteration to iteration without forwarding or a reason" % cursor.spelling)
        with open(function.location.file.name, encoding="utf-8") as file:
            lines = file.read().splitlines()
        for loop in loops:
            body = list(loop.get_children())[-1]
            begin = body.extent.start.offset
            inner = [c.extent.start.offset for c in body.get_children()] if body.kind == K.COMPOUND_STMT else []
            until = inner[0] if inner else begin
            head = [m for m in mine if m.spelling in ("RT_PIPELINE", "RT_UNROLL") and begin <= m.extent.start.offset <= until]
            if not head:
                self.report(loop, "interval", "a loop without RT_PIPELINE or RT_UNROLL")
            elif head[0].spelling == "RT_PIPELINE" and not re.search(r"RT_PIPELINE\(\d+\)\s*//\s*\w+", lines[head[0].location.line - 1]):
                self.report(head[0], "interval", "a pipeline without a number or the reason for it")

    def check_regions(self):
        for region in self.regions:
            streams = {c.hash: (c, [], []) for c in region.walk_preorder() if c.kind == K.VAR_DECL and is_stream(c.type)}
            for call in region.walk_preorder():
                if call.kind != K.CALL_EXPR or call.spelling not in self.tasks:
                    continue
                function, uses = self.tasks[call.spelling]
                for parameter, argument in zip(function.get_arguments(), call.get_arguments()):
                    target = strip(argument).referenced if is_stream(parameter.type) else None
                    if target is not None and target.hash in streams:
                        for kind in sorted({kind for kind, _ in uses.get(parameter.spelling, [])}):
                            streams[target.hash][1 if kind == "write" else 2].append(call.spelling)
            for cursor, writers, readers in streams.values():
                if len(writers) != 1 or len(readers) != 1:
                    self.report(cursor, "ends", "'%s' is written by %s and read by %s" % (cursor.spelling, ", ".join(writers) or "nobody", ", ".join(readers) or "nobody"))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--ap-types", default=os.environ.get("RETRACE_AP_TYPES") or os.path.join(ROOT, ".env", "ap_types"), help="folder with ap_int.h")
    parser.add_argument("--include", action="append", default=[], help="another include folder")
    parser.add_argument("sources", nargs="+")
    arguments = parser.parse_args()
    hls_subset.declare_evaluation(cindex.conf.lib)
    sys.setrecursionlimit(20000)
    units = []
    for source in arguments.sources:
        units += [os.path.join(source, name) for name in sorted(os.listdir(source)) if name.endswith(".cpp")] if os.path.isdir(source) else [source]
    checker, index = Tasks(arguments.sources), cindex.Index.create()
    flags = ["-x", "c++", "-std=c++17"] + ["-I" + folder for folder in [arguments.ap_types] + arguments.include]
    # One translation unit reads ap_types once. Where the sources do not compile together, each is one.
    together = os.path.join(os.path.dirname(os.path.abspath(units[0])), "hls_tasks_all.cpp") if units else ""
    attempts = [[(together, [(together, "".join('#include "%s"\n' % os.path.abspath(unit) for unit in units))])]] if len(units) > 1 else []
    attempts.append([(path, None) for path in units])
    keep = []  # cursors live as long as their translation unit
    for attempt in attempts:
        bad = ""
        for path, unsaved in attempt:
            unit = index.parse(path, args=flags, unsaved_files=unsaved, options=cindex.TranslationUnit.PARSE_DETAILED_PROCESSING_RECORD)
            errors = [str(d) for d in unit.diagnostics if d.severity >= cindex.Diagnostic.Error]
            if errors:
                bad = "hls_tasks: %s does not compile:\n  %s" % (path, "\n  ".join(errors[:10]))
                break
            keep.append(unit)
        if not bad:
            break
        keep.clear()
    if bad:
        print(bad, file=sys.stderr)
        sys.exit(2)
    for unit in keep:
        checker.read(unit)
    checker.check_regions()
    if not checker.tasks or not checker.regions:
        print("hls_tasks: no task or no region in %s" % " ".join(arguments.sources), file=sys.stderr)
        sys.exit(2)
    for finding in sorted(checker.findings):
        print("%s:%d:%d: %s: %s" % finding)
    print("hls_tasks: %d tasks, %d regions: %s" % (len(checker.tasks), len(checker.regions), "%d findings" % len(checker.findings) if checker.findings else "as they have to be"))
    sys.exit(1 if checker.findings else 0)


if __name__ == "__main__":
    main()
