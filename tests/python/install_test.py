#!/usr/bin/env python3
"""pip install . in an environment made for the purpose, then the README's example and the notebook, with the time that each takes.

usage: tests/python/install_test.py [--wheel FILE]     Needs PyPI, and what scripts/setup.sh installs. --wheel: a wheel that is there, in place of the clone.
"""
import argparse
import os
import pathlib
import subprocess
import sys
import tempfile
import time
import tomllib

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent


def example():
    """The Python of the README: its one block of that language."""
    blocks = [block.split("```")[0] for block in (ROOT / "README.md").read_text(encoding="utf-8").split("```python\n")[1:]]
    if len(blocks) != 1:
        sys.exit("install_test: %d blocks of Python in README.md" % len(blocks))
    return blocks[0]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--wheel", type=pathlib.Path)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="retrace-install-") as name:
        folder = pathlib.Path(name)
        python = folder / "venv/bin/python"
        extras = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["optional-dependencies"]["notebook"]
        what = str(arguments.wheel.absolute()) if arguments.wheel else str(ROOT)
        steps = [("environment", [sys.executable, "-m", "venv", folder / "venv"]),
                 ("pip install .", [python, "-m", "pip", "install", "--quiet", what]),
                 ("example of the README", [python, "-c", example()]),
                 ("packages of the notebook", [python, "-m", "pip", "install", "--quiet", *extras]),
                 ("notebook", [python, ROOT / "scripts/notebook.py"])]
        # In a folder of its own, so that nothing but what is installed can be imported.
        for title, command in steps:
            began, processor = time.monotonic(), os.times()
            code = subprocess.run(list(map(str, command)), cwd=folder, check=False, env={**os.environ, "PYTHONPATH": ""}).returncode
            if code:
                sys.exit("install_test: %s failed with %d" % (title, code))
            ended = os.times()
            print("install_test: %-24s %6.1f s, %6.1f s of processor time" % (
                title, time.monotonic() - began, ended.children_user + ended.children_system - processor.children_user - processor.children_system), flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
