#!/usr/bin/env python3
"""Runs one job of a sweep: job.py PLAN NAME. Its row goes to rows/NAME.json beside the plan, what it printed to logs/NAME.log.

A row appears whole or not at all. A job fails if its command ends with another exit code than 0, prints what it should not, or runs for longer than the plan
allows; failed/NAME.json then holds the command and the end of the log.
"""
import json
import os
import pathlib
import platform
import shlex
import signal
import subprocess
import sys
import tempfile
import time

import targets


def write(path, contents):
    path.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.NamedTemporaryFile("w", dir=path.parent, prefix=".", suffix=".tmp", delete=False, encoding="utf-8") as file:
        json.dump(contents, file, indent=1)
    os.chmod(file.name, 0o644)
    os.replace(file.name, path)


def run(job, root, log):
    """Exit code and standard output of the job's command, whose process group does not outlive this one's normal end."""
    log.parent.mkdir(parents=True, exist_ok=True)
    with open(log, "wb") as errors:
        child = subprocess.Popen(job["command"], cwd=root, env={**os.environ, **job["environment"]}, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                                 stderr=errors, start_new_session=True)

        def stop(number, _):
            os.killpg(child.pid, signal.SIGKILL)
            sys.exit(128 + number)

        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            signal.signal(number, stop)
        try:
            output, _ = child.communicate(timeout=60 * job["minutes"])
        except subprocess.TimeoutExpired:
            os.killpg(child.pid, signal.SIGKILL)
            child.communicate()
            return None, "", "still ran after %d minutes" % job["minutes"]
    text = output.decode("utf-8", "replace")
    with open(log, "a", encoding="utf-8") as file:
        file.write(text)
    return child.returncode, text, None


def main():
    if len(sys.argv) != 3:
        sys.exit("usage: job.py PLAN NAME")
    plan_file = pathlib.Path(sys.argv[1]).absolute()
    plan = json.loads(plan_file.read_text(encoding="utf-8"))
    found = [job for job in plan["jobs"] if job["name"] == sys.argv[2]]
    if not found:
        sys.exit("job: %s has no job %s" % (plan_file, sys.argv[2]))
    job, folder = found[0], plan_file.parent
    log, failed = folder / "logs" / (job["name"] + ".log"), folder / "failed" / (job["name"] + ".json")
    began = time.time()
    try:
        code, output, fault = run(job, plan["root"], log)
    except OSError as error:
        code, output, fault = None, "", str(error)
    values = None
    if fault is None and code == 0:
        try:
            values = targets.TARGETS[plan["target"]].values(job, output)
        except targets.Unexpected as error:
            fault = str(error)
    elif fault is None:
        fault = "exit code %d" % code
    if values is None:
        tail = log.read_text(encoding="utf-8", errors="replace").strip().splitlines()[-5:] if log.exists() else []
        write(failed, {"command": job["command"], "fault": fault, "log": str(log), "tail": tail, "ended": time.time(), "seconds": round(time.time() - began, 3)})
        sys.exit("sweep: %s FAILED, %s: %s" % (job["name"], fault, shlex.join(job["command"])))
    write(folder / "rows" / (job["name"] + ".json"),
          {"target": plan["target"], "name": job["name"], "seed": job["seed"], "command": job["command"], "environment": job["environment"],
           "identity": plan["identity"], "host": platform.node(), "node": os.environ.get("SLURMD_NODENAME", ""), "began": began,
           "seconds": round(time.time() - began, 3), "values": values})
    failed.unlink(missing_ok=True)
    print("sweep: %s done, %.1f s" % (job["name"], time.time() - began), file=sys.stderr)


if __name__ == "__main__":
    main()
