"""The targets of scripts/sweep: which jobs there are for a size, what their output means, and the table of their values.

A job is one command, with its seed in its name. What a job gives (`values`: one or more records) does not depend on when, where and beside what it ran, so
that tables can be compared; times are in the row beside the values.
"""
import hashlib
import json
import pathlib
import re
import subprocess
import sys
import tomllib

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
STAGES = ("ray_setup", "kd_descend", "leaf_exit", "kd_backtrack", "tri_test", "hit_finish", "instance_enter")
ENGINE = "/usr/share/assimp/models/glTF2/2CylinderEngine-glTF-Binary/2CylinderEngine.glb"
CORE = tomllib.loads((ROOT / "rtl/targets/core.toml").read_text(encoding="utf-8"))
SIZES = ("quick", "default", "night")
NIGHT = tomllib.loads((pathlib.Path(__file__).resolve().parent / "night.toml").read_text(encoding="utf-8"))


class Unexpected(Exception):
    """What a command printed is not what it prints when all is well."""


def job(name, command, seed, threads=1, mem_mb=2000, minutes=60, **environment):
    return {"name": re.sub(r"[^\w.=-]+", "-", "%s-seed%d" % (name, seed)), "command": [str(word) for word in command], "seed": seed, "threads": threads,
            "mem_mb": mem_mb, "minutes": minutes, "environment": environment}


def scene_name(scene):
    """Of a file or of a generated scene, without its folder, suffix and parameters."""
    return pathlib.Path(scene.partition(":")[0]).stem


def search(pattern, text, what):
    found = re.search(pattern, text, re.MULTILINE)
    if not found:
        raise Unexpected("no %s in what it printed" % what)
    return found


def markdown(records, columns):
    """A table of records; columns: (key, heading, format)."""
    lines = ["| %s |" % " | ".join(heading for _, heading, _ in columns), "|%s" % ("---|" * len(columns))]
    for record in records:
        lines.append("| %s |" % " | ".join("-" if record.get(key) is None else form % record[key] for key, _, form in columns))
    return "\n".join(lines) + "\n"


def by_scene(records):
    scenes = {}
    for record in records:
        scenes.setdefault(record["scene"], []).append(record)
    return scenes


def pareto(records, cost):
    """Of the records of one scene those that no other beats: no more cost and no more clocks, and less of one."""
    return [a for a in records if not any(b[cost] <= a[cost] and b["clocks"] <= a["clocks"] and (b[cost] < a[cost] or b["clocks"] < a["clocks"]) for b in records)]


def plotter():
    """matplotlib.pyplot; the same records make the same bytes."""
    import matplotlib
    matplotlib.use("svg")
    matplotlib.rcParams.update({"svg.hashsalt": "retrace", "font.size": 9})
    import matplotlib.pyplot
    return matplotlib.pyplot


class Target:
    """options: .size, .engine, .build and .folder, .seed (the first), .seeds (how many, None: the size's), .scene (animation), .list."""
    summary = ""
    folders = ()  # in the sweep's folder, for what jobs write beside their rows

    def programs(self, options):
        """Those of the build folder that the jobs run: rows are of these programs only."""
        return []

    def jobs(self, options):
        raise NotImplementedError

    def values(self, job_, output):
        raise NotImplementedError

    def table(self, records):
        return markdown(records, self.columns)

    def trend(self, records):
        """Figures by name that are worth following from night to night."""
        return {}

    def drawn(self, records):
        """Whether `draw(records, path)` makes a picture of them."""
        return False


class Stages(Target):
    summary = "vectors through every stage: the RTL against the kernels; with --engine csim the kernels against plain integers"
    columns = [("stage", "stage", "%s"), ("vectors", "vectors", "%d"), ("seed", "seed", "%d"), ("differ", "differ", "%d")]

    def programs(self, options):
        return ["testbench/csim/tb_stages" if options.engine == "csim" else "testbench/stages/rtl_stages"]

    def jobs(self, options):
        # Vectors a job, jobs a stage: 10^9 vectors over all stages by night.
        vectors, seeds = {"quick": (20000, 3), "default": (1000000, 4), "night": (7200000, 20)}[options.size]
        program = options.build / self.programs(options)[0]
        jobs = []
        for stage in STAGES:
            for seed in range(options.seed, options.seed + (options.seeds or seeds)):
                command = [program, vectors, seed, stage] if options.engine == "csim" else [program, "--stage", stage, "--vectors", vectors, "--seed", seed, "--threads", 1]
                jobs.append(job("stages-%s-%s" % (options.engine, stage), command, seed))
        return jobs

    def values(self, job_, output):
        if job_["name"].startswith("stages-csim"):
            found = search(r"^(\w+) +(\d+) vectors, seed (\d+), (\d+) differ", output, "line about the stage")
            return [{"stage": found[1], "vectors": int(found[2]), "seed": int(found[3]), "differ": int(found[4])}]
        found = search(r"^(\w+) +(\d+) vectors", output, "line about the stage")
        return [{"stage": found[1], "vectors": int(found[2]), "seed": job_["seed"], "differ": 0}]  # exit code 0: none does


