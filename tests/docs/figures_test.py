"""The figures on the front page are those that its command prints: rays, violations, hits lost, and the classes in the caption of the picture.

usage: figures_test.py RETRACE
"""
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
COMMAND = "compare room --engines golden,csim --size 640x480"


def figures(printed):
    """Rays in all, violations, exact hits lost, and of the primary rays those in the classes same and edge; None if something is missing."""
    number = lambda pattern: [int(text.replace(",", "")) for text in re.findall(pattern, printed, re.MULTILINE)]
    rays, same, edge = number(r"rays, golden against csim: ([\d,]+)"), number(r"^\s+same\s+([\d,]+)"), number(r"^\s+edge\s+([\d,]+)")
    violations, lost = number(r"^([\d,]+) violations$"), number(r"exact hits lost: ([\d,]+)")
    if not (len(rays) == len(same) == len(edge) == len(lost) == 2 and len(violations) == 1):
        return None
    return {"rays": sum(rays), "violations": violations[0], "lost": sum(lost), "same": same[0], "edge": edge[0]}


def claims(found):
    """What the front page has to say."""
    return ["**%s violations** in %s primary and shadow rays" % (format(found["violations"], ","), format(found["rays"], ",")),
            "**%s exact hits lost**" % format(found["lost"], ","),
            "%s rays the same, %s on edges" % (format(found["same"], ","), format(found["edge"], ","))]


def main():
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    if "`retrace %s`" % COMMAND not in readme:
        sys.exit("figures_test: README.md does not name the command: retrace " + COMMAND)
    step = subprocess.run([sys.argv[1], *COMMAND.split(), "--quiet"], stdout=subprocess.PIPE, text=True, check=False)
    found = figures(step.stdout)
    if step.returncode or found is None:
        sys.exit("figures_test: exit code %d, or figures are missing:\n%s" % (step.returncode, step.stdout))
    wrong = [claim for claim in claims(found) if claim not in readme]
    if wrong:
        sys.exit("figures_test: README.md does not say: " + "; ".join(wrong))
    print("figures_test: " + "; ".join(claims(found)))


if __name__ == "__main__":
    main()
