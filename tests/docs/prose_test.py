"""scripts/prose.py finds each kind of fault that it knows, where it is, and nothing in sound prose or in code."""
import importlib.util
import pathlib
import re
import subprocess
import sys
import tempfile
import tomllib

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
SKIP = 77


def load():
    spec = importlib.util.spec_from_file_location("prose", ROOT / "scripts/prose.py")
    prose = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(prose)
    return prose


def check(condition, what):
    if not condition:
        sys.exit("prose_test: " + what)


def main():
    prose = load()
    with open(ROOT / "scripts/prose.toml", "rb") as file:
        rules = tomllib.load(file)
    everything = [(re.compile(rule["find"], re.IGNORECASE), rule["say"]) for rule in rules["phrase"]]
    for rule, phrase in zip(rules["phrase"], everything):
        sentence = rule["example"]
        check(len(prose.phrases_in("a.md", sentence, [phrase])) == 1, "%s does not find: %s" % (rule["find"], sentence))
        check(prose.phrases_in("a.md", "One\n\n" + sentence, [phrase])[0][1] == 3, "wrong line for: " + sentence)
        wrapped = sentence.replace(" ", "\n")
        check(prose.phrases_in("a.md", wrapped, [phrase]), "not found over the end of a line: " + sentence)
        for code in ("`%s`", "```\n%s\n```", "Text:\n\n    %s\n"):
            check(not prose.phrases_in("a.md", code % sentence, everything), "found in code: " + sentence)
    sound = "The critical path has six LUTs. Two-way caches keep requests in flight. Either way up gives the same hits."
    check(not prose.phrases_in("a.md", sound, everything), "found in sound prose")

    if not prose.has_codespell():
        print("prose_test: codespell is not installed; the phrases are checked, spelling is not")
        sys.exit(SKIP)
    with tempfile.TemporaryDirectory() as folder:
        for text, fails in (("The rec" "iever asserts ready.\n", True), ("The receiver asserts ready.\n", False), (rules["phrase"][0]["example"], True)):
            path = pathlib.Path(folder) / "page.md"
            path.write_text(text, encoding="utf-8")
            step = subprocess.run([sys.executable, ROOT / "scripts/prose.py", path], stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True, check=False)
            check((step.returncode != 0) == fails, "exit code %d for: %s" % (step.returncode, text))
            check(not fails or "page.md:1:" in step.stderr, "the place is not named: " + step.stderr)
    print("prose_test: %d phrases, each found where it is" % len(everything))


if __name__ == "__main__":
    main()
