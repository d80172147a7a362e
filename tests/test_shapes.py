"""Shapes are what they claim: manifold, outward, of the stated size, count, volume and greatest depth."""

from __future__ import annotations

import functools
import itertools
import math

import brute
import numpy as np
import pytest
import trimesh
from crossings import piercings
from truefield import shapes
from truefield.errors import TruefieldError
from truefield.mesh import TriangleMesh


@functools.cache
def _made(name: str) -> TriangleMesh:
    return shapes.make(name)


def _solid(mesh: TriangleMesh) -> trimesh.Trimesh:
    return trimesh.Trimesh(mesh.vertices, mesh.triangles, process=False)


def _size(mesh: TriangleMesh) -> list[float]:
    lower, upper = mesh.extent
    return [float(length) for length in upper - lower]


@pytest.mark.parametrize("name", shapes.names())
def test_every_shape_is_one_closed_outward_solid_without_flat_triangles(name: str) -> None:
    mesh = _made(name)
    solid = _solid(mesh)
    assert solid.is_watertight
    assert solid.is_winding_consistent
    assert solid.volume > 0.0
    assert len(np.unique(mesh.vertices, axis=0)) == len(mesh.vertices)
    a, b, c = np.moveaxis(mesh.vertices[mesh.triangles], 1, 0)
    longest = np.max(
        [np.linalg.norm(a - b, axis=1), np.linalg.norm(b - c, axis=1), np.linalg.norm(c - a, axis=1)], axis=0
    )
    area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
    assert np.all(area > 1e-8 * longest**2)


@pytest.mark.parametrize("name", shapes.names())
def test_the_mesh_report_finds_nothing_wrong_with_a_shape(name: str) -> None:
    assert _made(name).check().problems() == []


@pytest.mark.parametrize("name", shapes.names())
def test_a_shape_is_the_same_every_time(name: str) -> None:
    first, second = _made(name), shapes.make(name)
    assert first.vertices.tobytes() == second.vertices.tobytes()
    assert first.triangles.tobytes() == second.triangles.tobytes()


@pytest.mark.parametrize(
    ("name", "count", "size", "volume"),
    [
        ("cube", 12, (5, 5, 5), 125.0),
        ("tetrahedron", 4, (1, 1, 1), 1 / 6),
        ("one_ended_tooth", 16, (1, 2, 2), 2.575),
        ("two_ended_tooth", 20, (1, 2, 3.85), 4.85),
        ("six_pointed_star", 48, (1, 3, 2 * math.sqrt(3)), 3 * math.sqrt(3)),
    ],
)
def test_simple_models_have_the_papers_counts_and_boxes(
    name: str, count: int, size: tuple[float, ...], volume: float
) -> None:
    mesh = _made(name)
    assert len(mesh.triangles) == count
    assert _size(mesh) == pytest.approx(size, abs=1e-12)
    assert _solid(mesh).volume == pytest.approx(volume, rel=1e-12)


def test_analytic_volumes_are_exact() -> None:
    n = 37
    prism = 0.5 * n * math.sin(2 * math.pi / n) * 3.0**2 * 4.0
    assert _solid(shapes.cylinder(3.0, 4.0, n)).volume == pytest.approx(prism, rel=1e-11)
    assert _solid(shapes.box((2.0, 3.0, 5.0))).volume == pytest.approx(30.0, rel=1e-14)
    assert _solid(shapes.plate((7.0, 3.0), 0.25)).volume == pytest.approx(5.25, rel=1e-14)
    assert _solid(shapes.wedge((4.0, 2.0, 1.0))).volume == pytest.approx(4.0, rel=1e-14)


def test_curved_solids_approach_the_smooth_ones() -> None:
    errors = [4 / 3 * math.pi - _solid(shapes.sphere(1.0, level)).volume for level in (2, 3, 4, 5)]
    assert all(3.0 < coarse / fine < 5.0 for coarse, fine in itertools.pairwise(errors))
    smooth = 2 * math.pi**2 * 3.0
    assert 0.0 < smooth - _solid(shapes.torus(3.0, 1.0, (192, 96))).volume < 2e-3 * smooth
    assert _solid(shapes.torus()).euler_number == 0


@pytest.mark.parametrize(
    ("name", "least", "most", "size"),
    [
        ("connector", 328, 328, (6.9, 2.0, 2.9)),
        ("brevi", 1_700, 2_000, (38.1, 34.9, 96.0)),
        ("housing", 15_000, 25_000, (160.0, 110.0, 80.0)),
        ("cylinder_head", 120_000, 150_000, (266.0, 480.0, 157.0)),
    ],
)
def test_parts_have_their_size_and_survive_float32(
    name: str, least: int, most: int, size: tuple[float, float, float]
) -> None:
    # Counts are not pinned to the triangle: they may change with the version of manifold3d.
    mesh = _made(name)
    assert least <= len(mesh.triangles) <= most
    assert _size(mesh) == pytest.approx(size, abs=5e-5)
    assert np.array_equal(mesh.vertices, mesh.vertices.astype(np.float32))
    assert len(_solid(mesh).split(only_watertight=False)) == 1


