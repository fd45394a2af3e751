#!/usr/bin/env python3
"""Checks that synthesized sources stay in the subset that HLS compilers accept (docs/hls-export.md), on clang's syntax tree.

usage: hls_subset.py [--ap-types DIR] [--include DIR]... [--define NAME]... FOLDER|FILE...

Every *.cpp of a FOLDER is parsed (all together where they compile so), and everything in its files is checked, headers too; of a FILE only itself. What the sources call in the
headers of ap_types and of the stream is taken for synthesizable. One finding a line, `file:line:column: rule: what`; exit code 1 if there are
any, 2 if something could not be parsed. Rules:
  recursion  a function that can reach itself, or a call through a pointer, where nobody can tell
  heap       new, delete, malloc and the like, arrays whose length is not constant
  virtual    virtual functions and bases, typeid, dynamic_cast, exceptions
  loop       anything but for (integer = constant; integer < constant; integer += constant) with an untouched variable; goto
  float      a floating-point literal, variable, parameter, result or value in between
  std        anything declared in namespace std
  library    any other function from outside the sources and the given include folders
  stream     a stream operation other than blocking read() and write()
  macro      macros W, I, S, N, W2, I2, S2, N2, which break headers
  pragma     a directive that Bambu would see (with __BAMBU__ defined) and cannot take: out of a macro by _Pragma, in a template, anything but
             `interface mode=axis port=P` and `interface mode=m_axi port=P offset=direct ...`
  narrow     a variable narrower than the word whose shift it takes, and then or-ed: it loses bits in Bambu's hardware
  width      a stream of anything but ap_uint of a power of two bytes, or of exactly 32 bits
"""
import argparse
import ctypes
import os
import re
import sys

try:
    from clang import cindex
except ImportError:
    sys.path.append("/usr/lib/python3/dist-packages")  # Debian's, for another Python
    try:
        from clang import cindex
    except ImportError:
        sys.exit("hls_subset: no Python bindings of libclang; scripts/setup.sh installs them (python3-clang-14)")
from clang.cindex import CursorKind as K
from clang.cindex import TypeKind as T

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
FUNCTIONS = (K.FUNCTION_DECL, K.CXX_METHOD, K.CONSTRUCTOR, K.DESTRUCTOR, K.CONVERSION_FUNCTION, K.FUNCTION_TEMPLATE)
FLOATS = (T.FLOAT, T.DOUBLE, T.LONGDOUBLE, T.FLOAT128, T.HALF, T.COMPLEX)
INTEGERS = {T.CHAR_U: False, T.UCHAR: False, T.USHORT: False, T.UINT: False, T.ULONG: False, T.ULONGLONG: False,
            T.CHAR_S: True, T.SCHAR: True, T.SHORT: True, T.INT: True, T.LONG: True, T.LONGLONG: True}  # is it signed?
HEAP = {"malloc", "calloc", "realloc", "reallocarray", "free", "aligned_alloc", "posix_memalign", "memalign", "valloc", "alloca", "__builtin_alloca",
        "__builtin_malloc", "__builtin_calloc", "__builtin_realloc", "__builtin_free", "strdup", "strndup", "operator new", "operator delete",
        "operator new[]", "operator delete[]", "mmap", "sbrk"}
DYNAMIC = {K.CXX_TYPEID_EXPR: "typeid", K.CXX_DYNAMIC_CAST_EXPR: "dynamic_cast", K.CXX_THROW_EXPR: "throw", K.CXX_TRY_STMT: "try"}
JUMPS = {K.WHILE_STMT: "while loop", K.DO_STMT: "do loop", K.CXX_FOR_RANGE_STMT: "range-based for loop; write its bound", K.GOTO_STMT: "goto",
         K.INDIRECT_GOTO_STMT: "computed goto"}
MACROS = {"W", "I", "S", "N", "W2", "I2", "S2", "N2"}


