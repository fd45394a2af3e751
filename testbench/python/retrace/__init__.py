"""Ray tracing with a kd-tree core for FPGAs, on NumPy arrays: the golden model in double precision and the fixed-point kernels of the core.

    scene = retrace.Scene.open("room:detail=0.3")          # a glTF file, or a generated scene
    image = scene.build()                                  # the memory image that every engine walks
    engine = image.engine("csim")                          # "golden", "csim", and "rtl" where it was built
    hits = engine.trace(retrace.rays(origins, directions)) # one record a ray
    picture = engine.render(640, 480).picture

Lengths are in the scene's own units, angles do not occur, times are in seconds. While an engine traces, other Python threads run; Ctrl-C stops it.
What goes wrong is an `Error` with the text that the program `retrace` prints.
"""
from __future__ import annotations

import json
import os
from dataclasses import dataclass
from typing import Any, Iterable, Literal, overload

import numpy as np
import numpy.typing as npt

from . import _retrace
from ._retrace import Error, UsageError, __version__

__all__ = ["AOVS", "HIT", "WORK", "Engine", "Error", "Image", "Picture", "Scene", "UsageError", "__version__", "engines", "lab", "rays"]

HIT = np.dtype([("t", "<f8"), ("mesh", "<i4"), ("primitive", "<i4"), ("triangle", "<i4"), ("node", "<i4"), ("u", "<f8"), ("v", "<f8")])
"""A hit, as `retrace trace` writes it. t counts in lengths of the ray's direction and is inf for a miss; mesh, primitive, triangle (within the primitive) and
node are indices of the scene's file, -1 for a miss; u and v are the barycentric coordinates of the triangle's second and third vertex."""

WORK = np.dtype([("down", "<u4"), ("up", "<u4"), ("leaf", "<u4"), ("tests", "<u4"), ("skipped", "<u4")])
"""The work of a ray: interior nodes visited on the way down, ancestors on the way up, leaves, triangle tests, and tests that the mailbox saved."""

AOVS: dict[str, str] = _retrace.aovs()
"""Images that `Engine.render` makes beside the picture, and what they hold."""

WayUp = Literal["stack", "parent", "face"]


def engines() -> list[str]:
    """Names of the engines that this build has."""
    return _retrace.engines()


def _numbers(array: npt.ArrayLike, name: str, columns: int, kinds: str, dtype: type) -> npt.NDArray[Any]:
    """An (N, columns) array of `dtype`; the caller's own memory if it has that type, whatever its strides."""
    given = np.asarray(array)
    if given.dtype.kind not in kinds and not (given.size == 0 and not isinstance(array, np.ndarray)):
        raise TypeError("%s: an array of %s, not of %s" % (name, "integers" if kinds == "iu" else "real numbers", given.dtype))
    if given.ndim != 2 or given.shape[1] != columns:
        if given.size == 0 and given.ndim == 1 and not isinstance(array, np.ndarray):  # []
            given = np.empty((0, columns), dtype)
        else:
            raise ValueError("%s: an array of shape (N, %d), not %s" % (name, columns, given.shape))
    if given.dtype == np.uint64 and dtype is np.int64 and given.size and given.max() > np.iinfo(np.int64).max:
        raise Error("%s: %d is no index" % (name, given.max()))
    given = given.astype(dtype, copy=False)
    # An array that lies across the words of memory, such as a field of packed records, is copied.
    if not given.flags.aligned or any(stride % given.itemsize for stride in given.strides):
        given = np.ascontiguousarray(given)
    return given


def rays(origins: npt.ArrayLike, directions: npt.ArrayLike, t_min: npt.ArrayLike = 0.0, t_max: npt.ArrayLike = np.inf) -> npt.NDArray[np.float64]:
    """Rays as `Engine.trace` takes them, float64 of shape (N, 8): origin, t_min, direction, t_max.

    origins and directions have the shape (N, 3), or (3,) for one that all rays share; t_min and t_max are numbers or have the shape (N,).
    Directions have any length but 0; t counts in their lengths, and hits with t_min <= t <= t_max count.
    """
    origins, directions = np.atleast_2d(np.asarray(origins, np.float64)), np.atleast_2d(np.asarray(directions, np.float64))
    for name, array in (("origins", origins), ("directions", directions)):
        if array.ndim != 2 or array.shape[1] != 3:
            raise ValueError("%s: an array of shape (N, 3), not %s" % (name, array.shape))
    count = np.broadcast_shapes(origins.shape, directions.shape)[0]
    result = np.empty((count, 8))
    result[:, 0:3], result[:, 3], result[:, 4:7], result[:, 7] = origins, t_min, directions, t_max
    return result


