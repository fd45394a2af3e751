"""Arrays on their way in and out: strides, types, shapes, empty and read-only ones; what is copied and what is not; errors with the program's texts."""
import gc
import math

import numpy as np
import pytest
import retrace

SQUARE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float), np.array([[0, 1, 2], [0, 2, 3]])


@pytest.fixture(scope="module")
def square():
    return retrace.Scene.from_arrays(*SQUARE, name="square")


@pytest.fixture(scope="module", params=["golden", "csim"])
def engine(request, square):
    return square.build().engine(request.param)


def downwards(n):
    """Rays onto the square, at n places along its diagonal, off the edge between its triangles."""
    along = (np.arange(n) + 0.5) / max(n, 1)
    return retrace.rays(np.stack([along, along * 0.5, np.full(n, 2.0)], axis=1), [0, 0, -1])


def same(a, b):
    return a.dtype == b.dtype and a.shape == b.shape and a.tobytes() == b.tobytes()


def test_hits_are_those_of_geometry(engine):
    rays = downwards(8)
    hits = engine.trace(rays)
    assert hits.dtype == retrace.HIT and hits.shape == (8,)
    np.testing.assert_allclose(hits["t"], 2.0, rtol=0, atol=1e-5)
    assert set(hits["triangle"]) == {0} and set(hits["node"]) == {0}
    # u and v belong to vertices 1 and 2: x = u + v, y = v.
    np.testing.assert_allclose(hits["u"] + hits["v"], rays[:, 0], atol=1e-4)
    np.testing.assert_allclose(hits["v"], rays[:, 1], atol=1e-4)


def test_misses(engine):
    hits = engine.trace(retrace.rays([5, 5, 5], [0, 0, 1]))
    assert math.isinf(hits["t"][0]) and hits["triangle"][0] == hits["node"][0] == hits["mesh"][0] == -1 and hits["u"][0] == 0


def test_strides(engine):
    rays = downwards(64)
    expected = engine.trace(rays)
    wide = np.zeros((64, 20))
    wide[:, 3:11] = rays
    for strided in (np.asfortranarray(rays), wide[:, 3:11], np.repeat(rays, 3, axis=0)[::3], rays[::-1][::-1], np.broadcast_to(rays[5], (64, 8))):
        got = engine.trace(strided)
        assert same(got, expected if not np.array_equal(strided[0], rays[5]) else np.repeat(expected[5:6], 64))
    assert same(engine.trace(rays[::-1]), expected[::-1])
    packed = np.zeros(64, np.dtype([("pad", "u1"), ("ray", "f8", 8)]))  # lies across the words of memory
    packed["ray"] = rays
    assert same(engine.trace(packed["ray"]), expected)


def test_types_of_numbers(engine):
    rays = downwards(16)
    rays[:, :3] = np.round(rays[:, :3] * 64) / 64
    expected = engine.trace(rays)
    for dtype in (np.float32, np.float16, np.longdouble, ">f8"):
        assert same(engine.trace(rays.astype(dtype)), expected)
    assert same(engine.trace(rays.tolist()), expected)
    whole = np.array([[0, 0, 2, 0, 0, 0, -1, 9]])
    assert engine.trace(whole)["triangle"] == engine.trace(whole.astype(float))["triangle"]
    for dtype in (complex, bool, object, "U8", "M8[s]"):
        with pytest.raises(TypeError, match="rays: an array of real numbers, not of"):
            engine.trace(np.ones((2, 8)).astype(dtype))


def test_shapes(engine):
    for shape in ((8,), (2, 7), (2, 9), (2, 2, 8), (0, 7), ()):
        with pytest.raises(ValueError, match=r"rays: an array of shape \(N, 8\), not"):
            engine.trace(np.zeros(shape))
    for empty in (np.zeros((0, 8)), []):
        hits, work = engine.trace(empty, work=True)
        assert hits.shape == work.shape == (0,)


def test_read_only_rays(engine):
    rays = downwards(4)
    rays.flags.writeable = False
    assert len(engine.trace(rays)) == 4


def test_out(engine):
    rays, out = downwards(32), np.zeros(32, retrace.HIT)
    assert engine.trace(rays, out=out) is out and same(out, engine.trace(rays))
    two = np.zeros(64, retrace.HIT)
    assert engine.trace(rays, out=two[16:48]).base is two and same(two[16:48], out) and not two[:16]["t"].any() and not two[48:]["t"].any()
    read_only = np.zeros(32, retrace.HIT)
    read_only.flags.writeable = False
    over = np.zeros(32 * 8 + 8)
    for bad in (np.zeros(31, retrace.HIT), np.zeros(33, retrace.HIT), np.zeros(32), np.zeros((32, 1), retrace.HIT), two[::2], read_only, "out", np.zeros(32, retrace.HIT)[::-1]):
        with pytest.raises(ValueError, match="out: "):
            engine.trace(rays, out=bad)
    over[:256] = rays.ravel()
    with pytest.raises(ValueError, match="out: lies over the rays"):
        engine.trace(over[:256].reshape(32, 8), out=over.view(np.uint8)[: 32 * 40].view(retrace.HIT))