class Frames(Target):
    summary = "whole frames: the core against the kernel, scenes x configurations x ways up x kinds of ray; with --engine csim kernels against golden"
    columns = [("scene", "scene", "%s"), ("rays", "rays", "%s"), ("configuration", "configuration", "%s"), ("up", "way up", "%s"), ("traced", "rays traced", "%d"),
               ("differ", "hits that differ", "%d"), ("clocks", "clocks a ray", "%.2f")]

    def programs(self, options):
        return ["testbench/program/retrace" if options.engine == "csim" else "testbench/sim/core/rtl_bench"]

    def jobs(self, options):
        scenes = ["room:detail=0.05", "knot:along=60,around=8", "coincident", "none"] if options.size == "quick" else \
            ["room", "knot", ENGINE, "needles", "slivers", "coincident", "degenerate", "one", "none"]
        size = {"quick": "48x36", "default": "160x120", "night": "320x240"}[options.size]
        seed, program, jobs = options.seed, options.build / self.programs(options)[0], []
        if options.engine == "csim":
            return [job("frames-csim-%s" % scene_name(scene), [program, "compare", scene, "--engines", "golden,csim", "--size", size, "--quiet"], seed) for scene in scenes]
        configurations = [name for name, fields in CORE["configuration"].items() if "frames" in fields["verified"]]
        for scene in scenes:
            for rays in ("primary", "shadow"):
                for configuration in configurations:
                    for up in ("face", "parent"):
                        jobs.append(job("frames-%s-%s-%s-%s" % (scene_name(scene), rays, configuration, up),
                                        [program, scene, configuration, size, "--latency", "1-200", "--reorder", 1, "--stall", 20, "--up", up, "--shadow", int(rays == "shadow"), "--seed", seed],
                                        seed, minutes=600))
        return jobs

    def values(self, job_, output):
        if job_["name"].startswith("frames-csim"):
            search(r"^0 violations$", output, "'0 violations'")
            rays = sum(int(text.replace(",", "")) for text in re.findall(r"rays, golden against csim: ([\d,]+)", output))
            return [{"scene": scene_name(job_["command"][2]), "rays": "primary, shadow", "configuration": "csim", "up": "face", "traced": rays, "differ": 0, "clocks": None}]
        found = search(r": (\d+) rays, (\d+) differ from csim", output, "comparison")
        clocks = search(r"^ *([0-9.]+) clocks/ray", output, "clocks a ray")
        command = job_["command"]
        return [{"scene": scene_name(command[1]), "rays": "shadow" if command[command.index("--shadow") + 1] == "1" else "primary", "configuration": command[2],
                 "up": command[command.index("--up") + 1], "traced": int(found[1]), "differ": int(found[2]), "clocks": float(clocks[1])}]

    def trend(self, records):
        by_configuration = {}
        for record in records:
            if record["clocks"] is not None and record["traced"]:
                by_configuration.setdefault(record["configuration"], []).append((record["clocks"], record["traced"]))
        return {"clocks a ray, " + name: sum(clocks * rays for clocks, rays in pairs) / sum(rays for _, rays in pairs) for name, pairs in by_configuration.items()}