class Scene:
    """A scene on the grid of the number contract: `Scene.open` or `Scene.from_arrays`. It never changes."""

    _scene: _retrace.Scene

    def __init__(self, handle: _retrace.Scene):
        if not isinstance(handle, _retrace.Scene):
            raise TypeError("a scene is made by Scene.open or Scene.from_arrays")
        self._scene = handle

    @classmethod
    def open(cls, name: str | os.PathLike[str], *, two_level: Literal["off", "auto", "on"] = "off", textures: bool = True) -> Scene:
        """A glTF file (.gltf, .glb), or a generated scene such as "knot" or "room:detail=0.2,seed=3".

        two_level: whether instances stay instances, as the program's --two-level. textures: whether images are decoded; only `Engine.render` looks at them.
        """
        return cls(_retrace.open_scene(os.fspath(name), two_level, textures))

    @classmethod
    def from_arrays(cls, vertices: npt.ArrayLike, indices: npt.ArrayLike, name: str = "arrays") -> Scene:
        """Triangles from vertices of shape (V, 3), real numbers, and indices of shape (N, 3), integers below V.

        Vertices are held as float32, as in a glTF file. Triangle i of a hit is row i of `indices`.
        """
        return cls(_retrace.scene_from_arrays(_numbers(vertices, "vertices", 3, "fiu", np.float64), _numbers(indices, "indices", 3, "iu", np.int64), name))

    @property
    def name(self) -> str:
        """File name without folder and extension, or the generator's with its parameters."""
        return self._scene.name

    @property
    def notes(self) -> list[str]:
        """A line about each thing in the file that is left out."""
        return self._scene.notes

    @property
    def two_levels(self) -> bool:
        """Whether instances stay instances."""
        return self._scene.two_levels

    @property
    def degenerate(self) -> int:
        """Triangles without an area on the grid, which no ray hits."""
        return self._scene.degenerate

    @property
    def vertices(self) -> npt.NDArray[np.float64]:
        """World triangles, float64 of shape (N, 3, 3): triangle, vertex, axis. A read-only view of the scene's memory."""
        return self._scene.vertices

    @property
    def sources(self) -> npt.NDArray[np.uint32]:
        """Where each world triangle comes from, uint32 of shape (N, 4): node, mesh, primitive, triangle. A read-only view."""
        return self._scene.sources

    def build(self, *, split: Literal["sah", "spatial-median", "object-median"] = "sah", traversal_cost: float = 1.0, intersection_cost: float = 0.75,
              empty_bonus: float = 0.9, clip: bool = True, max_depth: int = 0, budget: float = 16.0, threads: int = 0) -> Image:
        """The kd-tree as a memory image (docs/memory-image.md).

        Costs are relative: of a step through an interior node and of a triangle test. empty_bonus multiplies the cost of a split that cuts off empty space;
        clip: a triangle counts as what of it lies in a cell, not as its bounding box; max_depth: 0 lets the builder choose; budget: splits, and duplicated
        references, in multiples of the number of triangles; threads: 0 takes all cores. The image does not depend on threads.
        """
        return Image(self._scene.build(split, traversal_cost, intersection_cost, empty_bonus, clip, max_depth, budget, threads), self)


