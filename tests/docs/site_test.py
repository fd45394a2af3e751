"""scripts/docs.sh builds the site, and a link, an anchor or a file of the repository that does not exist stops it. Skipped where mkdocs is not installed.

usage: site_test.py --work FOLDER
"""
import argparse
import pathlib
import re
import shutil
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
SKIP = 77


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--work", required=True)
    work = pathlib.Path(parser.parse_args().work)
    if not (ROOT / ".env/docs/requirements.installed").exists():
        print("site_test: mkdocs is not installed (scripts/docs.sh installs it)")
        sys.exit(SKIP)
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir(parents=True)
    step = subprocess.run(["scripts/docs.sh", "--output", str(work / "site")], cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)
    if step.returncode:
        sys.exit("site_test: " + step.stdout)
    outside = [match for page in (work / "site").rglob("*.html") for match in re.findall(r"<(?:script|link|img)\b[^>]*\b(?:src|href)=\"?(https?:[^\"\s>]+)", page.read_text(encoding="utf-8"))]
    if outside:
        sys.exit("site_test: the site loads from elsewhere: " + ", ".join(sorted(set(outside))))

    # The same script over damaged pages, in a copy of what it reads.
    copy = work / "copy"
    for name in ("docs", "scripts"):
        shutil.copytree(ROOT / name, copy / name, ignore=shutil.ignore_patterns("__pycache__"))
    for name in subprocess.run(["git", "ls-files"], cwd=ROOT, check=True, stdout=subprocess.PIPE, text=True).stdout.splitlines():
        path = copy / name
        if not path.exists():
            path.parent.mkdir(parents=True, exist_ok=True)
            path.touch()
    (copy / ".env").symlink_to(ROOT / ".env")
    page = copy / "docs/program.md"
    sound = page.read_text(encoding="utf-8")
    for damage, said in (("", ""), ("[x](gone.md)", "gone.md"), ("[x](core.md#nowhere)", "#nowhere"), ("[`x`](../gone/x.hpp)", "gone/x.hpp"), ("![x](gone.png)", "gone.png")):
        page.write_text(sound + "\n" + damage + "\n", encoding="utf-8")
        step = subprocess.run(["scripts/docs.sh", "--output", str(work / "damaged")], cwd=copy, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)
        if (step.returncode != 0) != bool(damage) or said not in step.stdout:
            sys.exit("site_test: with '%s': exit code %d\n%s" % (damage, step.returncode, step.stdout))
    print("site_test: the site builds, four kinds of damage stop it")


if __name__ == "__main__":
    main()
