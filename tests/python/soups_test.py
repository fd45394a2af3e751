"""Random soups of triangles: the kernels against the golden model, modes against each other, and golden against the definition of a hit."""
import hypothesis.strategies as st
import numpy as np
import retrace
from hypothesis import HealthCheck, given, settings

SETTINGS = settings(max_examples=60, deadline=None, suppress_health_check=list(HealthCheck), database=None, print_blob=True)


@st.composite
def soups(draw):
    """Triangles with whole coordinates in a box of 16 and an area of 1 or more, and rays between points of a somewhat larger box."""
    seed, count, rays = draw(st.integers(0, 2**32 - 1)), draw(st.integers(1, 60)), draw(st.integers(1, 300))
    flat = draw(st.sampled_from([None, 0, 1, 2]))
    random = np.random.default_rng(seed)
    vertices = random.integers(-8, 9, (count, 3, 3))
    if flat is not None:
        vertices[:, :, flat] = random.integers(-8, 9, (count, 1))  # each in a plane of an axis
    area = np.linalg.norm(np.cross(vertices[:, 1] - vertices[:, 0], vertices[:, 2] - vertices[:, 0]), axis=1) / 2
    vertices = vertices[area >= 1]
    origins, targets = random.uniform(-10, 10, (2, rays, 3))
    return vertices.astype(float), retrace.rays(origins, targets - origins, t_max=np.where(random.random(rays) < 0.2, random.uniform(0, 1, rays), np.inf))


def engines(vertices, **options):
    image = retrace.Scene.from_arrays(vertices.reshape(-1, 3), np.arange(3 * len(vertices)).reshape(-1, 3)).build(**options)
    return image.engine("golden"), image.engine("csim")


def doubtful(vertices, rays, hits):
    """Hits that rounding may decide: near an edge, at a grazing angle, near an end of the ray. Bounds: docs/error-bounds.md, with room for the size of the soup."""
    hit = np.isfinite(hits["t"])
    corners = vertices[np.where(hit, hits["triangle"], 0)]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    directions = rays[:, 4:7]
    cosine = np.abs((normals * directions).sum(1)) / (np.linalg.norm(normals, axis=1) * np.linalg.norm(directions, axis=1))
    smallest = np.minimum(np.minimum(hits["u"], hits["v"]), 1 - hits["u"] - hits["v"])
    length = np.linalg.norm(directions, axis=1)
    return hit & ((smallest < 0.01) | (cosine < 0.05) | (np.abs(np.where(hit, hits["t"], 0) - rays[:, 7]) * length < 1e-2) | (np.where(hit, hits["t"], 1) * length < 1e-2))


@SETTINGS
@given(soups())
def test_kernels_against_golden(soup):
    vertices, rays = soup
    if not len(vertices):
        return
    golden, csim = (engine.trace(rays) for engine in engines(vertices))
    length = np.linalg.norm(rays[:, 4:7], axis=1)
    with np.errstate(invalid="ignore"):
        near = np.abs(golden["t"] - csim["t"]) * length < 2e-3
    alike = (golden["triangle"] == csim["triangle"]) & (near | np.isinf(golden["t"]))
    level = np.isfinite(golden["t"]) & np.isfinite(csim["t"]) & near  # two triangles at one depth
    unclear = doubtful(vertices, rays, golden) | doubtful(vertices, rays, csim)
    wrong = np.flatnonzero(~(alike | level | unclear))
    assert not len(wrong), (rays[wrong], golden[wrong], csim[wrong])


@SETTINGS
@given(soups())
def test_golden_against_the_definition(soup):
    """Moeller and Trumbore's test of every ray with every triangle in doubles: the nearest."""
    vertices, rays = soup
    if not len(vertices):
        return
    hits = engines(vertices)[0].trace(rays)
    origins, directions = rays[:, None, 0:3], rays[:, None, 4:7]
    a, b = vertices[None, :, 1] - vertices[None, :, 0], vertices[None, :, 2] - vertices[None, :, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        p = np.cross(directions, b)
        determinant = (a * p).sum(-1)
        s = origins - vertices[None, :, 0]
        u = (s * p).sum(-1) / determinant
        q = np.cross(s, a)
        v = (directions * q).sum(-1) / determinant
        t = (b * q).sum(-1) / determinant
        inside = (u >= 0) & (v >= 0) & (u + v <= 1) & (t >= 0) & (t <= rays[:, None, 7])
    nearest = np.where(inside, t, np.inf).min(axis=1)
    with np.errstate(invalid="ignore"):
        near = (np.abs(nearest - hits["t"]) * np.linalg.norm(rays[:, 4:7], axis=1) < 2e-3) | (np.isinf(nearest) & np.isinf(hits["t"]))
    # Where an edge, the angle or an end of the ray decides, positions on the grid may differ from those given.
    unclear = doubtful(vertices, rays, hits) | np.any(~np.isnan(u) & (np.minimum(np.minimum(np.abs(u), np.abs(v)), np.abs(1 - u - v)) < 0.01) | (np.abs(determinant) < 5), axis=1)
    wrong = np.flatnonzero(~(near | unclear))
    assert not len(wrong), (rays[wrong], hits[wrong], nearest[wrong])


@SETTINGS
@given(soups(), st.sampled_from(["sah", "spatial-median", "object-median"]), st.integers(0, 12), st.booleans())
def test_modes_agree(soup, split, max_depth, clip):
    """Ways up, mailboxes, threads and trees change the work and no bit of a hit; any hit is a hit."""
    vertices, rays = soup
    if not len(vertices):
        return
    golden, csim = engines(vertices, split=split, max_depth=max_depth, clip=clip)
    plain = engines(vertices)
    for engine, reference, ways in ((golden, plain[0], ("stack", "parent", "face")), (csim, plain[1], ("parent", "face"))):
        hits = reference.trace(rays)
        for way in ways:
            for mailbox in (0, 8):
                got, work = engine.trace(rays, work=True, way_up=way, mailbox=mailbox, threads=1 + (mailbox > 0))
                assert got.tobytes() == hits.tobytes(), (engine.kind, way, mailbox)
                assert mailbox or not work["skipped"].any()
                assert way == "parent" or not work["up"].any()
        any_hit = engine.trace(rays, any=True)
        assert (np.isfinite(any_hit["t"]) == np.isfinite(hits["t"])).all() and (any_hit["t"] >= hits["t"]).all()