class Mutants(Target):
    summary = "mutants of the RTL, a job a file of their own (those of the whole core: one for each configuration); every one must be caught"
    columns = [("mutant", "mutant", "%s"), ("verdict", "verdict", "%s"), ("tests", "caught by", "%s")]

    def jobs(self, options):
        listed = subprocess.run([sys.executable, "scripts/mutants.py", "--list"], cwd=ROOT, stdout=subprocess.PIPE, text=True, check=True).stdout.splitlines()
        core = subprocess.run([sys.executable, "scripts/mutants.py", "--list", "--core"], cwd=ROOT, stdout=subprocess.PIPE, text=True, check=True).stdout.splitlines()
        files = list(dict.fromkeys(line.rsplit(" ", 1)[1] for line in listed if line not in core))
        common = ["python3", "scripts/mutants.py", "--build", options.build, "--jobs", 1, "--vectors", {"quick": 20000, "default": 200000, "night": 1000000}[options.size]]
        jobs = [job("mutants-%s" % pathlib.Path(file).stem, [*common, "--only", file], options.seed, mem_mb=4000, minutes=240, RETRACE_SEED=str(options.seed)) for file in files]
        if options.size != "quick":
            jobs += [job("mutants-core-%s" % configuration, [*common, "--core", "--config", configuration], options.seed, mem_mb=8000, minutes=600, RETRACE_SEED=str(options.seed))
                     for configuration in ("small", "saarcor")]
        return jobs

    def values(self, job_, output):
        found = re.findall(r"^(caught|SURVIVED) +(.*?) +[\d.]+ s  (.*)$", output, re.MULTILINE)
        if not found:
            raise Unexpected("no mutant in what it printed")
        return [{"mutant": name, "verdict": verdict, "tests": tests} for verdict, name, tests in found]


class Seeds(Target):
    summary = "place and route: configurations x seeds of the placer; the best of each configuration is marked"
    folders = ("reports", "routed")
    columns = [("configuration", "configuration", "%s"), ("seed", "seed", "%d"), ("mhz", "MHz", "%.1f"), ("luts", "LUTs", "%d"), ("brams", "block RAMs", "%d"), ("best", "", "%s")]

    def jobs(self, options):
        configurations = ["ecp5l1"] if options.size == "quick" else [name for name, fields in CORE["configuration"].items() if "routed" in fields["verified"]]
        seeds = {"quick": 2, "default": 4, "night": 16}[options.size]
        jobs = []
        for configuration in configurations:
            for seed in range(options.seed, options.seed + (options.seeds or seeds)):
                report = options.folder / "reports" / ("%s-seed%d.json" % (configuration, seed))
                jobs.append(job("seeds-" + configuration, ["scripts/bitstream", "--config", configuration, "--seeds", seed, "--report", report,
                                                           "--build", options.folder / "routed" / ("%s-seed%d" % (configuration, seed))], seed, mem_mb=8000, minutes=600))
        return jobs

    def values(self, job_, output):
        report = job_["command"][job_["command"].index("--report") + 1]
        try:
            found = json.loads((ROOT / report).read_text(encoding="utf-8"))
            cells = found["cells"]
            return [{"configuration": job_["command"][2], "seed": job_["seed"], "mhz": found["fmax_mhz"], "luts": cells["luts"], "brams": cells["block_rams"]}]
        except (OSError, ValueError, KeyError) as error:
            raise Unexpected("%s is no report: %r" % (report, error)) from error

    def best(self, records):
        best = {}
        for record in records:
            name = record["configuration"]
            best[name] = max(best.get(name, 0), record["mhz"])
        return best

    def trend(self, records):
        return {"MHz, best of " + name: mhz for name, mhz in self.best(records).items()}

    def table(self, records):
        best = self.best(records)
        return markdown([{**record, "best": "best" if record["mhz"] == best[record["configuration"]] else ""} for record in records], self.columns)


