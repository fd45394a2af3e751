#!/usr/bin/env python3
"""A sweep through Slurm gives the table that it gives on this machine, also when a node dies in the middle.

usage: tests/sweeps/slurm_test.py [--build DIR] [--seeds N] [--keep]

Starts a Slurm of its own (Debian: slurm-wlm, munge) with two nodes on this machine, ports above 17800, everything in a folder of its own; ends it afterwards. Needs
root, since slurmd runs jobs for others. Three runs of one sweep, each into a folder of its own: on this machine; through Slurm; through Slurm, where the processes of a
node are killed while it has a job. The tables must be equal in every byte, both nodes must have run jobs, and the job of the killed node must have run again.
"""
import argparse
import json
import os
import pathlib
import pwd
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
CONFIGURATION = """ClusterName=retrace
SlurmctldHost={host}(127.0.0.1)
AuthType=auth/munge
AuthInfo=socket={folder}/munge/socket
SlurmUser=root
SlurmdUser=root
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/%n
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/%n.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/%n.log
SlurmctldPort=17817
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
ReturnToService=2
SlurmdTimeout=20
MinJobAge=3600
NodeName=n1 NodeHostname={host} NodeAddr=127.0.0.1 Port=17821 CPUs=1 RealMemory=16000
NodeName=n2 NodeHostname={host} NodeAddr=127.0.0.1 Port=17822 CPUs=1 RealMemory=16000
PartitionName=p Nodes=n1,n2 Default=YES State=UP
"""


class Cluster:
    """Starts daemons in the foreground, as children, and kills exactly these."""

    def __init__(self, folder):
        self.folder, self.children = folder, {}
        (folder / "state").mkdir()
        for node in ("n1", "n2"):
            (folder / node).mkdir()
        # munged runs as the user that Debian made for it, with all its files in a folder of its own, which it asks to be safe.
        secrets, munge = folder / "munge", pwd.getpwnam("munge")
        secrets.mkdir(mode=0o755)
        key = secrets / "key"
        key.write_bytes(os.urandom(1024))
        key.chmod(0o400)
        for path in (secrets, key):
            os.chown(path, munge.pw_uid, munge.pw_gid)
        self.start("munged", ["munged", "--foreground", "--socket", secrets / "socket", "--key-file", key, "--pid-file", secrets / "pid", "--seed-file", secrets / "seed",
                              "--log-file", secrets / "log"], user=munge.pw_uid, group=munge.pw_gid)
        self.wait_for((secrets / "socket").exists, "munged")
        self.configuration = folder / "slurm.conf"
        self.configuration.write_text(CONFIGURATION.format(host=socket.gethostname().split(".")[0], folder=folder), encoding="utf-8")
        # Job steps find the configuration of a cluster in /etc/slurm; that of this one is elsewhere, and Snakemake's steps start without SLURM_CONF.
        (folder / "bin").mkdir()
        step = folder / "bin" / "srun"
        step.write_text("#!/bin/sh\nSLURM_CONF=%s exec %s \"$@\"\n" % (self.configuration, shutil.which("srun")), encoding="utf-8")
        step.chmod(0o755)
        self.environment = {**os.environ, "SLURM_CONF": str(self.configuration), "PATH": "%s:%s" % (folder / "bin", os.environ["PATH"])}
        self.start("slurmctld", ["slurmctld", "-D", "-f", self.configuration])
        for node in ("n1", "n2"):
            self.start_node(node)
        self.wait_for(lambda: sorted(self.ask("sinfo", "-h", "-N", "-o", "%N %t").split()) == ["idle", "idle", "n1", "n2"], "both nodes")

    def start(self, name, command, **options):
        with open(self.folder / (name + ".out"), "ab") as log:
            self.children[name] = subprocess.Popen([str(word) for word in command], stdin=subprocess.DEVNULL, stdout=log, stderr=log, start_new_session=True,
                                                   env={**os.environ, "SLURM_CONF": str(self.folder / "slurm.conf")}, **options)

    def start_node(self, node):
        self.start(node, ["slurmd", "-D", "-N", node, "-f", self.configuration])

    def ask(self, *command):
        return subprocess.run(command, env=self.environment, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, check=False, timeout=30).stdout

    def wait_for(self, condition, what, seconds=120):
        end = time.monotonic() + seconds
        while not condition():
            for name, child in self.children.items():
                if child.poll() is not None:
                    sys.exit("slurm_test: %s ended, see %s" % (name, self.folder / (name + ".out")))
            if time.monotonic() > end:
                sys.exit("slurm_test: waited %d s for %s, see %s" % (seconds, what, self.folder))
            time.sleep(0.2)

    def running(self, node):
        """Ids of the jobs that run on a node."""
        return self.ask("squeue", "-h", "-w", node, "-t", "RUNNING", "-o", "%A").split()

    def processes_below(self, pids):
        """These processes and all that descend from them, or were started for them with their node's name."""
        parents = {}
        for entry in pathlib.Path("/proc").iterdir():
            if entry.name.isdigit():
                try:
                    parents[int(entry.name)] = int((entry / "stat").read_text().rsplit(") ", 1)[1].split()[1])
                except OSError:
                    continue
        found = set(pids)
        while True:
            more = {pid for pid, parent in parents.items() if parent in found} - found
            if not more:
                return found
            found |= more

    def steps_of(self, job):
        """slurmstepd of a job: it lives on without its slurmd, and its parent is init."""
        found = set()
        for entry in pathlib.Path("/proc").iterdir():
            try:
                if entry.name.isdigit() and (entry / "cmdline").read_bytes().startswith(b"slurmstepd: [%s." % job.encode()) and \
                        str(self.configuration).encode() in (entry / "environ").read_bytes():
                    found.add(int(entry.name))
            except OSError:
                continue
        return found

    def kill_node(self, node, jobs):
        """As if the power had failed: the daemon and everything that runs for its jobs. Only processes that descend from this cluster."""
        doomed = self.processes_below({self.children[node].pid}.union(*(self.steps_of(job) for job in jobs)))
        child = self.children.pop(node)
        for pid in doomed:
            try:
                os.kill(pid, signal.SIGKILL)
            except ProcessLookupError:
                continue
        child.wait()
        return len(doomed)

    def stop(self):
        for job in self.ask("squeue", "-h", "-o", "%A").split():
            self.ask("scancel", job)
        for name in ("n1", "n2", "slurmctld", "munged"):
            child = self.children.pop(name, None)
            if child is not None:
                child.terminate()
                try:
                    child.wait(20)
                except subprocess.TimeoutExpired:
                    child.kill()
                    child.wait()