@pytest.mark.parametrize(
    ("mesh", "spacing", "depth"),
    [
        (shapes.cube(), 0.7, 2.5),
        (shapes.tetrahedron(), 0.1, 1 / (3 + math.sqrt(3))),
        (shapes.one_ended_tooth(), 0.12, 2 / (2.425 + math.hypot(1.425, 1))),
        (shapes.two_ended_tooth(), 0.17, 0.5),
        (shapes.six_pointed_star(), 0.17, 0.5),
        (shapes.wedge((4.0, 6.0, 1.0)), 0.3, 4 / (5 + math.hypot(4, 1))),
        (shapes.wedge((4.0, 0.5, 3.0)), 0.11, 0.25),
        (shapes.cylinder(1.0, 5.0, 12), 0.3, math.cos(math.pi / 12)),
        (shapes.plate((3.0, 2.0), 0.4), 0.11, 0.2),
        (shapes.connector(), 0.13, 0.5015),
        (shapes.brevi(), 3.0, 13.0),
    ],
    ids=lambda value: value.name if isinstance(value, TriangleMesh) else "",
)
def test_greatest_depth_is_the_claimed_one(mesh: TriangleMesh, spacing: float, depth: float) -> None:
    found, _ = brute.greatest_depth(mesh, spacing)
    assert found == pytest.approx(depth, rel=2e-3)


def test_sphere_is_deepest_at_its_centre_by_its_lowest_plane() -> None:
    mesh = shapes.sphere(2.0, 3)
    a, b, c = np.moveaxis(mesh.corners, 1, 0)
    normal = np.cross(b - a, c - a)
    planes = np.abs((normal * a).sum(axis=1)) / np.linalg.norm(normal, axis=1)
    assert brute.distances(mesh, np.zeros((1, 3)))[0] == pytest.approx(planes.min(), rel=1e-14)
    assert 1.9 < planes.min() < 2.0


def _thinner(mesh: TriangleMesh, spacing: float, depth: float, count: int = 400) -> float:
    """The share of inside points less deep than `depth`, from points drawn evenly."""
    points = brute.interior(mesh, spacing)
    drawn = points[np.random.default_rng(7).permutation(len(points))[:count]]
    return float(np.mean(brute.distances(mesh, drawn) < depth))


@pytest.mark.parametrize(
    ("name", "heavy"),
    [
        ("housing", {(0, 38, 36): 8.496, (-35, 0, 74): 5.5, (58, 1, 5): 5.38, (-58, 1, 5): 5.38}),
        (
            "cylinder_head",
            {(105, 352, 40): 10.6, (105, 128, 40): 10.2, (-103, 352, 17): 9.6, (-103, 128, 17): 9.2},
        ),
    ],
)
def test_castings_are_thin_but_for_the_heavy_places_they_claim(
    name: str, heavy: dict[tuple[int, int, int], float]
) -> None:
    mesh = _made(name)
    deepest = max(heavy.values())
    assert _thinner(mesh, 5.0, 0.5 * deepest) > 0.98
    assert _thinner(mesh, 4.1, 1.01 * deepest) == 1.0
    for place, depth in heavy.items():
        found, _ = brute.climb(mesh, np.array(place, dtype=np.float64), 1.0, 0.02)
        assert found == pytest.approx(depth, rel=0.01)


@pytest.mark.parametrize(
    ("mesh", "cell"),
    [(shapes.connector(), 0.5), (shapes.brevi(), 3.0), (shapes.housing(), 3.0), (shapes.torus(), 0.2)],
    ids=lambda value: value.name if isinstance(value, TriangleMesh) else "",
)
def test_parts_do_not_cut_themselves(mesh: TriangleMesh, cell: float) -> None:
    assert len(piercings(mesh, cell)) == 0


def test_a_mesh_that_cuts_itself_would_be_found() -> None:
    first, second = shapes.box(2.0), shapes.sphere(1.0, 3)
    both = TriangleMesh(
        np.vstack([first.vertices, second.vertices + 0.1]),
        np.vstack([first.triangles, second.triangles + len(first.vertices)]),
    )
    assert len(piercings(both, 0.3)) > 20


def test_brute_force_that_halves_equals_brute_force_that_does_not() -> None:
    mesh = shapes.brevi()
    points = np.random.default_rng(3).uniform(-60.0, 120.0, (150, 3))
    every = brute.to_triangles(
        np.repeat(points, len(mesh.triangles), axis=0), np.tile(mesh.corners, (len(points), 1, 1))
    ).reshape(len(points), -1)
    assert np.array_equal(brute.distances(mesh, points), every.min(axis=1))


@pytest.mark.parametrize("name", ["brevi", "torus"])
def test_brute_force_inside_agrees_with_the_volume(name: str) -> None:
    mesh = _made(name)
    volume = _solid(mesh).volume
    spacing = (volume / 20_000) ** (1 / 3)
    assert len(brute.interior(mesh, spacing)) * spacing**3 == pytest.approx(volume, rel=0.01)


@pytest.mark.parametrize(
    ("name", "options", "words"),
    [
        ("gearbox", {}, "no shape called 'gearbox'"),
        ("cube", {"edge": 3.0}, "edge"),
        ("box", {"size": (1.0, -1.0, 1.0)}, "positive"),
        ("box", {"size": (1.0, 1.0)}, "three"),
        ("plate", {"size": (1.0,)}, "two numbers"),
        ("cylinder", {"segments": 2}, "at least 3"),
        ("torus", {"tube_radius": 4.0}, "thinner"),
        ("sphere", {"subdivisions": 11}, "0..10"),
        ("sphere", {"radius": math.nan}, "finite"),
        ("tetrahedron", {"size": -1.0}, "positive"),
    ],
)
def test_impossible_shapes_are_refused_in_one_sentence(name: str, options: dict[str, object], words: str) -> None:
    with pytest.raises(TruefieldError, match=words):
        shapes.make(name, **options)
