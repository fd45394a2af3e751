"""The module beside the program: the same hits, statistics, pictures and texts; threads, Ctrl-C, files; the README's example."""
import contextlib
import inspect
import io
import json
import os
import pathlib
import re
import signal
import subprocess
import threading
import time

import numpy as np
import pytest
import retrace

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
PROGRAM = os.environ["RETRACE_PROGRAM"]
KNOT = "knot:along=60,around=8"


def program(*arguments):
    return subprocess.run([PROGRAM, *map(str, arguments)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, check=False)


@pytest.fixture(scope="module")
def knot():
    return retrace.Scene.open(KNOT)


@pytest.fixture(scope="module")
def image(knot):
    return knot.build()


def random_rays(n):
    random = np.random.default_rng(int(os.environ["RETRACE_SEED"]))
    origins, targets = random.uniform(-3, 3, (2, n, 3))
    return retrace.rays(origins, targets - origins)


@pytest.mark.parametrize("kind", ["golden", "csim"])
def test_hits_are_the_programs(image, kind, tmp_path):
    rays = random_rays(3000)
    np.save(tmp_path / "rays.npy", rays)
    done = program("trace", KNOT, "-i", tmp_path / "rays.npy", "-o", tmp_path / "hits.npy", "-e", kind, "--stats", tmp_path / "stats.json", "--mailbox")
    assert done.returncode == 0, done.stderr
    hits, work = image.engine(kind).trace(rays, work=True, mailbox=8)
    assert np.load(tmp_path / "hits.npy").tobytes() == hits.tobytes() and np.load(tmp_path / "hits.npy").dtype == retrace.HIT
    counted = json.loads((tmp_path / "stats.json").read_text())["work"]
    assert {name: int(work[name].sum(dtype=np.uint64)) for name in retrace.WORK.names} == counted


def test_statistics_and_files(knot, image, tmp_path):
    assert program("pack", KNOT, "-o", tmp_path / "program.rtkd").returncode == 0
    image.save(tmp_path / "module.rtkd")
    assert (tmp_path / "program.rtkd").read_bytes() == (tmp_path / "module.rtkd").read_bytes() == image.words.tobytes()
    told = json.loads(program("info", tmp_path / "program.rtkd", "--json").stdout)
    told.pop("file")
    assert told == image.statistics()
    loaded = retrace.Image.load(tmp_path / "module.rtkd", knot)
    rays = random_rays(500)
    for kind in ("golden", "csim"):
        assert loaded.engine(kind).trace(rays).tobytes() == image.engine(kind).trace(rays).tobytes()
    for other in ("knot:along=60,around=9", "box"):
        with pytest.raises(retrace.Error, match="image and scene do not belong together"):
            retrace.Image.load(tmp_path / "module.rtkd", retrace.Scene.open(other)).engine("csim")
    damaged = bytearray((tmp_path / "module.rtkd").read_bytes())
    damaged[200] ^= 1
    (tmp_path / "damaged.rtkd").write_bytes(damaged)
    text = program("info", tmp_path / "damaged.rtkd").stderr.strip().removeprefix("retrace: error: ")
    with pytest.raises(retrace.Error, match="^" + re.escape(text) + "$"):
        retrace.Image.load(tmp_path / "damaged.rtkd", knot)
    with pytest.raises(retrace.Error, match="nowhere"):
        image.save(tmp_path / "nowhere" / "x.rtkd")


def test_texts_are_the_programs(image, tmp_path):
    (tmp_path / "bad.glb").write_bytes(b"glTF....")
    (tmp_path / "packed.rtkd").write_bytes(image.words.tobytes())
    for name in ("room:detail=99", "room:nothing=1", "nosuch", str(tmp_path), str(tmp_path / "bad.glb"), str(tmp_path / "packed.rtkd"), str(tmp_path / "gone.glb")):
        done = program("info", name)
        # (What is packed is no fault of info.)
        if name.endswith("packed.rtkd"):
            done = program("render", name, "-o", tmp_path / "x.png")
        with pytest.raises(retrace.Error) as raised:
            retrace.Scene.open(name)
        assert done.returncode == 1 and str(raised.value) == done.stderr.strip().removeprefix("retrace: error: "), name
    with pytest.raises(retrace.UsageError, match="there is no engine 'gold'; there are: golden, csim"):
        image.engine("gold")
    with pytest.raises(retrace.UsageError, match="engine csim has no stack"):
        image.engine("csim").trace(random_rays(1), way_up="stack")
    with pytest.raises(retrace.UsageError, match="there is no AOV 'z'; there are: depth"):
        image.engine().render(8, 8, aovs=["z"])
    with pytest.raises(retrace.Error, match="there is no camera"):
        image.engine().render(8, 8, camera="nosuch")
    assert issubclass(retrace.UsageError, retrace.Error)
    if "rtl" not in retrace.engines():
        with pytest.raises(retrace.UsageError, match="without engine rtl: install it with"):
            image.engine("rtl")


@pytest.mark.parametrize("call", [
    lambda image: image.scene.build(max_depth=193), lambda image: image.scene.build(traversal_cost=float("nan")), lambda image: image.scene.build(budget=-1.0),
    lambda image: image.scene.build(split="half"), lambda image: image.scene.build(threads=-1), lambda image: image.engine().trace(random_rays(1), threads=5000),
    lambda image: image.engine().trace(random_rays(1), mailbox=65), lambda image: image.engine("csim").trace(random_rays(1), mailbox=3),
    lambda image: image.engine().trace(random_rays(1), way_up="sideways"), lambda image: image.engine().render(8, 8, spp=0), lambda image: image.engine().render(8, 8, ao_distance=0.0),
    lambda image: image.engine().render(8, 8, lights="sun"), lambda image: image.engine().render(0, 8), lambda image: retrace.lab(KNOT, width=4),
    lambda image: retrace.lab(KNOT, only=["nosuch"]), lambda image: retrace.Scene.open(KNOT, two_level="maybe")])
def test_what_cannot_be_meant(image, call):
    with pytest.raises(retrace.Error):
        call(image)


@pytest.mark.parametrize("kind", ["golden", "csim"])
def test_pictures_are_the_programs(image, kind):
    got = image.engine(kind).render(48, 36, spp=2, ao=1, aovs=retrace.AOVS, seed=5)
    assert got.color.shape == (36, 48, 4) and got.color.dtype == np.float32 and got.picture.shape == (36, 48, 3)
    assert got.aovs["depth"].shape == (36, 48) and got.aovs["normal"].shape == (36, 48, 3) and got.aovs["id"].dtype == np.uint32
    covered = got.aovs["id"] != 2**32 - 1
    assert covered.any() and (np.isfinite(got.aovs["depth"]) == covered).all() and 0 <= got.picture.min() <= got.picture.max() <= 1
    np.testing.assert_array_equal(got.aovs["steps"], got.aovs["down"] + got.aovs["up"] + got.aovs["leaf"])
    again = image.engine(kind).render(48, 36, spp=2, ao=1, aovs=["depth"], seed=5, threads=1)
    np.testing.assert_array_equal(again.color, got.color)
    assert got.work["camera"]["rays"] == 48 * 36 * 2 and got.work["occlusion"]["rays"] > 0


def test_work_counters_of_pictures(image, tmp_path):
    done = program("render", KNOT, "-o", tmp_path / "x.exr", "--size", "32x24", "--spp", 2, "--seed", 3, "--stats", tmp_path / "stats.json")
    assert done.returncode == 0, done.stderr
    assert json.loads((tmp_path / "stats.json").read_text())["rays"] == image.engine().render(32, 24, spp=2, seed=3).work


def test_lab_records():
    records = retrace.lab(KNOT, width=16, height=12, only=["kd-sah/face-links", "bvh-sah"])
    told = json.loads(program("lab", KNOT, "--size", "16x12", "--only", "kd-sah/face-links", "--only", "bvh-sah", "--json", "-q").stdout)["scenes"][0]
    rows = [(row["key"], row["mailbox"], kind, result) for row in told["structures"] for kind, result in row["rays"].items()]
    assert len(records) == len(rows) > 6
    for record, (key, mailbox, kind, result) in zip(records, rows):
        assert (record["key"], record["mailbox"], record["kind"]) == (key, mailbox, kind) and record["different"] == 0
        assert record["hits"] == result["hits"] and record["tests"] == result["per_ray"]["tests"]


def test_threads_run_beside(image):
    """The lock is free while an engine traces, an engine is shared without harm, and results do not depend on it."""
    engine, rays = image.engine("csim"), random_rays(20000)
    expected = engine.trace(rays)
    results, ticks, stop = {}, [], threading.Event()

    def tick():
        while not stop.is_set():
            ticks.append(time.monotonic())
            time.sleep(0.001)

    ticker = threading.Thread(target=tick)
    workers = [threading.Thread(target=lambda i=i: results.update({i: engine.trace(rays, threads=1)})) for i in range(3)]
    ticker.start()
    began = time.monotonic()
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join()
    ended = time.monotonic()
    stop.set()
    ticker.join()
    assert all(result.tobytes() == expected.tobytes() for result in results.values()) and len(results) == 3
    assert sum(began < at < ended for at in ticks) >= 3  # one thread at a time would let none pass


INTERRUPTED = {
    "trace": "engine = retrace.Scene.open('box').build().engine('golden'); rays = np.broadcast_to(retrace.rays([0, 0, 9], [0.2, 0.1, -1]), (1 << 24, 8)); "
             "ready(); engine.trace(rays)",
    "render": "engine = retrace.Scene.open('box').build().engine('golden'); ready(); engine.render(2048, 2048, spp=64)",
    "build": "scene = retrace.Scene.open('sphere:cells=300'); ready(); scene.build(threads=1)",
    "lab": "ready(); retrace.lab('sphere:cells=60')",
}


@pytest.mark.parametrize("what", INTERRUPTED)
def test_interrupt(what):
    script = "import numpy as np, retrace\ndef ready(): print('ready', flush=True)\ntry:\n    %s\nexcept KeyboardInterrupt:\n    print('interrupted', retrace.engines()[0])\n" % INTERRUPTED[what]
    child = subprocess.Popen([os.sys.executable, "-c", script], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert child.stdout.readline() == "ready\n", child.stderr.read()
    time.sleep(0.2)
    child.send_signal(signal.SIGINT)
    out, errors = child.communicate(timeout=300)
    assert (out, child.returncode) == ("interrupted golden\n", 0), errors


def test_documentation():
    """Everything public says what it is, and the stub of the extension is there."""
    for name in retrace.__all__:
        thing = getattr(retrace, name)
        if inspect.isclass(thing):
            assert all(inspect.getdoc(member) for key, member in vars(thing).items() if not key.startswith("_") and (callable(member) or isinstance(member, property))), name
        if callable(thing):
            assert inspect.getdoc(thing), name
    folder = pathlib.Path(retrace.__file__).parent
    assert (folder / "py.typed").exists() and "def trace" in (folder / "_retrace.pyi").read_text()


def test_example_of_the_readme():
    code = re.search(r"^```python\n(.*?)^```", (ROOT / "README.md").read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)[1]
    assert len(code.strip().splitlines()) <= 10
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        exec(compile(code, "README.md", "exec"), {})
    assert re.fullmatch(r"20000 of 20000 rays hit; 20000 to the same triangle in both\n\(120, 160, 3\) [\d.]+\n", re.sub(r"; \d+ to", "; 20000 to", printed.getvalue())), printed.getvalue()
