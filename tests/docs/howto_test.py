"""The entry that docs/adding-a-configuration.md shows makes a core that elaborates without a warning, and one that breaks a rule does not.

usage: howto_test.py --work FOLDER
"""
import argparse
import pathlib
import re
import shutil
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
FOLDERS = ["rtl", "scripts/cmake", "testbench/sim/core", "docs/configurations.md", "retrace.core"]  # what rtl/targets/generate.py and the lint touch


def elaborate(folder):
    filesets = (folder / "retrace.core").read_text(encoding="utf-8").split("\nfilesets:")[1].split("\nparameters:")[0]
    sources = [name for name in re.findall(r"^      - (rtl/[\w/]+\.s?v)$", filesets, re.MULTILINE) if not name.startswith("rtl/board/")]
    return subprocess.run(["verilator", "--lint-only", "-Wall", "--assert", "+define+RT_CONFIG=ConfigMine", "-GC_M_AXI_IMAGE_DATA_WIDTH=128", "+incdir+rtl/pkg",
                           "rtl/waivers.vlt", *sources, "--top-module", "rt_axi"], cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)


def core_with(work, name, entry):
    folder = work / name
    for path in FOLDERS:
        target = folder / path
        target.parent.mkdir(parents=True, exist_ok=True)
        if (ROOT / path).is_dir():
            shutil.copytree(ROOT / path, target, ignore=shutil.ignore_patterns("__pycache__"))
        else:
            shutil.copyfile(ROOT / path, target)
    table = folder / "rtl/targets/core.toml"
    text = table.read_text(encoding="utf-8")
    place = text.index("[configuration.wide]")
    table.write_text(text[:place] + entry + "\n" + text[place:], encoding="utf-8")
    step = subprocess.run([sys.executable, "rtl/targets/generate.py"], cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)
    if step.returncode:
        sys.exit("howto_test: generate.py: " + step.stdout)
    return folder


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--work", required=True)
    work = pathlib.Path(parser.parse_args().work)
    shutil.rmtree(work, ignore_errors=True)
    page = (ROOT / "docs/adding-a-configuration.md").read_text(encoding="utf-8")
    entry = re.search(r"```toml\n(.*?)```", page, re.DOTALL).group(1)
    entry = "\n".join(line.strip() for line in entry.splitlines())
    step = elaborate(core_with(work, "sound", entry))
    if step.returncode:
        sys.exit("howto_test: the configuration of the page:\n" + step.stdout)
    step = elaborate(core_with(work, "wrong", entry.replace("lanes = 2", "lanes = 9")))
    if step.returncode == 0 or "parameter check" not in step.stdout:
        sys.exit("howto_test: nine lanes elaborate:\n" + step.stdout)
    print("howto_test: the configuration of the page elaborates, one of nine lanes does not")


if __name__ == "__main__":
    main()