class Image:
    """The memory image of a scene, as every engine sees it: `Scene.build` or `Image.load`."""

    scene: Scene

    def __init__(self, handle: _retrace.Image, scene: Scene):
        if not isinstance(handle, _retrace.Image):
            raise TypeError("an image is made by Scene.build or Image.load")
        self._image, self.scene = handle, scene

    @classmethod
    def load(cls, path: str | os.PathLike[str], scene: Scene) -> Image:
        """An image that `save` or `retrace pack` has written; it is checked completely. An engine refuses it if it was not built from `scene`."""
        return cls(_retrace.load_image(os.fspath(path)), scene)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes the image; the file appears whole or not at all."""
        self._image.save(os.fspath(path))

    @property
    def words(self) -> npt.NDArray[np.uint64]:
        """The image as it stands in memory, uint64 of shape (N,). A read-only view."""
        return self._image.words

    def statistics(self) -> dict[str, Any]:
        """What `retrace info --json` says of the image: nodes, leaves, references, depth, SAH cost, bytes, histograms."""
        return json.loads(self._image.statistics())

    def engine(self, kind: str = "golden") -> Engine:
        """An engine over this image, see `engines()`."""
        return Engine(self, kind)


@dataclass(frozen=True)
class Picture:
    """What `Engine.render` gives. H rows from the top, W pixels from the left."""

    color: npt.NDArray[np.float32]
    """Linear radiance and coverage, float32 of shape (H, W, 4); 0 where nothing is hit."""
    picture: npt.NDArray[np.float32]
    """As a screen shows it, float32 of shape (H, W, 3) in [0, 1]: exposure, tone map, sRGB."""
    aovs: dict[str, npt.NDArray[Any]]
    """By name, float32 of shape (H, W) or (H, W, 3); "id" is uint32. depth is in scene units along the viewing axis, inf where nothing is hit."""
    work: dict[str, dict[str, int]]
    """Rays and their work by kind: camera, shadow, occlusion."""
    exposure: float
    """Factor that `picture` is exposed with."""
    lights: str
    """What lit the scene."""


class Engine:
    """Rays in, hits out, over one image: "golden" (double precision), "csim" (the fixed-point HLS kernel) or "rtl" (the core, simulated, where it was built).

    Threads of Python may share an engine; their calls run one after the other.
    """

    image: Image

    def __init__(self, image: Image, kind: str = "golden"):
        self._engine, self.image = _retrace.Engine(image.scene._scene, image._image, kind), image

    @property
    def kind(self) -> str:
        """Its name."""
        return self._engine.kind

    @overload
    def trace(self, rays: npt.ArrayLike, *, any: bool = ..., work: Literal[False] = ..., out: npt.NDArray[Any] | None = ..., way_up: WayUp = ...,
              mailbox: int = ..., threads: int = ...) -> npt.NDArray[Any]: ...

    @overload
    def trace(self, rays: npt.ArrayLike, *, any: bool = ..., work: Literal[True], out: npt.NDArray[Any] | None = ..., way_up: WayUp = ...,
              mailbox: int = ..., threads: int = ...) -> tuple[npt.NDArray[Any], npt.NDArray[Any]]: ...

    def trace(self, rays, *, any=False, work=False, out=None, way_up="face", mailbox=0, threads=0):
        """The hits of rays: records of the dtype `HIT`, shape (N,); with work=True a pair with records of the dtype `WORK` as well.

        rays: shape (N, 8), see `rays()`. float64 is read where it stands, with any strides; other real numbers are converted.
        any: any hit will do (occlusion): t, triangle, u, v are those of the one that was found first. out: a C-contiguous array of N `HIT` to write to.
        way_up: how a walk goes up the tree (stack: golden only). mailbox: triangles that a ray remembers; 8 or 0, golden takes others. threads: 0 takes all
        cores. Hits do not depend on way_up, mailbox and threads. Ctrl-C raises KeyboardInterrupt; `out` is written in part then.
        """
        given = _numbers(rays, "rays", 8, "fiu", np.float64)
        if out is None:
            out = np.empty(len(given), HIT)
        elif not isinstance(out, np.ndarray) or out.dtype != HIT or out.shape != (len(given),):
            raise ValueError("out: an array of %d records of the dtype retrace.HIT" % len(given))
        elif not (out.flags.c_contiguous and out.flags.aligned and out.flags.writeable):
            raise ValueError("out: a contiguous, aligned array that can be written")
        if np.may_share_memory(out, given) and np.shares_memory(out, given):
            raise ValueError("out: lies over the rays")
        works = np.empty(len(given), WORK) if work else None
        self._engine.trace(given, out.view(np.uint8).reshape(len(given), HIT.itemsize),
                           None if works is None else works.view(np.uint8).reshape(len(given), WORK.itemsize), any, way_up, mailbox, threads)
        return out if works is None else (out, works)

    def report(self) -> dict[str, Any] | None:
        """Where the clocks of a core went so far: clocks, bytes, hit rates of its caches, units. None for engines that have none."""
        return self._engine.report()

    def render(self, width: int = 640, height: int = 480, *, spp: int = 4, shadows: bool = True, ao: int = 0, ao_distance: float | None = None,
               light_samples: int = 1, lights: Literal["auto", "scene", "rig"] = "auto", seed: int = 1, aovs: Iterable[str] = (), camera: str = "",
               way_up: WayUp = "face", mailbox: int = 0, threads: int = 0) -> Picture:
        """A picture of the scene, as `retrace render` makes it.

        width, height in pixels; spp: samples a pixel; ao: ambient occlusion rays a sample, ao_distance: their reach in scene units (None: a sixth of the
        scene); light_samples: shadow rays to emissive surfaces a sample; aovs: names of `AOVS`; camera: name or number in the file, "" takes the first, or a
        view of the whole scene.
        """
        names = [aovs] if isinstance(aovs, str) else list(aovs)
        return Picture(**self._engine.render(width, height, spp, shadows, ao, ao_distance, light_samples, lights, seed, names, camera, way_up, mailbox, threads))


def lab(scenes: str | Iterable[str], *, width: int = 192, height: int = 144, only: Iterable[str] = (), camera: str = "", threads: int = 0) -> list[dict[str, Any]]:
    """Acceleration structures side by side on the same rays, as `retrace lab`: a record a scene, structure, mailbox and kind of ray.

    scenes: as `Scene.open` takes them; width, height: of the camera rays; only: beginnings of the structures' keys, such as "kd-sah/".
    Each record has scene, triangles, key, structure, traversal, mailbox, build_s (processor seconds), image_bytes, kind (primary, shadow, bounce), rays, hits,
    different (rays with another hit than the reference structure), seconds, and per ray: down, up, leaf, visits, volumes, restarts, tests, skipped, bytes.
    """
    names = [scenes] if isinstance(scenes, str) else [os.fspath(scene) for scene in scenes]
    report = json.loads(_retrace.lab(names, width, height, [only] if isinstance(only, str) else list(only), camera, threads))
    records = []
    for scene in report["scenes"]:
        for row in scene["structures"]:
            for kind, result in row["rays"].items():
                records.append({"scene": scene["name"], "triangles": scene["triangles"],
                                **{name: row[name] for name in ("key", "structure", "traversal", "mailbox", "build_s")}, "image_bytes": row["bytes"]["total"],
                                "kind": kind, **{name: result[name] for name in ("rays", "hits", "different", "seconds")}, **result["per_ray"]})
    return records