DIRECTIVE = re.compile(r"interface (mode=axis port=\w+|mode=m_axi port=\w+ offset=direct( \w+=\w+)*)$")
WIDTH = re.compile(r"(?:const )?(?:struct |class )?ap_(u?)int<(\d+)>$")
STREAM = re.compile(r"hls::stream<(?:struct |class )?(ap_uint<(\d+)>|.*?)(?:, \d+)?>$")


def seen_by_bambu(lines):
    """Which lines its preprocessor keeps, as far as conditions on __BAMBU__ and __SYNTHESIS__ decide it; what others decide may be kept."""
    def value(condition):
        text = re.sub(r"defined\s*\(?\s*__BAMBU__\s*\)?", "True", condition)
        text = re.sub(r"defined\s*\(?\s*__SYNTHESIS__\s*\)?", "False", text)
        text = text.split("//")[0].replace("&&", " and ").replace("||", " or ").replace("!", " not ")
        return eval(text) if re.fullmatch(r"(True|False|and|or|not|[\s()])+", text) else None  # of these words only

    stack, kept = [], []  # an entry: does this branch stay, has one been taken for sure
    for line in lines:
        match = re.match(r"\s*#\s*(ifdef|ifndef|if|elif|else|endif)\b(.*)", line)
        if match:
            word, condition = match.groups()
            name = condition.split("//")[0].strip()
            if word in ("ifdef", "ifndef"):
                condition, word = "defined(%s)" % name if word == "ifdef" else "!defined(%s)" % name, "if"
            if word == "if":
                known = value(condition)
                stack.append([known is not False, known is True])
            elif word == "endif" and stack:
                stack.pop()
            elif stack:
                known = True if word == "else" else value(condition)
                stack[-1] = [not stack[-1][1] and known is not False, stack[-1][1] or known is True]
        kept.append(all(stays for stays, _ in stack))
    return kept


def declare_evaluation(lib):
    """clang_Cursor_Evaluate, which the bindings of version 14 do not offer."""
    lib.clang_Cursor_Evaluate.argtypes, lib.clang_Cursor_Evaluate.restype = [cindex.Cursor], ctypes.c_void_p
    for name, result in (("getKind", ctypes.c_int), ("isUnsignedInt", ctypes.c_uint), ("getAsUnsigned", ctypes.c_ulonglong), ("getAsLongLong", ctypes.c_longlong),
                         ("dispose", None)):
        function = getattr(lib, "clang_EvalResult_" + name)
        function.argtypes, function.restype = [ctypes.c_void_p], result
    lib.clang_isVirtualBase.argtypes, lib.clang_isVirtualBase.restype = [cindex.Cursor], ctypes.c_uint


def constant(cursor):
    """Value of an integer constant expression, or None."""
    lib = cindex.conf.lib
    result = lib.clang_Cursor_Evaluate(cursor)
    if not result:
        return None
    try:
        if lib.clang_EvalResult_getKind(result) != 1:
            return None
        unsigned = lib.clang_EvalResult_isUnsignedInt(result)
        return lib.clang_EvalResult_getAsUnsigned(result) if unsigned else lib.clang_EvalResult_getAsLongLong(result)
    finally:
        lib.clang_EvalResult_dispose(result)


def strip(cursor):
    """The expression inside parentheses and implicit conversions."""
    while cursor.kind in (K.UNEXPOSED_EXPR, K.PAREN_EXPR):
        children = list(cursor.get_children())
        if len(children) != 1:
            break
        cursor = children[0]
    return cursor


def operator_between(cursor, left, right):
    """Spelling of a binary operator: the tokens between its operands."""
    first, last = left.extent.end.offset, right.extent.start.offset
    return "".join(token.spelling for token in cursor.get_tokens() if first <= token.extent.start.offset < last)


