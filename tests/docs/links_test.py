"""Every link of every *.md that git knows leads to a file of the repository and to a heading of it."""
import pathlib
import posixpath
import re
import subprocess
import sys
import unicodedata

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
LINK = re.compile(r"\]\(\s*<?([^)\s>]+)>?(?:\s+\"[^\"]*\")?\s*\)|<(?:img|a)\b[^>]*?\b(?:src|href)=\"([^\"]+)\"")


def without_code(text):
    text = re.sub(r"^(\s*)```.*?^\s*```", "", text, flags=re.MULTILINE | re.DOTALL)
    return re.sub(r"`[^`\n]*`", "`", text)


def anchors(text):
    """Names of the headings, as the site gives them; code hosts differ only in signs that no heading here may hold beside letters."""
    text = re.sub(r"^(\s*)```.*?^\s*```", "", text, flags=re.MULTILINE | re.DOTALL)
    found = set(re.findall(r"\bid=\"([^\"]+)\"", text))
    for title in re.findall(r"^#{1,6}\s+(.*?)\s*#*$", text, re.MULTILINE):
        title = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", title)
        name = unicodedata.normalize("NFKD", title).encode("ascii", "ignore").decode()
        name = re.sub(r"[^\w\s-]", "", name).strip().lower()
        name, count = re.sub(r"[-\s]+", "-", name), 0
        unique = name
        while unique in found:
            count += 1
            unique = "%s_%d" % (name, count)
        found.add(unique)
    return found


def broken(name, text, exists, read):
    """What is wrong with the links of one page. `exists` and `read` say what the repository holds."""
    for match in LINK.finditer(without_code(text)):
        target = match.group(1) or match.group(2)
        if re.match(r"[a-z][a-z0-9+.-]*:", target):
            continue
        path, _, anchor = target.partition("#")
        if path.startswith("/"):
            yield "%s: '%s' is absolute" % (name, target)
            continue
        file = posixpath.normpath(posixpath.join(posixpath.dirname(name), path)) if path else name
        if not exists(file):
            yield "%s: '%s' leads nowhere" % (name, target)
        elif anchor and file.endswith(".md") and anchor not in anchors(read(file)):
            yield "%s: '%s': no such heading" % (name, target)


def self_test():
    pages = {"a.md": "# One\n## `two` three\n", "b/c.md": ""}
    faults = lambda text: len(list(broken("b/c.md", text, lambda file: file in pages, pages.get)))
    cases = {"[x](../a.md)": 0, "[x](../a.md#one)": 0, "[x](../a.md#two-three)": 0, "[x](https://example.com/y)": 0, "`[x](gone.md)`": 0, "```\n[x](gone.md)\n```": 0,
             "[x](a.md)": 1, "[`x`](gone.md)": 1, "[x](../a.md#three)": 1, "![x](gone.png)": 1, "[x](/a.md)": 1, "<img src=\"gone.png\">": 1, "[x](#none)": 1}
    for text, expected in cases.items():
        if faults(text) != expected:
            sys.exit("links_test: %d faults instead of %d in: %s" % (faults(text), expected, text))


def main():
    self_test()
    listing = subprocess.run(["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard", "*.md"], cwd=ROOT, check=True, stdout=subprocess.PIPE, text=True)
    names = [name for name in listing.stdout.split("\0") if name and (ROOT / name).exists()]
    read = lambda file: (ROOT / file).read_text(encoding="utf-8")
    found = [fault for name in names for fault in broken(name, read(name), lambda file: (ROOT / file).exists(), read)]
    for fault in found:
        print("links_test: " + fault, file=sys.stderr)
    if found:
        sys.exit(1)
    print("links_test: %d pages" % len(names))


if __name__ == "__main__":
    main()
