"""Runs a file of tests with pytest on the module of a build: run.py PACKAGE_FOLDER RETRACE FILE. RETRACE_SEED chooses the seed; exit code 77 without the module."""
import importlib.util
import os
import pathlib
import subprocess
import sys

folder, program, name = sys.argv[1:]
missing = [tool for tool in ("numpy", "pytest", "hypothesis") if importlib.util.find_spec(tool) is None]
if missing or not list(pathlib.Path(folder, "retrace").glob("_retrace*.so")):
    print("python: %s (scripts/setup.sh --tools, then build again): skipped" % ("there is no " + ", ".join(missing) if missing else "the module is not built"))
    sys.exit(77)
seed = os.environ.get("RETRACE_SEED", "1")
print("python: seed %s" % seed, flush=True)
environment = {**os.environ, "PYTHONPATH": folder, "RETRACE_PROGRAM": program, "RETRACE_SEED": seed, "PYTHONDONTWRITEBYTECODE": "1"}
sys.exit(subprocess.run([sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "--hypothesis-seed=" + seed, "--hypothesis-show-statistics" if os.environ.get("RETRACE_STATISTICS") else "-q",
                         str(pathlib.Path(__file__).parent / name)], env=environment, cwd=folder, check=False).returncode)