class Checker:
    def __init__(self, files_of_interest, include_folders):
        self.roots = [os.path.realpath(root) for root in files_of_interest]
        self.includes = [os.path.realpath(folder) + os.sep for folder in include_folders]
        self.findings = set()
        self.calls = {}      # USR of a function -> {USR or name of a callee: (location, spelling)}
        self.functions = {}  # USR -> spelling
        self.by_name = {}    # spelling -> USRs, for calls in templates that are not resolved yet
        self.files = set()
        self.done = set()    # files checked with an earlier translation unit
        self.loops = 0
        self.templates = []  # (file, first line, last line) of every template
        self.real, self.std = {}, {}

    def path(self, cursor):
        file = cursor.location.file
        if file is None:
            return None
        if file.name not in self.real:
            self.real[file.name] = os.path.realpath(file.name)
        return self.real[file.name]

    def inside(self, path):
        return path is not None and any(path == root or path.startswith(root + os.sep) for root in self.roots)

    def report(self, cursor, rule, what):
        place = cursor.location
        self.findings.add((os.path.relpath(self.path(cursor)), place.line, place.column, rule, what))

    # ---------------------------------------------------------------------------------------------- declarations
    def in_std(self, cursor):
        chain = []
        answer = False
        while cursor is not None and cursor.kind not in (K.TRANSLATION_UNIT, K.INVALID_FILE):
            key = cursor.hash
            if key in self.std:
                answer = self.std[key]
                break
            chain.append(key)
            if cursor.kind == K.NAMESPACE and cursor.spelling == "std":
                answer = True
                break
            cursor = cursor.semantic_parent
        for key in chain:
            self.std[key] = answer
        return answer

    def bare(self, kind):
        """A type without references, pointers and dimensions."""
        kind = kind.get_canonical()
        while True:
            if kind.kind in (T.POINTER, T.LVALUEREFERENCE, T.RVALUEREFERENCE):
                kind = kind.get_pointee().get_canonical()
            elif kind.kind in (T.CONSTANTARRAY, T.INCOMPLETEARRAY, T.VARIABLEARRAY, T.DEPENDENTSIZEDARRAY, T.VECTOR):
                kind = kind.get_array_element_type().get_canonical() if kind.kind != T.VECTOR else kind.element_type.get_canonical()
            else:
                return kind

    def check_type(self, cursor):
        kind = cursor.type
        if kind.kind == T.INVALID:
            return
        if kind.get_canonical().kind == T.VARIABLEARRAY:
            self.report(cursor, "heap", "the length of the array is not constant")
        bare = self.bare(kind)
        if bare.kind in FLOATS:
            self.report(cursor, "float", "%s is a floating-point type" % bare.spelling)
            return
        if bare.kind == T.RECORD:
            if self.in_std(bare.get_declaration()):
                self.report(cursor, "std", "%s is a type of the standard library" % bare.spelling)
            for i in range(max(bare.get_num_template_arguments(), 0)):
                argument = bare.get_template_argument_type(i)
                if argument.kind != T.INVALID and self.bare(argument).kind in FLOATS:
                    self.report(cursor, "float", "%s has a floating-point argument" % bare.spelling)

    # ---------------------------------------------------------------------------------------------- calls
    def check_call(self, cursor, caller):
        target = cursor.referenced
        if target is None or target.kind == K.OVERLOADED_DECL_REF:
            names = [c.spelling for c in cursor.walk_preorder() if c.kind == K.OVERLOADED_DECL_REF][:1] or ([cursor.spelling] if cursor.spelling else [])
            if names:  # in a template: every function of that name may be meant
                self.calls.setdefault(caller, {})["?" + names[0]] = (cursor, names[0])
            elif any(c.kind in (K.DECL_REF_EXPR, K.MEMBER_REF_EXPR, K.ARRAY_SUBSCRIPT_EXPR, K.UNARY_OPERATOR, K.CALL_EXPR, K.CONDITIONAL_OPERATOR)
                     for c in list(cursor.get_children())[:1] for c in c.walk_preorder()):
                self.report(cursor, "recursion", "a call through a pointer: nobody can tell what it calls")
            return
        if target.kind in (K.VAR_DECL, K.PARM_DECL, K.FIELD_DECL):
            self.report(cursor, "recursion", "a call through the pointer '%s': nobody can tell what it calls" % target.spelling)
            return
        if target.kind not in FUNCTIONS:
            return
        if target.kind == K.CXX_METHOD and target.is_virtual_method():
            self.report(cursor, "virtual", "'%s' is virtual" % target.spelling)
        if target.spelling in HEAP:
            self.report(cursor, "heap", "'%s'" % target.spelling)
            return
        owner = target.semantic_parent
        if owner is not None and owner.spelling in ("stream", "stream_base") and owner.semantic_parent is not None and owner.semantic_parent.spelling == "hls":
            arguments = len(list(cursor.get_arguments()))
            if target.kind == K.CONSTRUCTOR and not any(list(a.get_tokens()) and a.extent.start.offset != cursor.extent.start.offset for a in cursor.get_arguments()):
                return  # hls::stream<word> name;
            if not (target.spelling == "read" and arguments == 0 or target.spelling == "write" and arguments == 1):
                self.report(cursor, "stream", "'%s' is not a blocking read() or write()" % target.spelling)
            return
        path = self.path(target)
        if self.inside(path):
            template = cindex.conf.lib.clang_getSpecializedCursorTemplate(target)
            callee = template if template is not None and template.kind in FUNCTIONS else target
            self.calls.setdefault(caller, {})[callee.get_usr()] = (cursor, target.spelling)
        elif path is not None and not any(path.startswith(folder) for folder in self.includes) and not self.in_std(target):
            self.report(cursor, "library", "'%s' is a function from outside" % target.spelling)

    # ---------------------------------------------------------------------------------------------- loops
    def check_for(self, cursor):
        self.loops += 1
        bad = lambda what, at=cursor: self.report(at, "loop", what)
        children = list(cursor.get_children())
        if len(children) != 4:
            return bad("not of the form for (integer = constant; condition; step)")
        init, condition, step, body = children
        declarations = list(init.get_children()) if init.kind == K.DECL_STMT else []
        if len(declarations) != 1 or declarations[0].kind != K.VAR_DECL:
            return bad("the loop does not declare its variable")
        variable = declarations[0]
        kind = variable.type.get_canonical()
        if kind.kind not in INTEGERS:
            return bad("the loop's variable is not a built-in integer")
        values = [c for c in variable.get_children() if c.kind.is_expression()]
        start = constant(values[-1]) if values else None
        if start is None:
            return bad("the first value of '%s' is not constant" % variable.spelling)

        def is_variable(expression):
            inner = strip(expression)
            return inner.kind == K.DECL_REF_EXPR and inner.referenced == variable

        sides = list(condition.get_children())
        if condition.kind != K.BINARY_OPERATOR or len(sides) != 2 or not is_variable(sides[0]):
            return bad("the condition does not compare '%s' with a constant" % variable.spelling)
        limit = constant(sides[1])
        if limit is None:
            return bad("the bound of '%s' is not constant" % variable.spelling)
        relation = operator_between(condition, *sides)

        amount = None
        parts = list(step.get_children())
        tokens = [token.spelling for token in step.get_tokens()]
        if step.kind == K.UNARY_OPERATOR and len(parts) == 1 and is_variable(parts[0]):
            amount = 1 if "++" in tokens else -1 if "--" in tokens else None
        elif step.kind == K.COMPOUND_ASSIGNMENT_OPERATOR and len(parts) == 2 and is_variable(parts[0]):
            by, sign = constant(parts[1]), {"+=": 1, "-=": -1}.get(operator_between(step, *parts))
            amount = by * sign if by is not None and sign is not None else None
        if not amount:
            return bad("'%s' does not advance by a constant" % variable.spelling)

        bits, signed = 8 * kind.get_size(), INTEGERS[kind.kind]
        lowest, highest = (-(1 << bits - 1), (1 << bits - 1) - 1) if signed else (0, (1 << bits) - 1)
        # Past the bound the variable must still hold its value, or the comparison never fails.
        ends = {"<": amount > 0 and limit - 1 + amount <= highest, "<=": amount > 0 and limit + amount <= highest,
                ">": amount < 0 and limit + 1 + amount >= lowest, ">=": amount < 0 and limit + amount >= lowest}.get(relation, False)
        if not ends or not lowest <= start <= highest:
            return bad("'%s' %s %d with step %d: not a loop that surely ends" % (variable.spelling, relation, limit, amount))
        self.check_untouched(body, body, variable)
        return None

    def check_untouched(self, cursor, parent, variable):
        """A loop's variable may only be read in the body: every use is the operand of a conversion to a value."""
        for child in cursor.get_children():
            if child.kind in (K.DECL_REF_EXPR, K.VARIABLE_REF) and child.referenced == variable and cursor.kind != K.UNEXPOSED_EXPR:
                self.report(child, "loop", "the body changes '%s' or hands it out" % variable.spelling)
            self.check_untouched(child if child.kind != K.PAREN_EXPR else child, cursor, variable)

    # ---------------------------------------------------------------------------------------------- directives, widths
    def check_directives(self, path):
        with open(path, encoding="utf-8") as file:
            lines = file.read().replace("\\\n", "\\ ").splitlines()
        for number, (line, seen) in enumerate(zip(lines, seen_by_bambu(lines)), 1):
            where = lambda rule, what, at=0: self.findings.add((os.path.relpath(path), number, at + 1, rule, what))
            code = re.sub(r"//.*|\"(\\.|[^\"\\])*\"", "", line)
            match = re.match(r"\s*#\s*pragma\s+HLS\s+(.*?)\s*$", code)
            if match and any(file == path and first <= number <= last for file, first, last in self.templates):
                where("pragma", "a directive in a template")
            elif seen and match and not DIRECTIVE.match(match.group(1)):
                where("pragma", "Bambu does not take '%s'" % match.group(1))
            elif seen and re.search(r"\b_Pragma\b", code):
                where("pragma", "a directive out of a macro, which Bambu's front end does not associate", code.index("_Pragma"))

    def width(self, cursor_type):
        match = WIDTH.match(cursor_type.get_canonical().spelling.replace(" &", ""))
        return int(match.group(2)) if match else None

    def check_narrow(self, function):
        """Variables of a function that take a shifted word wider than they are and are operands of an or."""
        narrow, joined = {}, set()
        for cursor in function.walk_preorder():
            children = list(cursor.get_children())
            if cursor.kind == K.VAR_DECL and children:
                target, source = cursor, children[-1]
            elif cursor.kind == K.CALL_EXPR and cursor.spelling == "operator=" and len(children) == 3:
                target, source = strip(children[0]).referenced, children[-1]
            elif cursor.kind == K.CALL_EXPR and cursor.spelling in ("operator|", "operator|="):
                joined |= {c.referenced.hash for c in cursor.walk_preorder() if c.kind == K.DECL_REF_EXPR and c.referenced is not None}
                continue
            else:
                continue
            mine = self.width(target.type) if target is not None and target.kind == K.VAR_DECL else None
            shifts = [c for c in source.walk_preorder() if c.kind == K.CALL_EXPR and c.spelling == "operator>>"] if mine else []
            for shift in shifts:
                widths = [self.width(c.type) for c in shift.walk_preorder() if c.kind == K.DECL_REF_EXPR and self.width(c.type)]
                if widths and max(widths) > mine:
                    narrow[target.hash] = (cursor, target.spelling, mine, max(widths))
        for key, (cursor, name, mine, theirs) in narrow.items():
            if key in joined:
                self.report(cursor, "narrow", "'%s' has %d bits, takes a shift of %d, and is or-ed; widen it and narrow at the end" % (name, mine, theirs))

    def check_stream(self, cursor):
        match = STREAM.match(self.bare(cursor.type).get_canonical().spelling)
        if match and not (match.group(2) and self.good_stream(int(match.group(2)))):
            self.report(cursor, "width", "a stream of %s: make it ap_uint of a power of two bytes, not 32 bits" % match.group(1))

    @staticmethod
    def good_stream(bits):
        return bits >= 8 and bits & (bits - 1) == 0 and bits != 32

    # ---------------------------------------------------------------------------------------------- the walk
    def visit(self, cursor, function):
        kind = cursor.kind
        if kind in (K.FUNCTION_TEMPLATE, K.CLASS_TEMPLATE, K.CLASS_TEMPLATE_PARTIAL_SPECIALIZATION):
            self.templates.append((self.path(cursor), cursor.extent.start.line, cursor.extent.end.line))
        if kind in FUNCTIONS and cursor.is_definition():
            self.check_narrow(cursor)
        if kind in (K.VAR_DECL, K.PARM_DECL, K.FIELD_DECL):
            self.check_stream(cursor)
        if kind in FUNCTIONS:
            usr = cursor.get_usr()
            if cursor.is_definition():
                self.functions[usr] = cursor.spelling
                self.by_name.setdefault(cursor.spelling, set()).add(usr)
                function = usr
            if kind == K.CXX_METHOD and cursor.is_virtual_method() or kind == K.DESTRUCTOR and cindex.conf.lib.clang_CXXMethod_isVirtual(cursor):
                self.report(cursor, "virtual", "'%s' is virtual" % cursor.spelling)
            if self.bare(cursor.result_type).kind in FLOATS:
                self.report(cursor, "float", "'%s' returns a floating-point value" % cursor.spelling)
        elif kind == K.CXX_BASE_SPECIFIER and cindex.conf.lib.clang_isVirtualBase(cursor):
            self.report(cursor, "virtual", "virtual base")
        elif kind in DYNAMIC:
            self.report(cursor, "virtual", DYNAMIC[kind])
        elif kind in JUMPS:
            self.loops += 1
            self.report(cursor, "loop", JUMPS[kind])
        elif kind == K.FOR_STMT:
            self.check_for(cursor)
        elif kind in (K.CXX_NEW_EXPR, K.CXX_DELETE_EXPR):
            self.report(cursor, "heap", "new" if kind == K.CXX_NEW_EXPR else "delete")
        elif kind == K.CALL_EXPR:
            self.check_call(cursor, function)
        elif kind in (K.TYPEDEF_DECL, K.TYPE_ALIAS_DECL):
            if self.bare(cursor.underlying_typedef_type).kind in FLOATS:
                self.report(cursor, "float", "'%s' is a floating-point type" % cursor.spelling)
        if kind.is_expression() or kind in (K.VAR_DECL, K.PARM_DECL, K.FIELD_DECL):
            self.check_type(cursor)
        if kind.is_expression() or kind.is_reference():
            target = cursor.referenced
            if target is not None and target != cursor and self.in_std(target):
                self.report(cursor, "std", "'%s' is of the standard library" % target.spelling)
        for child in cursor.get_children():
            self.visit(child, function)

    def parse_all(self, index, sources, arguments):
        """All sources as one translation unit, which reads ap_types once. False, and nothing said, if they do not compile together."""
        name = os.path.join(os.path.dirname(os.path.abspath(sources[0])), "hls_subset_all.cpp")
        text = "".join('#include "%s"\n' % os.path.abspath(source) for source in sources)
        return self.parse(index, name, arguments, [(name, text)])

    def parse(self, index, source, arguments, unsaved=None):
        """Checks what a translation unit has in files that no earlier one has shown."""
        unit = index.parse(source, args=arguments, unsaved_files=unsaved, options=cindex.TranslationUnit.PARSE_DETAILED_PROCESSING_RECORD)
        errors = [str(d) for d in unit.diagnostics if d.severity >= cindex.Diagnostic.Error]
        if errors and unsaved:
            return False
        if errors:
            print("hls_subset: %s does not compile:\n  %s" % (source, "\n  ".join(errors[:10])), file=sys.stderr)
            return False
        seen = set()
        for cursor in unit.cursor.get_children():
            path = self.path(cursor)
            if not self.inside(path):
                continue
            seen.add(path)
            if path in self.done:
                continue
            if cursor.kind == K.MACRO_DEFINITION:
                if cursor.spelling in MACROS:
                    self.report(cursor, "macro", "'%s' breaks headers that use it as a template parameter" % cursor.spelling)
            elif not cursor.kind.is_preprocessing():
                self.visit(cursor, None)
        for path in seen - self.done:
            if os.path.isfile(path):  # not the one that only includes all sources
                self.check_directives(path)
        self.done |= seen
        return True

    def check_recursion(self):
        """Every call that lies on a cycle of the call graph."""
        edges = {}
        for caller, callees in self.calls.items():
            for name, (cursor, spelling) in callees.items():
                for target in self.by_name.get(name[1:], ()) if name.startswith("?") else (name,):
                    if target in self.functions:
                        edges.setdefault(caller, []).append((target, cursor, spelling))
        reach = {}
        for start in edges:
            found, stack = set(), [start]
            while stack:
                for target, _, _ in edges.get(stack.pop(), ()):
                    if target not in found:
                        found.add(target)
                        stack.append(target)
            reach[start] = found
        for caller, callees in edges.items():
            for target, cursor, spelling in callees:
                if target == caller or caller in reach.get(target, ()):
                    self.report(cursor, "recursion", "'%s' can come back to '%s'" % (spelling, self.functions.get(caller, "?")))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--ap-types", default=os.environ.get("RETRACE_AP_TYPES") or os.path.join(ROOT, ".env", "ap_types"), help="folder with ap_int.h")
    parser.add_argument("--include", action="append", default=[], help="another include folder")
    parser.add_argument("--define", action="append", default=[])
    parser.add_argument("sources", nargs="+")
    arguments = parser.parse_args()
    if not os.path.isfile(os.path.join(arguments.ap_types, "ap_int.h")):
        sys.exit("hls_subset: no ap_int.h in %s; run scripts/setup.sh, or name a folder with --ap-types" % arguments.ap_types)
    declare_evaluation(cindex.conf.lib)
    sys.setrecursionlimit(20000)
    units, headers = [], []
    for source in arguments.sources:
        if os.path.isdir(source):
            for folder, _, names in sorted(os.walk(source)):
                units += [os.path.join(folder, name) for name in sorted(names) if name.endswith(".cpp")]
                headers += [os.path.join(folder, name) for name in sorted(names) if name.endswith((".hpp", ".h"))]
        elif os.path.isfile(source):
            units.append(source)
        else:
            sys.exit("hls_subset: there is no '%s'" % source)
    if not units:
        print("hls_subset: no *.cpp in %s" % " ".join(arguments.sources), file=sys.stderr)
        sys.exit(2)
    includes = [arguments.ap_types] + arguments.include
    checker = Checker(arguments.sources, includes)
    flags = ["-x", "c++", "-std=c++17"] + ["-I" + folder for folder in includes] + ["-D" + name for name in arguments.define]
    index = cindex.Index.create()
    parsed = [len(units) > 1 and checker.parse_all(index, units, flags)]
    if not parsed[0]:
        parsed = [checker.parse(index, unit, flags) for unit in units]
    checker.check_recursion()
    for finding in sorted(checker.findings):
        print("%s:%d:%d: %s: %s" % finding)
    unseen = [name for name in units + headers if os.path.realpath(name) not in checker.done]
    if not all(parsed) or unseen:
        if all(parsed):
            print("hls_subset: not reached from any *.cpp: %s" % " ".join(unseen), file=sys.stderr)
        sys.exit(2)
    print("hls_subset: %d sources, %d headers, %d functions, %d loops: %s"
          % (len(units), len(headers), len(checker.functions), checker.loops, "%d findings" % len(checker.findings) if checker.findings else "in the subset"))
    sys.exit(1 if checker.findings else 0)


if __name__ == "__main__":
    main()