def sweep(arguments, output, environment, *more):
    return subprocess.Popen([sys.executable, str(ROOT / "scripts/sweep"), "stages", "--engine", "csim", "--size", arguments.size, "--seed", "7", "--seeds", str(arguments.seeds), "--build", str(arguments.build),
                             "--output", str(output), "--jobs", "2", *more], env=environment, stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True)


def finish(name, process):
    out, errors = process.communicate(timeout=1800)
    if process.returncode:
        sys.exit("slurm_test: the sweep %s ended with %d:\n%s%s" % (name, process.returncode, out, errors))


def results(output):
    """Table and rows of the one sweep in a folder."""
    tables = list(output.glob("*/*/table.md"))
    if len(tables) != 1:
        sys.exit("slurm_test: %d tables in %s" % (len(tables), output))
    rows = [json.loads(line) for line in tables[0].with_name("rows.jsonl").read_text(encoding="utf-8").splitlines()]
    return tables[0].read_bytes(), rows


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--build", type=pathlib.Path, default=pathlib.Path("build/release"))
    parser.add_argument("--size", default="default")
    parser.add_argument("--seeds", type=int, default=2, help="seeds a stage: seven jobs for each")
    parser.add_argument("--keep", action="store_true", help="leave the folder with the logs")
    arguments = parser.parse_args()
    if os.geteuid() != 0:
        print("slurm_test: needs root, since slurmd starts jobs for other users: skipped")
        return 77
    lacking = [tool for tool in ("munged", "slurmctld", "slurmd", "sbatch") if shutil.which(tool) is None]
    if lacking:
        print("slurm_test: there is no %s (Debian: slurm-wlm, munge): skipped" % ", ".join(lacking))
        return 77
    signal.signal(signal.SIGTERM, lambda number, _: sys.exit(128 + number))  # so that the daemons end as well
    folder = pathlib.Path(tempfile.mkdtemp(prefix="retrace-slurm-"))
    folder.chmod(0o755)
    cluster = process = None
    try:
        finish("on this machine", sweep(arguments, folder / "local", os.environ))
        print("slurm_test: done on this machine", flush=True)
        (folder / "cluster").mkdir()
        cluster = Cluster(folder / "cluster")
        finish("through Slurm", sweep(arguments, folder / "slurm", cluster.environment, "--slurm"))
        print("slurm_test: done through Slurm", flush=True)
        process = sweep(arguments, folder / "killed", cluster.environment, "--slurm")
        jobs = []

        def busy():
            jobs[:] = cluster.running("n2")
            # In the middle: rows are there, and the node works on another.
            return bool(jobs) and len(list((folder / "killed").glob("*/*/rows/*.json"))) >= 2

        cluster.wait_for(busy, "a job on node n2", 600)
        print("slurm_test: killed %d processes of node n2 with its job %s" % (cluster.kill_node("n2", jobs), ", ".join(jobs)), flush=True)
        cluster.wait_for(lambda: "down" in cluster.ask("sinfo", "-h", "-n", "n2", "-o", "%t"), "slurmctld to miss node n2", 300)
        again = cluster.ask("scontrol", "show", "job", jobs[0])
        cluster.start_node("n2")
        finish("with a killed node", process)
        again += cluster.ask("scontrol", "show", "job", jobs[0])
        if "Restarts=1" not in again:
            sys.exit("slurm_test: job %s of the killed node was not started again:\n%s" % (jobs[0], again))
        (local, _), (slurm, rows), (killed, killed_rows) = results(folder / "local"), results(folder / "slurm"), results(folder / "killed")
        nodes = {row["node"] for row in rows}
        if nodes != {"n1", "n2"}:
            sys.exit("slurm_test: jobs ran on %s only" % sorted(nodes))
        if not local == slurm == killed:
            sys.exit("slurm_test: the tables differ, see %s" % folder)
        print("slurm_test: %d jobs; tables equal on this machine, through Slurm on %s, and with node n2 killed (job %s ran again)" % (
            len(killed_rows), " and ".join(sorted(nodes)), jobs[0]))
        return 0
    except SystemExit:
        arguments.keep = True
        raise
    finally:
        if process is not None and process.poll() is None:
            process.terminate()
            process.wait()
        if cluster is not None:
            cluster.stop()
        if not arguments.keep:
            shutil.rmtree(folder, ignore_errors=True)


if __name__ == "__main__":
    sys.exit(main())
