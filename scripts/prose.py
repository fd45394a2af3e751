#!/usr/bin/env python3
"""Checks the project's prose: spelling (codespell) of every text file that git knows, and in *.md the phrases that scripts/prose.toml forbids.

usage: scripts/prose.py [FILE ...]   (without files: all that git knows)
"""
import argparse
import pathlib
import re
import subprocess
import sys
import tomllib

ROOT = pathlib.Path(__file__).resolve().parent.parent
PYTHON = ROOT / ".env/py/bin/python"
TEXT = ["*.md", "*.py", "*.sh", "*.toml", "*.cpp", "*.hpp", "*.h", "*.sv", "*.svh", "*.v", "*.txt", "*.cmake", "*.tcl", "*.rdl", "*.cff", "*.html", "scripts/bitstream"]


def blank(match):
    """Spaces in the place of what is not prose, so that lines and columns stay."""
    return re.sub(r"[^\n]", " ", match.group(0))


def prose_of(text):
    text = re.sub(r"^(```.*?^```|~~~.*?^~~~)", blank, text, flags=re.MULTILINE | re.DOTALL)
    text = re.sub(r"^    \S.*$", blank, text, flags=re.MULTILINE)
    return re.sub(r"`[^`\n]*`|\]\([^)\n]*\)", blank, text)


def phrases_in(name, text, phrases):
    prose = prose_of(text)
    # A phrase may go over the end of a line.
    flat = prose.replace("\n", " ")
    found = []
    for pattern, say in phrases:
        for match in pattern.finditer(flat):
            line = prose.count("\n", 0, match.start()) + 1
            found.append((name, line, "'%s': say %s" % (re.sub(r"\s+", " ", match.group(0)), say)))
    return found


def has_codespell():
    return PYTHON.exists() and subprocess.run([PYTHON, "-c", "import codespell_lib"], stderr=subprocess.DEVNULL, check=False).returncode == 0


def spelling(files, ignore):
    if not has_codespell():
        return ["codespell is not installed: scripts/setup.sh --tools"]
    step = subprocess.run([PYTHON, "-m", "codespell_lib", "--disable-colors", "--ignore-words-list", ",".join(ignore), *files], cwd=ROOT, stdout=subprocess.PIPE,
                          stderr=subprocess.PIPE, text=True, check=False)
    if step.returncode not in (0, 65):
        return ["codespell failed: " + step.stderr.strip()]
    return step.stdout.splitlines()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", nargs="*")
    arguments = parser.parse_args()
    with open(ROOT / "scripts/prose.toml", "rb") as file:
        rules = tomllib.load(file)
    phrases = [(re.compile(rule["find"], re.IGNORECASE), rule["say"]) for rule in rules["phrase"]]
    files = arguments.files
    if not files:
        listing = subprocess.run(["git", "ls-files", "-z", *TEXT, ":!scripts/prose.toml", ":!tests/fuzz/corpus"], cwd=ROOT, check=True, stdout=subprocess.PIPE, text=True)
        files = [name for name in listing.stdout.split("\0") if name and (ROOT / name).exists()]
    found = spelling(files, rules["ignore_words"])
    for name in files:
        if name.endswith(".md"):
            found += ["%s:%d: %s" % place for place in phrases_in(name, (ROOT / name).read_text(encoding="utf-8"), phrases)]
    for line in found:
        print("prose: " + line, file=sys.stderr)
    if found:
        sys.exit(1)
    print("prose: %d files" % len(files))


if __name__ == "__main__":
    main()