def test_nothing_is_copied(square, engine):
    assert square.vertices.base is not None and not square.vertices.flags.owndata and not square.vertices.flags.writeable
    assert square.vertices.ctypes.data == square.vertices.ctypes.data
    assert engine.image.words.ctypes.data == engine.image.words.ctypes.data and not engine.image.words.flags.writeable
    np.testing.assert_array_equal(square.vertices, SQUARE[0][SQUARE[1]])
    np.testing.assert_array_equal(square.sources, [[0, 0, 0, 0], [0, 0, 0, 1]])
    with pytest.raises(ValueError):
        square.vertices[0] = 0


def test_views_keep_their_owner():
    vertices = retrace.Scene.from_arrays(*SQUARE).vertices
    words = retrace.Scene.from_arrays(*SQUARE).build().words
    engine = retrace.Scene.from_arrays(*SQUARE).build().engine("csim")
    gc.collect()
    np.testing.assert_array_equal(vertices, SQUARE[0][SQUARE[1]])
    assert len(words) > 8 and (engine.trace(downwards(3))["triangle"] == 0).all()


def test_scene_arrays():
    vertices, indices = SQUARE
    expected = retrace.Scene.from_arrays(vertices, indices).build().words
    for v, i in ((vertices.astype(np.float32), indices.astype(np.uint8)), (np.asfortranarray(vertices), np.asfortranarray(indices)), (vertices.tolist(), indices.tolist()),
                 (vertices.astype(int), indices.astype(np.uint64)), (np.repeat(vertices, 2, axis=0)[::2], indices[::-1][::-1])):
        np.testing.assert_array_equal(retrace.Scene.from_arrays(v, i).build().words, expected)
    for bad, text in ((4, "indices: triangle 1 names vertex 4 of 4"), (-1, "indices: triangle 1 names vertex -1 of 4")):
        wrong = indices.copy()
        wrong[1, 2] = bad
        with pytest.raises(retrace.Error, match=text):
            retrace.Scene.from_arrays(vertices, wrong)
    with pytest.raises(retrace.Error, match="18446744073709551615 is no index"):
        retrace.Scene.from_arrays(vertices, np.full((1, 3), 2**64 - 1, np.uint64))
    with pytest.raises(TypeError, match="indices: an array of integers"):
        retrace.Scene.from_arrays(vertices, indices.astype(float))
    with pytest.raises(TypeError, match="vertices: an array of real numbers"):
        retrace.Scene.from_arrays(vertices.astype(complex), indices)
    for shape in ((3,), (4, 2), (4, 4)):
        with pytest.raises(ValueError, match="vertices: an array of shape"):
            retrace.Scene.from_arrays(np.zeros(shape), indices)
    for value in (np.nan, np.inf, 1e300):  # beyond float32 is infinite there
        wrong = vertices.copy()
        wrong[2, 1] = value
        with pytest.raises(retrace.Error, match="node 0, mesh 0 'arrays', primitive 0.*vertex 2"):
            retrace.Scene.from_arrays(wrong, indices)


def test_nothing_to_hit():
    for vertices, indices in ((np.zeros((0, 3)), np.zeros((0, 3), int)), ([], []), (np.zeros((3, 3)), [[0, 1, 2]])):
        scene = retrace.Scene.from_arrays(vertices, indices)
        for kind in ("golden", "csim"):
            assert np.isinf(scene.build().engine(kind).trace(downwards(5))["t"]).all()
    assert scene.degenerate == 1


def test_rays():
    got = retrace.rays([1, 2, 3], [[0, 0, 1], [0, 1, 0]], t_min=[1, 2], t_max=5)
    np.testing.assert_array_equal(got, [[1, 2, 3, 1, 0, 0, 1, 5], [1, 2, 3, 2, 0, 1, 0, 5]])
    assert retrace.rays(np.zeros((0, 3)), [0, 0, 1]).shape == (0, 8)
    for origins, directions in (([1, 2], [0, 0, 1]), (np.zeros((2, 3)), np.zeros((3, 3))), (np.zeros((2, 2, 3)), [0, 0, 1])):
        with pytest.raises(ValueError):
            retrace.rays(origins, directions)


@pytest.mark.parametrize("column, value, text", [(0, np.nan, "origin is not finite"), (4, np.inf, "direction is not finite"), (3, np.nan, "t_min or t_max is not a number"),
                                                 (6, 0.0, "direction is zero")])
def test_no_ray(engine, column, value, text):
    rays = downwards(200000)
    rays[[150000, 199999, 131100], column] = value
    with pytest.raises(retrace.Error, match="^rays: ray 131100: ray: " + text + "$"):
        engine.trace(rays)
