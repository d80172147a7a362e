"""The laws through the Python API, against a judge written here in numpy: every triangle, every point."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import truefield as tf
from numpy.typing import NDArray
from solids import blob, cube

Floats = NDArray[np.float64]


def segment_distance(points: Floats, start: Floats, end: Floats) -> Floats:
    """(n, m) distances from n points to m segments."""
    along = end - start
    squared = np.einsum("mi,mi->m", along, along)
    offset = points[:, None, :] - start[None, :, :]
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.einsum("nmi,mi->nm", offset, along) / squared
    share = np.clip(np.nan_to_num(share), 0.0, 1.0)
    return np.asarray(np.linalg.norm(offset - share[..., None] * along, axis=2))


def triangle_distance(points: Floats, corners: Floats) -> Floats:
    """(n, m) distances from n points to m triangles: the height where the foot lies inside, else the nearest edge."""
    a, b, c = corners.transpose(1, 0, 2)
    edges = [segment_distance(points, *edge) for edge in ((a, b), (b, c), (c, a))]
    nearest = np.minimum(np.minimum(edges[0], edges[1]), edges[2])
    normal = np.cross(b - a, c - a)
    length = np.linalg.norm(normal, axis=1)
    inside = np.broadcast_to(length > 0.0, nearest.shape)
    for start, end in ((a, b), (b, c), (c, a)):
        inward = np.cross(normal, end - start)
        inside = inside & (np.einsum("nmi,mi->nm", points[:, None, :] - start, inward) > 0.0)
    height = np.abs(np.einsum("nmi,mi->nm", points[:, None, :] - a, normal)) / np.where(length > 0.0, length, 1.0)
    return np.asarray(np.where(inside, height, nearest))


def winding_number(points: Floats, corners: Floats) -> Floats:
    """(n,) generalised winding numbers (Jacobson et al. 2013, equation 6)."""
    a, b, c = (corners[None, :, i, :] - points[:, None, :] for i in range(3))
    x, y, z = (np.linalg.norm(v, axis=2) for v in (a, b, c))
    volume = np.einsum("nmi,nmi->nm", a, np.cross(b, c))
    below = x * y * z + (a * b).sum(2) * z + (b * c).sum(2) * x + (c * a).sum(2) * y
    return np.asarray(np.arctan2(volume, below).sum(axis=1) / (2.0 * np.pi))


def torus(n: int = 18, m: int = 10) -> tf.TriangleMesh:
    u, v = np.meshgrid(np.arange(n) * 2 * np.pi / n, np.arange(m) * 2 * np.pi / m, indexing="ij")
    r = 1.0 + 0.4 * np.cos(v)
    vertices = np.stack([r * np.cos(u), r * np.sin(u), 0.4 * np.sin(v)], axis=-1).reshape(-1, 3)
    triangles = []
    for i in range(n):
        for j in range(m):
            quad = [(i % n) * m + j % m for i, j in ((i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1))]
            triangles += [(quad[0], quad[1], quad[2]), (quad[0], quad[2], quad[3])]
    return tf.TriangleMesh(vertices, triangles, "torus")


def moved(mesh: tf.TriangleMesh, change: Callable[[Floats], Floats]) -> tf.TriangleMesh:
    return tf.TriangleMesh(change(mesh.vertices), mesh.triangles, mesh.name)


def soup(seed: int = 3) -> tf.TriangleMesh:
    random = np.random.default_rng(seed)
    corners = random.random((120, 1, 3)) + random.normal(0.0, 0.2, (120, 3, 3))
    return tf.TriangleMesh(corners.reshape(-1, 3), np.arange(360).reshape(-1, 3), "soup")


def slivers(seed: int = 4) -> tf.TriangleMesh:
    random = np.random.default_rng(seed)
    a = random.random((80, 3))
    b = a + random.normal(size=(80, 3))
    height = 10.0 ** random.uniform(-4.0, 0.0, (80, 1))
    c = a + (b - a) * random.random((80, 1)) + random.normal(size=(80, 3)) * height
    return tf.TriangleMesh(np.stack([a, b, c], axis=1).reshape(-1, 3), np.arange(240).reshape(-1, 3), "slivers")


CLOSED = {
    "cube": cube(),
    "blob": blob(),
    "torus": torus(),
    "far torus": moved(torus(), lambda v: v + np.array([1e6, -2e6, 3e6])),
    "tiny blob": moved(blob(), lambda v: v * 1e-30),
    "huge blob": moved(blob(), lambda v: v * 1e30),
}
OPEN = {
    "cube without a triangle": tf.TriangleMesh(cube().vertices, cube().triangles[1:]),
    "cube twice": tf.TriangleMesh(cube().vertices, np.concatenate([cube().triangles] * 2)),
    "inside out": tf.TriangleMesh(blob().vertices, blob().triangles[:, ::-1]),
    "one triangle": tf.TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]),
    "soup": soup(),
    "slivers": slivers(),
}
ALL = CLOSED | OPEN


def diagonal(mesh: tf.TriangleMesh) -> float:
    low, high = mesh.extent
    return float(np.linalg.norm(high - low))


def places(mesh: tf.TriangleMesh, count: int = 400, seed: int = 1) -> Floats:
    """Points in the box, near and on the surface, between, far; corners, edge middles, face centres."""
    random = np.random.default_rng(seed)
    low, high = mesh.extent
    size = high - low + 0.1 * diagonal(mesh)
    corners = mesh.corners[random.integers(len(mesh.triangles), size=count)]
    weights = random.dirichlet([1.0, 1.0, 1.0], count)
    on = np.einsum("nk,nki->ni", weights, corners)
    near = on + random.normal(size=(count, 3)) * diagonal(mesh) * 10.0 ** random.uniform(-9.0, -1.0, (count, 1))
    uniform = low - size / 2 + random.random((count, 3)) * 2 * size
    between = (on + random.permutation(on)) / 2
    far = (low + high) / 2 + random.normal(size=(count, 3)) * 1e3 * diagonal(mesh)
    some = slice(0, count // 4)
    special = [corners[some, 0], (corners[some, 0] + corners[some, 1]) / 2, corners[some].mean(axis=1)]
    return np.concatenate([uniform, near, on, between, far[some], *special])


def judged(mesh: tf.TriangleMesh, points: Floats) -> Floats:
    # Differences from a corner of the mesh: what rounding the judge adds far from the origin is then its own.
    origin = mesh.extent[0]
    return triangle_distance(points - origin, mesh.corners - origin)


def allowance(mesh: tf.TriangleMesh, points: Floats) -> Floats:
    """What rounding leaves: 1e-12 of the box, and a few units of far points and far meshes."""
    reach = np.linalg.norm(points, axis=1) + np.abs(mesh.vertices).max()
    return np.asarray(1e-12 * diagonal(mesh) + 1e-14 * reach)


def test_the_judge_is_right_about_a_triangle() -> None:
    corners = np.array([[[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 3.0, 0.0]]])
    points = [[1, 1, -2], [-3, -4, 0], [2, -1, 0], [-2, 1, 0], [4, 3, 0], [7, -4, 0], [0, 6, 4]]
    found = triangle_distance(np.array(points, dtype=np.float64), corners)[:, 0]
    np.testing.assert_allclose(found, [2.0, 5.0, 1.0, 2.0, 2.4, 5.0, 5.0], rtol=1e-15)
    winding = winding_number(np.array([[0.5, 0.5, 0.5], [2.0, 0.5, 0.5]]), cube().corners)
    np.testing.assert_allclose(winding, [1.0, 0.0], atol=1e-12)


@pytest.mark.parametrize("name", ALL)
def test_distance_and_nearest_are_those_of_brute_force(name: str) -> None:
    mesh = ALL[name]
    points = places(mesh)
    all_distances, allowed = judged(mesh, points), allowance(mesh, points)
    truth = all_distances.min(axis=1)
    surface = tf.Surface(mesh)
    assert np.all(np.abs(np.abs(surface.distance(points)) - truth) <= allowed)
    hit = surface.nearest(points)
    np.testing.assert_array_equal(hit.distance, surface.distance(points))
    rows = np.arange(len(points))
    assert np.all(np.abs(all_distances[rows, hit.triangle] - truth) <= allowed), "the triangle is a nearest one"
    apart = np.linalg.norm(hit.point - points, axis=1)
    assert np.all(np.abs(apart - np.abs(hit.distance)) <= allowed), "the point is as far as stated"
    off = np.concatenate(
        [
            triangle_distance((p - mesh.extent[0])[None], (mesh.corners[t] - mesh.extent[0])[None])[0]
            for p, t in zip(hit.point, hit.triangle, strict=True)
        ]
    )
    assert np.all(off <= allowed), "the point lies on the triangle"
    np.testing.assert_allclose(np.linalg.norm(hit.normal, axis=1), 1.0, atol=1e-9)
    corner = hit.feature >= 4
    named = mesh.corners[hit.triangle[corner], hit.feature[corner].astype(np.int64) - 4]
    np.testing.assert_array_equal(hit.point[corner], named, err_msg="a corner is the corner itself")


@pytest.mark.parametrize("name", CLOSED)
@pytest.mark.parametrize("sign", ["auto", "winding"])
def test_signs_are_those_of_the_winding_number(name: str, sign: tf.fields.Sign) -> None:
    mesh = CLOSED[name]
    points = places(mesh)
    surface = tf.Surface(mesh, sign)
    truth = judged(mesh, points).min(axis=1)
    lower, upper = surface.bounds(points)
    away = truth > 1e-7 * diagonal(mesh)
    inside = winding_number(points - mesh.extent[0], mesh.corners - mesh.extent[0]) > 0.5
    assert np.any(inside & away)
    assert np.any(~inside & away)
    np.testing.assert_array_equal(lower[away], upper[away], err_msg="away from the surface nothing is in doubt")
    np.testing.assert_array_equal(surface.distance(points)[away] < 0.0, inside[away])
    assert np.all((lower <= surface.distance(points)) & (surface.distance(points) <= upper))


@pytest.mark.parametrize("name", ALL)
def test_bounds_hold_the_truth(name: str) -> None:
    mesh = ALL[name]
    points = places(mesh, seed=2)
    truth, allowed = judged(mesh, points).min(axis=1), allowance(mesh, points)
    for field in (tf.Surface(mesh), tf.complete_field(mesh, resolution=9)):
        lower, upper = field.bounds(points)
        on_a_side = [(lower - allowed <= side * truth) & (side * truth <= upper + allowed) for side in (-1.0, 1.0)]
        assert np.all(on_a_side[0] | on_a_side[1])
        doubtful = lower < upper
        np.testing.assert_array_equal(lower[doubtful], -upper[doubtful])


@pytest.mark.parametrize("name", ALL)
@pytest.mark.parametrize("resolution", [1, 7, 32])
def test_a_complete_field_is_its_surface(name: str, resolution: int) -> None:
    mesh = ALL[name]
    surface = tf.Surface(mesh)
    points = places(mesh, seed=resolution)
    expected = surface.nearest(points)
    for field in (
        tf.complete_field(surface, resolution),
        tf.complete_field(mesh, cell_size=diagonal(mesh) / resolution, region="inside"),
    ):
        found = field.nearest(points)
        np.testing.assert_array_equal(np.abs(found.distance), np.abs(expected.distance))
        np.testing.assert_array_equal(np.abs(field.distance(points)), np.abs(expected.distance))
        np.testing.assert_array_equal(found.triangle, expected.triangle)
        np.testing.assert_array_equal(found.point, expected.point)
        np.testing.assert_array_equal(found.feature, expected.feature)
        lower, upper = field.bounds(points)
        of_surface = surface.bounds(points)
        assert np.all((of_surface[0] <= lower) & (lower <= upper) & (upper <= of_surface[1]))


@pytest.mark.parametrize("name", ALL)
@pytest.mark.parametrize("band", [None, 0.07])
def test_samples_enclose_the_truth(name: str, band: float | None) -> None:
    mesh = ALL[name]
    surface = tf.Surface(mesh)
    width = None if band is None else band * diagonal(mesh)
    grid = surface.sample(resolution=13, margin=0.1 * diagonal(mesh), band=width)
    index = np.stack(np.meshgrid(*map(np.arange, grid.shape), indexing="ij"), axis=-1)
    points = (grid.origin + grid.spacing * index).reshape(-1, 3)
    truth, allowed = judged(mesh, points).min(axis=1), allowance(mesh, points)
    values, lower, upper = (a.ravel().astype(np.float64) for a in (grid.values, grid.lower, grid.upper))
    assert grid.values.dtype == grid.lower.dtype == grid.upper.dtype == np.float32
    assert grid.values.shape == grid.lower.shape == grid.shape
    sides = np.sign(surface.distance(points))
    known = lower * upper > 0.0
    assert np.all((lower - allowed <= sides * truth) & (sides * truth <= upper + allowed))
    assert np.all((lower <= values) & (values <= upper))
    within = known & (truth < (np.inf if width is None else 0.99 * width))
    if 1e-30 < diagonal(mesh) < 1e30:
        assert np.all(upper[within] - lower[within] <= 3e-7 * truth[within])
    between = places(mesh, seed=5)
    low, high = grid.bounds(between)
    truth = judged(mesh, between).min(axis=1)
    held = [
        (low <= side * truth + 1e-9 * diagonal(mesh)) & (side * truth - 1e-9 * diagonal(mesh) <= high)
        for side in (-1, 1)
    ]
    assert np.all(held[0] | held[1])


@pytest.mark.parametrize("name", ["blob", "far torus", "soup", "cube twice"])
def test_threads_do_not_matter(name: str) -> None:
    mesh = ALL[name]
    points = places(mesh, seed=6)

    def answers(threads: int) -> list[bytes]:
        surface = tf.Surface(mesh, threads=threads)
        field = tf.complete_field(mesh, 20, threads=threads)
        grid = surface.sample(resolution=30, threads=threads)
        hits = [answering.nearest(points, threads=threads) for answering in (surface, field)]
        arrays = [getattr(hit, part) for hit in hits for part in ("distance", "point", "triangle", "feature", "normal")]
        arrays += [
            *surface.bounds(points, threads=threads),
            *field.bounds(points, threads=threads),
            grid.values,
            grid.lower,
        ]
        return [array.tobytes() for array in arrays]

    assert answers(1) == answers(2) == answers(7)


@pytest.mark.parametrize("power", [-300, -90, -1, 1, 17, 300])
def test_powers_of_two_change_no_bit(power: int) -> None:
    mesh, points = blob(), places(blob())
    factor = 2.0**power
    surface, scaled = tf.Surface(mesh), tf.Surface(moved(mesh, lambda v: v * factor))
    np.testing.assert_array_equal(scaled.distance(points * factor), surface.distance(points) * factor)
    np.testing.assert_array_equal(scaled.nearest(points * factor).point, surface.nearest(points).point * factor)
    np.testing.assert_array_equal(scaled.nearest(points * factor).triangle, surface.nearest(points).triangle)


@pytest.mark.parametrize("name", CLOSED)
def test_gradients_are_those_of_the_distance(name: str) -> None:
    mesh = CLOSED[name]
    if np.abs(mesh.vertices).max() > 1e3 * diagonal(mesh):
        pytest.skip("coordinates far from the origin have no digits to spare for differences")
    surface, step = tf.Surface(mesh), 1e-6 * diagonal(mesh)
    points = places(mesh, seed=7)
    moves = [(surface.distance(points + e) - surface.distance(points - e)) / (2 * step) for e in np.eye(3) * step]
    difference = np.stack(moves, axis=1)
    smooth = (np.abs(np.linalg.norm(difference, axis=1) - 1.0) < 1e-3) & (np.abs(surface.distance(points)) > 100 * step)
    assert smooth.sum() > len(points) / 4
    agreement = np.einsum("ni,ni->n", surface.gradient(points), difference)[smooth]
    assert np.all(agreement > 0.995)


def test_ties_go_to_the_lowest_index() -> None:
    mesh, count = OPEN["cube twice"], len(cube().triangles)
    assert tf.Surface(mesh).nearest(places(mesh)).triangle.max() < count
    assert tf.complete_field(mesh, 10).nearest(places(mesh)).triangle.max() < count


@pytest.mark.parametrize(
    "points", [[[1.0, 2.0]], np.zeros((2, 2, 3)), np.zeros(4), 5.0, "points", [["a", "b", "c"]], None]
)
def test_points_of_another_shape_are_refused_in_a_sentence(points: Any) -> None:
    surface = tf.Surface(cube())
    field = tf.complete_field(surface, 4)
    grid = surface.sample(resolution=4)
    for ask in (
        surface.distance,
        surface.bounds,
        surface.nearest,
        surface.gradient,
        field.distance,
        grid.distance,
        grid.bounds,
    ):
        with pytest.raises(ValueError, match=r"points .*give an array of shape \(n, 3\)") as error:
            ask(points)
        assert "\n" not in str(error.value)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_points_that_are_not_finite_are_named(bad: float) -> None:
    surface = tf.Surface(cube())
    for answering in (surface, tf.complete_field(surface, 4)):
        with pytest.raises(ValueError, match=r"point 1 is .*finite"):
            answering.distance([[0.0, 0.0, 0.0], [0.0, bad, 0.0]])


def test_no_points_give_no_answers() -> None:
    surface = tf.Surface(cube())
    for answering in (surface, tf.complete_field(surface, 4)):
        assert answering.distance(np.empty((0, 3))).shape == (0,)
        assert answering.nearest(np.empty((0, 3))).point.shape == (0, 3)
        assert answering.distance([0.5, 0.5, 0.5]).tolist() == [-0.5]


def test_arguments_that_cannot_be_are_refused() -> None:
    mesh, surface = cube(), tf.Surface(cube())
    for resolution in (0, -3, 2.5, True, "many", 10**12):
        with pytest.raises(ValueError, match="resolution"):
            tf.complete_field(mesh, resolution)  # type: ignore[arg-type]
    for size in (0.0, -1.0, np.nan, np.inf, "small"):
        with pytest.raises(ValueError, match="cell_size"):
            tf.complete_field(mesh, cell_size=size)  # type: ignore[arg-type]
        with pytest.raises(ValueError, match="spacing"):
            surface.sample(spacing=size)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="not both"):
        tf.complete_field(mesh, 3, 0.1)
    with pytest.raises(MemoryError, match="complete field"):
        tf.complete_field(mesh, 1000, memory=1000)
    with pytest.raises(MemoryError, match="samples"):
        surface.sample(1_000_000)
    for band in (0.0, -1.0, np.nan):
        with pytest.raises(ValueError, match="band"):
            surface.sample(4, band=band)
    with pytest.raises(ValueError, match="threads"):
        surface.distance([0, 0, 0], threads=0)
    with pytest.raises(ValueError, match="sign"):
        tf.Surface(mesh, "guess")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="region"):
        tf.complete_field(mesh, 4, region="outside")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="TriangleMesh"):
        tf.Surface([[0, 0, 0]])  # type: ignore[arg-type]


@pytest.mark.parametrize("name", ["cube", "torus", "soup"])
@pytest.mark.parametrize("distance", [-0.1, 0.15])
@pytest.mark.parametrize("placement", ["lattice", "projected"])
def test_contours_keep_both_guarantees(name: str, distance: float, placement: tf.sampled.Placement) -> None:
    mesh, tolerance = ALL[name], 0.06
    surface = tf.Surface(mesh, "auto" if name in CLOSED else "unsigned")
    distance = distance if name in CLOSED else abs(distance)
    cloud = surface.contour(distance, tolerance, placement=placement)
    of_field = tf.complete_field(surface, 8).contour(distance, tolerance, placement=placement)
    np.testing.assert_array_equal(of_field.points, cloud.points)

    def truth(points: Floats) -> Floats:
        unsigned = judged(mesh, points).min(axis=1)
        inside = (name in CLOSED) & (winding_number(points, mesh.corners) > 0.5)
        return np.asarray(np.where(inside, -unsigned, unsigned))

    assert cloud.normals is not None
    assert cloud.triangle is not None
    some = np.random.default_rng(8).choice(len(cloud.points), min(400, len(cloud.points)), replace=False)
    assert np.all(np.abs(truth(cloud.points[some]) - distance) <= tolerance / 2 + 1e-12)
    np.testing.assert_allclose(np.linalg.norm(cloud.normals, axis=1), 1.0, atol=1e-9)
    nearest = judged(mesh, cloud.points[some])
    own = nearest[np.arange(len(some)), cloud.triangle[some]]
    np.testing.assert_allclose(own, nearest.min(axis=1), atol=1e-12)
    starts = places(mesh, count=200, seed=9)
    hit = surface.nearest(starts)
    on_it = hit.point + hit.normal * distance
    on_it = on_it[np.abs(truth(on_it) - distance) <= 1e-12]
    assert len(on_it) > 50
    apart = np.array([np.linalg.norm(cloud.points - p, axis=1).min() for p in on_it])
    assert np.all(apart <= (0.5 if placement == "lattice" else 1.0) * tolerance + 1e-12)