class Explore(Target):
    """Not the core itself but the lab's model of it: the kernel's walk over the memory image through one cache that all rays in flight share."""
    summary = "caches x rays in flight x mailbox on two scenes: clocks a ray against block RAMs, with the Pareto front drawn"
    KB = (4, 8, 16, 32, 64, 128)
    CONTEXTS = (4, 16, 64)
    RAM_BYTES = 2048  # data of one block RAM of an ECP5 (DP16KD)
    LINE = 64
    BUS, LATENCY = 8, 40  # bytes a clock, clocks
    columns = [("scene", "scene", "%s"), ("cache_kb", "cache KB", "%d"), ("contexts", "rays in flight", "%d"), ("mailbox", "mailbox", "%d"),
               ("block_rams", "block RAMs", "%d"), ("clocks", "clocks a ray at least", "%.2f"), ("limit", "limit", "%s"), ("bytes", "bytes a ray from memory", "%.0f"), ("hit_rate", "hit rate", "%.4f"), ("steps", "steps a ray", "%.2f"),
               ("tests", "tests a ray", "%.2f"), ("front", "", "%s")]

    def programs(self, options):
        return ["testbench/program/retrace"]

    def jobs(self, options):
        scenes = ["knot:along=60,around=8", "room:detail=0.05"] if options.size == "quick" else ["knot", "room"]
        size = {"quick": "24x16", "default": "96x72", "night": "192x144"}[options.size]
        return [job("explore-%s-contexts%d" % (scene_name(scene), contexts),
                    [options.build / self.programs(options)[0], "lab", scene, "--only", "kd-sah/face-links", "--size", size, "--caches", ",".join(map(str, self.KB)),
                     "--contexts", contexts, "--threads", 1, "--json", "--quiet"], options.seed)
                for scene in scenes for contexts in self.CONTEXTS]

    def values(self, job_, output):
        try:
            report = json.loads(output)
        except ValueError as error:
            raise Unexpected("no JSON: %s" % error) from error
        if report["differences"]:
            raise Unexpected("%d rays differ" % report["differences"])
        values = []
        for scene in report["scenes"]:
            for row in scene["structures"]:
                kinds = row["rays"].values()
                if row["mailbox"] not in (0, 8):
                    continue
                rays = sum(kind["rays"] for kind in kinds)
                mean = lambda name: round(sum(kind["per_ray"][name] * kind["rays"] for kind in kinds) / rays, 6)
                for place, cache in enumerate(report["caches"]):
                    accesses, misses = (sum(kind["caches"][place][name] for kind in kinds) for name in ("accesses", "misses"))
                    values.append({"scene": scene["name"], "cache_kb": cache["bytes"] // 1024, "contexts": report["contexts"], "mailbox": row["mailbox"],
                                   "block_rams": cache["bytes"] // self.RAM_BYTES + self.state_rams(report["contexts"], row["mailbox"]),
                                   **self.clocks(mean("visits") + mean("tests"), misses / rays, report["contexts"]),
                                   "bytes": round(self.LINE * misses / rays, 3), "hit_rate": round(1 - misses / accesses, 6), "steps": mean("visits"), "tests": mean("tests")})
        return values

    def clocks(self, steps, misses, contexts):
        """What a ray costs at least: one step or test a clock, the bus, or waiting for memory with so many rays in flight; and which of them it is."""
        bounds = {"steps": steps, "bus": misses * self.LINE / self.BUS, "latency": misses * self.LATENCY / contexts}
        limit = max(bounds, key=bounds.get)
        return {"clocks": round(bounds[limit], 4), "limit": limit}

    def state_rams(self, contexts, mailbox):
        """Block RAMs of what the core keeps of a ray in flight: ray, hit and place, 64 bytes, and 4 for each triangle that it remembers."""
        return -(-contexts * (64 + 4 * mailbox) // self.RAM_BYTES)

    def drawn(self, records):
        return True

    def table(self, records):
        marked = []
        for of_scene in by_scene(records).values():
            front = pareto(of_scene, "block_rams")
            marked += [{**record, "front": "front" if record in front else ""} for record in sorted(of_scene, key=lambda r: (r["block_rams"], r["clocks"], r["contexts"]))]
        return markdown(marked, self.columns)

    def draw(self, records, path):
        plt = plotter()
        scenes = by_scene(records)
        figure, axes = plt.subplots(1, len(scenes), figsize=(5 * len(scenes), 4.2), squeeze=False, layout="constrained")
        markers = dict(zip(self.CONTEXTS, "osD"))
        for axis, (scene, of_scene) in zip(axes[0], scenes.items()):
            for mailbox, colour in ((0, "#b0762b"), (8, "#2b6cb0")):
                for contexts, marker in markers.items():
                    some = [r for r in of_scene if r["mailbox"] == mailbox and r["contexts"] == contexts]
                    axis.plot([r["block_rams"] for r in some], [r["clocks"] for r in some], marker, color=colour, markersize=5, alpha=0.75, linestyle="none",
                              label="%d rays in flight, %s" % (contexts, "mailbox of 8" if mailbox else "no mailbox"))
            front = sorted(pareto(of_scene, "block_rams"), key=lambda r: r["block_rams"])
            axis.step([r["block_rams"] for r in front], [r["clocks"] for r in front], where="post", color="#333333", linewidth=1.2, label="Pareto front", zorder=1)
            axis.set(xscale="log", yscale="log", xlabel="block RAMs: cache and rays in flight", ylabel="clocks a ray at least", title=scene)
            axis.grid(True, which="both", linewidth=0.3, alpha=0.6)
        axes[0][0].legend(fontsize=7)
        figure.savefig(path, format="svg", metadata={"Date": None})
        plt.close(figure)


class Cores(Target):
    """Cores themselves. A job that simulates gives clocks, one that synthesizes gives cells; the table joins them."""
    summary = "the core's configurations that the build has, on two scenes: clocks and bytes a ray in simulation, block RAMs and LUT sites after synthesis (not --size quick), with the front drawn"
    folders = ("synthesis",)
    columns = [("scene", "scene", "%s"), ("configuration", "configuration", "%s"), ("lanes", "lanes", "%d"), ("contexts", "rays in flight", "%d"), ("block_rams", "block RAMs", "%d"),
               ("sites", "LUT sites", "%d"), ("clocks", "clocks a ray", "%.2f"), ("read", "bytes a ray read", "%.1f"), ("written", "written", "%.1f"), ("front", "", "%s")]

    def programs(self, options):
        return ["testbench/sim/core/rtl_bench"]

    @staticmethod
    def fields(configuration):
        return {**CORE["defaults"], **CORE["configuration"][configuration]}

    def jobs(self, options):
        try:
            built = re.search(r"^RETRACE_RTL_CONFIGS:\w+=(.*)$", (ROOT / options.build / "CMakeCache.txt").read_text(encoding="utf-8"), re.MULTILINE)[1].split(";")
        except (OSError, TypeError):
            built = list(CORE["configuration"])
        configurations = [name for name in CORE["configuration"] if name in built and self.fields(name)["levels"] == 1 and not self.fields(name)["pixels"]]
        scenes = ["knot:along=60,around=8", "room:detail=0.05"] if options.size == "quick" else ["knot", "room"]
        size = {"quick": "48x36", "default": "160x120", "night": "320x240"}[options.size]
        jobs = [job("cores-%s-%s" % (configuration, scene_name(scene)), [options.build / self.programs(options)[0], scene, configuration, size, "--seed", options.seed], options.seed,
                    minutes=600) for scene in scenes for configuration in configurations]
        if options.size != "quick":
            jobs += [job("cores-%s-cells" % configuration, ["scripts/bitstream", "--config", configuration, "--synthesis", "--build", options.folder / "synthesis"], options.seed,
                         mem_mb=6000, minutes=600) for configuration in configurations]
        return jobs

    def values(self, job_, output):
        command = job_["command"]
        if command[0] == "scripts/bitstream":
            try:
                found = json.loads(output)
                return [{"configuration": command[2], "sites": found["sites"], "block_rams": found["cells"]["block_rams"]}]
            except (ValueError, KeyError, TypeError) as error:
                raise Unexpected("no cells in what it printed: %r" % error) from error
        search(r": \d+ rays, 0 differ from csim", output, "'0 differ from csim'")
        clocks = search(r"^ *([0-9.]+) clocks/ray", output, "clocks a ray")
        moved = search(r"^ *bytes/ray read ([0-9.]+) written ([0-9.]+)", output, "bytes a ray")
        fields = self.fields(command[2])
        return [{"scene": scene_name(command[1]), "configuration": command[2], "lanes": fields["lanes"], "contexts": fields["lanes"] * fields["contexts_per_lane"],
                 "clocks": float(clocks[1]), "read": float(moved[1]), "written": float(moved[2])}]

    def joined(self, records):
        """A record a scene and configuration, with cells where they are known, the smallest first; the front is marked."""
        cells = {record["configuration"]: record for record in records if "sites" in record}
        joined = [{**record, **cells.get(record["configuration"], {})} for record in records if "clocks" in record]
        marked = []
        for of_scene in by_scene(joined).values():
            front = pareto([record for record in of_scene if "sites" in record], "sites")
            marked += [{**record, "front": "front" if record in front else ""} for record in sorted(of_scene, key=lambda record: (record.get("sites", 0), record["clocks"]))]
        return marked

    def drawn(self, records):
        return any("sites" in record for record in self.joined(records))

    def table(self, records):
        return markdown(self.joined(records), self.columns)

    def trend(self, records):
        return {"clocks a ray, %s, %s" % (record["configuration"], record["scene"]): record["clocks"] for record in self.joined(records)}

    def draw(self, records, path):
        plt = plotter()
        scenes = by_scene([record for record in self.joined(records) if "sites" in record])
        figure, axes = plt.subplots(1, len(scenes), figsize=(5 * len(scenes), 4.2), squeeze=False, layout="constrained")
        for axis, (scene, of_scene) in zip(axes[0], scenes.items()):
            axis.plot([record["sites"] for record in of_scene], [record["clocks"] for record in of_scene], "o", color="#2b6cb0", markersize=5)
            for record in of_scene:
                axis.annotate("%s, %d RAMs" % (record["configuration"], record["block_rams"]), (record["sites"], record["clocks"]), xytext=(4, 4), textcoords="offset points", fontsize=7)
            front = [record for record in of_scene if record["front"]]
            axis.step([record["sites"] for record in front], [record["clocks"] for record in front], where="post", color="#333333", linewidth=1.2, zorder=1)
            axis.set(xlabel="LUT sites after synthesis", ylabel="clocks a ray in simulation", title=scene)
            axis.grid(True, linewidth=0.3, alpha=0.6)
            axis.margins(x=0.3, y=0.1)
        figure.savefig(path, format="svg", metadata={"Date": None})
        plt.close(figure)


class Animation(Target):
    summary = "frames of one animated scene (--scene FILE; default: the generated carousel), a job a frame; pictures in the sweep's folder"
    folders = ("pictures",)
    columns = [("frame", "frame", "%d"), ("time", "time s", "%.4f"), ("sha256", "SHA-256 of the picture", "`%s`")]

    def programs(self, options):
        return ["testbench/program/retrace"]

    def jobs(self, options):
        scene = options.scene
        if scene is None:
            scene = options.folder / "carousel.glb"
            if not options.list and not scene.exists():
                scene.parent.mkdir(parents=True, exist_ok=True)
                subprocess.run([ROOT / options.build / self.programs(options)[0], "make-scene", "carousel", "-o", scene, "--quiet"], check=True, stdout=subprocess.DEVNULL)
        frames, size = {"quick": (3, "32x24"), "default": (24, "320x240"), "night": (96, "640x480")}[options.size]
        jobs = []
        for frame in range(frames):
            picture = options.folder / "pictures" / ("frame-%04d-#.png" % frame)
            jobs.append(job("animation-frame%04d" % frame, [options.build / self.programs(options)[0], "render", scene, "-o", picture, "--engine", options.engine, "--size", size, "--animation",
                                                            "--structure", "one-tree", "--full-rebuild", "never", "--no-video", "--frames", 1, "--start", "%.6f" % (frame / 24),
                                                            "--seed", options.seed, "--threads", 1, "--quiet"], options.seed))
        return jobs

    def values(self, job_, output):
        command = job_["command"]
        picture = pathlib.Path(command[command.index("-o") + 1].replace("#", "0"))
        try:
            digest = hashlib.sha256(picture.read_bytes()).hexdigest()
        except OSError as error:
            raise Unexpected("no picture: %s" % error) from error
        return [{"frame": int(re.search(r"frame(\d+)", job_["name"])[1]), "time": float(command[command.index("--start") + 1]), "sha256": digest}]


class Night(Target):
    summary = "the long runs of scripts/sweeps/night.toml that are one command each; scripts/nightly runs them and the sweeps"
    columns = [("run", "run", "%s"), ("what", "what", "%s"), ("verdict", "verdict", "%s")]
    runs = {name: run for name, run in NIGHT["run"].items() if "command" in run}

    def programs(self, options):
        return sorted({program for run in self.runs.values() for program in re.findall(r"\$RETRACE_BUILD/([\w./-]+)", run["command"])})

    def jobs(self, options):
        environment = {"RETRACE_BUILD": str(options.build), "RETRACE_OUT": str(options.folder), "RETRACE_SEED": str(options.seed)}
        return [job("night-" + name, ["bash", "-euo", "pipefail", "-c", run["command"].strip()], options.seed, threads=run.get("threads", 1), mem_mb=4000,
                    minutes=run.get("minutes", 600), **environment) for name, run in self.runs.items()]

    def values(self, job_, output):
        name = self.name_of(job_)
        return [{"run": name, "what": self.runs[name]["what"], "verdict": "passed"}]  # exit code 0

    @staticmethod
    def name_of(job_):
        return re.fullmatch(r"night-(.*)-seed\d+", job_["name"])[1]


TARGETS = {"stages": Stages(), "frames": Frames(), "mutants": Mutants(), "seeds": Seeds(), "explore": Explore(), "cores": Cores(), "animation": Animation(), "night": Night()}
